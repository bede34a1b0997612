"""`design --spec` and `check --spec`: the same verdicts in table, JSON and exit code."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from commands import call

README = Path(__file__).parents[1] / "README.md"
FIVE = next(text for text in README.read_text().split("```toml\n") if "rise_time" in text)
FIVE = FIVE.split("```")[0]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Rigs, a design, the README's specification, and one that asks for less air."""
    folder = tmp_path_factory.mktemp("specification")
    for plant in ("servo_drive", "crr_leg", "gearbox", "closed_chamber"):
        (folder / f"{plant}.toml").write_text(f'plant = "{plant}"\n')
    (folder / "readme.toml").write_text(FIVE)
    (folder / "spec.toml").write_text(FIVE.replace('air         = "4 g"', 'air = "2 g"'))
    answer = call(
        "design", folder / "servo_drive.toml", "--controller", "lq", "--spec", folder / "spec.toml",
        "-o", folder / "lq.toml",
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    (folder / "design.txt").write_text(answer.stdout)
    return folder


def verdicts(text):
    """The rows of the table of verdicts, by line and scenario."""
    lines = text.split("\nline ", 1)[1].splitlines()[1:]
    return {tuple(words[:2]): words[-1] for words in map(str.split, lines)}


def test_design_answers_with_the_verdicts_of_check_on_the_same_rig(place):
    out = place / "check.json"
    answer = call(
        "check", place / "servo_drive.toml", place / "lq.toml", "--spec", place / "spec.toml",
        "--json", out,
    )  # fmt: skip
    document = json.loads(out.read_text())
    runs = {run["scenario"]: run for run in document["runs"]}
    found = {(e["line"], e["scenario"]): e for e in document["specification"]}

    assert verdicts(answer.stdout) == verdicts((place / "design.txt").read_text())
    assert verdicts(answer.stdout) == {
        key: "yes" if entry["met"] else "no" for key, entry in found.items()
    }
    assert found["rise_time", "step"]["found"] == runs["step"]["rise_s"]
    assert found["air", "sine"]["found"] == runs["sine"]["air_kg"]
    assert found["overshoot", "step"]["found"] == pytest.approx(runs["step"]["overshoot_m"] / 0.1)
    assert found["air", "step"]["met"] and not found["air", "sine"]["met"]  # 0.8 g and 3.6 g
    assert answer.exit_code == 1 and document["in_specification"] is False
    assert "out of specification: air" in answer.stderr


def test_check_answers_yes_where_all_lines_are_met_and_tells_the_share_of_plants(place):
    answer = call(
        "check", place / "servo_drive.toml", place / "lq.toml", "--spec", place / "readme.toml",
        "--scenario", "step", "--runs", 2, "--workers", 1, "-q",
    )  # fmt: skip

    assert answer.exit_code == 0, answer.output
    assert set(verdicts(answer.stdout.split("\nrun ")[0]).values()) == {"1", "2"}
    assert answer.stdout.count("2 of 2") == 6


def test_the_shifts_of_a_gearbox_are_held_against_a_specification(place):
    spec = place / "shifts.toml"
    spec.write_text(
        'rise_time = "30 ms"\novershoot = "0.5 mm"\nfinal_error = "0.3 mm"\nswitches = 3\n'
        '[limits]\n"chamber_1.pressure" = "9.1 bar"\n'
    )
    numbers = place / "numbers.toml"
    numbers.write_text("[hybrid-mpc]\nhold_s = 4e-3\n")
    rig, made, out = place / "gearbox.toml", place / "hm.toml", place / "shifts.json"
    designed = call("design", rig, "--controller", "hybrid-mpc", "--spec", numbers, "-o", made)
    answer = call("check", rig, made, "--spec", spec, "--scenario", "h-n", "--json", out)

    assert designed.exit_code == 0, designed.output
    assert "hold_s = 0.004" in made.read_text()
    entries = {e["line"]: e for e in json.loads(out.read_text())["specification"]}
    (run,) = json.loads(out.read_text())["runs"]
    assert {name: e["met"] for name, e in entries.items()} == {
        "rise_time": True, "overshoot": True, "final_error": True, "switches": False,
        "limits.chamber_1.pressure": True,
    }  # fmt: skip
    assert entries["switches"]["found"] == run["switches"]
    assert entries["final_error"]["found"] == run["final_error_m"]
    assert answer.exit_code == 1 and "out of specification: switches" in answer.stderr


def test_a_shift_that_takes_too_long_is_a_no_in_the_document_too():
    """Half of the time that the open loop takes is too short for it."""
    from studies.documents import check_document
    from studies.shift_check import Drive, ShiftCheck, _measured, run, shift_filter
    from workbench.plants.gearbox import gearbox

    plant = gearbox().lean()
    shift = _measured(plant, run(plant, Drive((1, 1)), shift_filter(plant, 1e-3), "h-n", 0), "h-n")
    late = replace(shift, longest_s=0.5 * shift.settling_s)

    assert late.reached is False
    (entry,) = json.loads(json.dumps(check_document("box", ShiftCheck((late,), ()))))["runs"]
    assert entry["reached"] is False


@pytest.mark.parametrize(
    ("rig", "text", "expected"),
    [
        ("servo_drive", "", "asks for nothing"),
        ("servo_drive", 'rise = "1 s"', "spec.toml:1: rise: a specification has no such name"),
        ("closed_chamber", 'air = "1 g"', "closed_chamber has no standard modes to control"),
        (
            "crr_leg",
            'rise_time = "1 s"',
            "spec.toml:1: rise_time: crr_leg is not judged by it; expected one of tracking_error, "
            "largest_error, air, switches, limits",
        ),
    ],
)
def test_check_refuses_a_specification_before_it_runs_anything(
    place, tmp_path, monkeypatch, rig, text, expected
):
    from studies import checked_runs

    monkeypatch.setattr(checked_runs, "rows_of", None)
    spec = tmp_path / "spec.toml"
    spec.write_text(text + "\n")

    answer = call("check", place / f"{rig}.toml", place / "lq.toml", "--spec", spec, "-q")

    assert answer.exit_code == 2
    assert expected in answer.stderr


def test_a_specification_that_is_not_there_is_named_with_the_nearest_file(place):
    answer = call(
        "check", place / "servo_drive.toml", place / "lq.toml", "--spec", place / "spek.toml"
    )

    assert answer.exit_code == 2
    assert "there is no such file; did you mean 'spec.toml'?" in answer.stderr
