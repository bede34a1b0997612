"""`check --runs`: rows that depend on their number alone, kept one by one, and what they say."""

import json
import pickle
import sys
from dataclasses import replace

import numpy as np
import pytest
from check_loops import MASS, RIG, SPEC, heavy_is_slow, record
from commands import call

from studies.checked_runs import CheckedRuns, check_rig
from studies.checking import Loops, drawn_plant
from studies.following_check import Followed, FollowingCheck
from studies.many_runs import Piece, Setup, rows_of, worked
from studies.specification import read_specification
from studies.workers import Workers
from workbench.errors import InputError
from workbench.rig import default_rig, load_rig

TIMES = ("solve_median_s", "solve_p99_s", "estimate_median_s")


@pytest.fixture
def stepping(lq):
    """Steps of the drive under LQ, with the lines of a specification."""
    spec = read_specification(SPEC, RIG)
    return Setup(RIG, lq, lq.read_text(), ("ekf",), ("step",), spec.asked)


def timeless(rows):
    """Rows without the wall time of their loops, which differs from run to run."""
    found = json.loads(json.dumps(rows))
    for row in found:
        row.pop("key", None)
        for loop in row["loops"]:
            for name in TIMES:
                loop.get("metrics", {}).pop(name, None)
    return found


def lost_at(number, error, loops, plant, seed):
    if seed == number:
        raise error
    return heavy_is_slow(loops, plant, seed)


def test_the_plant_of_a_run_depends_on_its_number_alone():
    again = default_rig("servo_drive")
    fifth = drawn_plant(RIG, 4).values
    [drawn_plant(again, k) for k in (2, 7)]

    assert drawn_plant(again, 4).values == fifth
    assert drawn_plant(RIG, 0) is RIG.plant
    assert len({drawn_plant(RIG, k).values[MASS] for k in range(6)}) == 6


def test_rows_are_the_same_with_two_workers_and_after_a_kill(stepping, tmp_path):
    one, two, cut = (tmp_path / name for name in ("one", "two", "cut"))
    rows = rows_of(stepping, 3, Workers(1), one)
    others = rows_of(stepping, 3, Workers(2), two)
    first, second, _ = one.read_text().splitlines(keepends=True)
    cut.write_text(first + second[: len(second) // 2])
    after = rows_of(stepping, 3, Workers(1), cut)

    assert timeless(rows) == timeless(others) == timeless(after)
    assert after[0] == rows[0]
    assert len({row["loops"][0]["metrics"]["air_kg"] for row in rows}) == 3


def test_a_row_holds_numbers_and_words_and_no_record(stepping):
    row = worked(Piece(stepping, 1))
    (loop,) = row["loops"]

    assert len(json.dumps(row, allow_nan=False)) < 5000
    assert loop["metrics"]["scenario"] == "step"
    assert set(loop["lines"]) == {"rise_time", "air", "limits.chamber_a.pressure"}
    assert 5e5 < loop["lines"]["limits.chamber_a.pressure"] < 9e5


def test_what_decides_a_run_is_in_its_key_and_rows_of_others_are_not_mixed_in(
    stepping, monkeypatch, tmp_path
):
    monkeypatch.setattr(Loops, "once", heavy_is_slow)
    heavier = RIG.plant.with_values({MASS: 3.0})
    others = [
        replace(stepping, rig=replace(RIG, plant=heavier)),
        replace(stepping, rig=replace(RIG, deviations={MASS: 0.2})),
        replace(stepping, rig=replace(RIG, fixed=frozenset({MASS}))),
        replace(stepping, design=stepping.design + "# by somebody else\n"),
        replace(stepping, estimators=("ukf",)),
        replace(stepping, scenarios=("sine",)),
        replace(stepping, asked=stepping.asked[:1]),
        replace(stepping, asked=(replace(stepping.asked[0], most=0.2), *stepping.asked[1:])),
    ]
    keys = {setup.key for setup in (stepping, *others)}
    path = tmp_path / "rows"
    mine = rows_of(stepping, 3, Workers(1), path)
    theirs = rows_of(others[1], 3, Workers(1), path)

    assert len(keys) == 1 + len(others)
    assert replace(stepping, path=stepping.path) == stepping
    assert mine[0]["key"] != theirs[0]["key"]
    assert mine[1]["loops"] != theirs[1]["loops"]
    assert len(path.read_text().splitlines()) == 6


def test_a_plant_from_a_file_of_its_own_reaches_another_process(stepping, tmp_path):
    """Where a class of that file is unknown until the file was read there."""
    own = tmp_path / "own.py"
    own.write_text(
        "from dataclasses import dataclass, replace\n"
        "from workbench.plants.servo_drive import servo_drive\n"
        "plain = servo_drive()\n"
        "@dataclass(frozen=True, kw_only=True)\n"
        "class Mine(type(plain.effects[0])):\n"
        "    '''As it is, by another name.'''\n"
        "def drive():\n"
        "    first, *rest = plain.effects\n"
        "    return replace(plain, effects=(Mine(**vars(first)), *rest))\n"
    )
    rig = load_rig(f'plant = "{own}:drive"\n')
    setup = replace(stepping, rig=rig)
    module = type(rig.plant.effects[0]).__module__
    sent = pickle.dumps(setup)
    del sys.modules[module]
    there = pickle.loads(sent)

    assert module in sys.modules and there == setup
    assert there.rig.plant.values == rig.plant.values
    own.write_text(own.read_text() + "# other equations\n")
    assert replace(setup, path=setup.path).key != setup.key


@pytest.mark.parametrize(
    "error", [ArithmeticError("not finite"), np.linalg.LinAlgError("not finite"),
              RuntimeError("not finite\nin CasADi")],
)  # fmt: skip
def test_a_lost_loop_misses_every_line_and_stops_no_other(stepping, lq, monkeypatch, error):
    monkeypatch.setattr(Loops, "once", lambda *given: lost_at(2, error, *given))
    asked = read_specification(SPEC, RIG)
    found = check_rig(RIG, lq, ["ekf"], ["step"], spec=asked, runs=4)
    free = check_rig(RIG, lq, ["ekf"], ["step"], runs=4)

    assert [line.missed.tolist()[2] for line in found.robustness.lines] == [True] * 3
    assert not found.met and not free.met
    assert [(each.run, each.said) for each in found.lost] == [(3, "not finite")]
    entry = found.document["runs"][2]
    assert (entry["lost"], entry["reached"], entry["rise_s"]) == ("not finite", False, None)
    assert "lost" not in found.document["runs"][3]
    assert found.document["specification"][0]["found_by_run"][2] is None
    assert [each["probability"] for each in free.document["robustness"]] == [0.25]
    assert "run 3 was lost in step with ekf: not finite\n  run 3: " in found.text
    json.dumps(found.document, allow_nan=False)


def test_what_is_no_lost_loop_is_not_counted_as_one(stepping, lq, monkeypatch):
    bug = NotImplementedError("of a method")
    monkeypatch.setattr(Loops, "once", lambda *given: lost_at(0, bug, *given))
    with pytest.raises(NotImplementedError):
        check_rig(RIG, lq, ["ekf"], ["step"], runs=2)


def test_the_only_run_that_is_lost_is_an_error(lq, monkeypatch):
    lost = ArithmeticError("not finite")
    monkeypatch.setattr(Loops, "once", lambda *given: lost_at(0, lost, *given))
    with pytest.raises(ArithmeticError, match="not finite"):
        check_rig(RIG, lq, ["ekf"], ["step"])


def test_time_outside_the_limits_of_a_specification_is_counted_too(lq):
    """A step goes faster than 50 mm/s for most of its way; a limit of the plant it hardly meets."""
    asked = read_specification('[limits]\n"slide.velocity" = "50 mm/s"\n', RIG)
    slow, free = (
        check_rig(RIG, lq, ["ekf"], ["step"], spec=spec).found.rows[0] for spec in (asked, None)
    )

    assert slow.violation_s - free.violation_s > 0.5 * slow.rise_s > free.violation_s


def test_figures_of_a_plant_with_a_bench_come_back_from_their_rows(lq, monkeypatch):
    rig = default_rig("crr_rig")
    run = {"figures": {"rmse_rad": float("inf")}, "asked": {"rmse_rad": 0.1}}
    times = dict.fromkeys(TIMES, 1e-4)
    row = Followed(design="lq", estimator="ekf", scenario="sine", **run, **times)
    once = FollowingCheck((row,), (record(),))
    monkeypatch.setattr(Loops, "once", lambda *given: once)
    loops = Loops(rig, {}, ("ekf",), ("sine",))
    monkeypatch.setattr("studies.many_runs.loops_of", lambda *given: loops)
    setup = Setup(rig, lq, "")
    found = CheckedRuns(setup, (worked(Piece(setup, 0)),))

    assert found.found.rows == (row,)
    assert not found.met


def test_a_second_start_of_the_same_command_goes_on(lq, monkeypatch, tmp_path):
    rig, spec, keep = (tmp_path / name for name in ("rig.toml", "spec.toml", "rows.jsonl"))
    rig.write_text('plant = "servo_drive"\n')
    spec.write_text(SPEC)
    done = []

    def counted(loops, plant, seed):
        done.append(seed)
        return heavy_is_slow(loops, plant, seed)

    monkeypatch.setattr(Loops, "once", counted)
    answers = [
        call(
            "check", rig, lq, "--scenario", "step", "--spec", spec, "--runs", runs,
            "--workers", 1, "--keep", keep, "--json", tmp_path / f"{k}.json",
        )
        for k, runs in enumerate((2, 5, 5))
    ]  # fmt: skip

    assert done == [0, 1, 2, 3, 4]
    assert "run 5 of 5" in answers[1].stderr
    assert answers[1].stdout == answers[2].stdout
    assert (tmp_path / "1.json").read_text() == (tmp_path / "2.json").read_text()
    document = json.loads((tmp_path / "2.json").read_text())
    missed = sum(run["rise_s"] > 0.15 for run in document["runs"])
    assert document["robustness"][0]["probability"] == missed / 5
    assert answers[2].exit_code == (1 if missed else 0)


def test_a_file_that_holds_something_else_is_not_written_to(lq):
    before = lq.read_text()
    with pytest.raises(InputError, match="holds no runs of a check; expected a new file"):
        check_rig(RIG, lq, ["ekf"], ["step"], runs=2, keep=lq)
    assert lq.read_text() == before


def test_a_cluster_brings_its_own_workers(lq, tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text('plant = "servo_drive"\n')
    answer = call("check", rig, lq, "--workers", 2, "--scheduler", "tcp://127.0.0.1:1")

    assert answer.exit_code == 2
    assert "a cluster has its own workers" in answer.stderr
