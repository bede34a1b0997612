"""What a check over many drawn plants tells: lines, worst runs, influences, figures."""

import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest
from check_loops import MASS, RIG, SPEC, heavy_is_slow, metrics, record
from commands import call

from studies.checked_runs import FEW, check_rig
from studies.checking import Loops, drawn_plant
from studies.closed_loop_check import Check
from studies.specification import read_specification
from workbench.recording import Recording


def test_many_runs_say_how_often_a_line_is_missed_where_and_by_what(lq, monkeypatch):
    monkeypatch.setattr(Loops, "once", heavy_is_slow)
    asked = read_specification(SPEC, RIG)
    found = check_rig(RIG, lq, ["ekf"], ["step"], spec=asked, runs=50)
    rise, air, pressure = found.document["robustness"]
    masses = [drawn_plant(RIG, k).values[MASS] for k in range(50)]

    assert rise["probability"] == np.mean(0.145 + 0.2 * (np.array(masses) / 2.22 - 1.0) > 0.15)
    assert rise["interval"][0] < rise["probability"] < rise["interval"][1]
    assert rise["influences"]["slide.mass"] == pytest.approx(1.0)
    assert rise["worst_run"] == 1 + int(np.argmax(masses))
    assert air["probability"] == pressure["probability"] == 0.0
    assert {"line", "scenario", "asked", "found_by_run"} <= set(found.document["specification"][0])
    assert len(found.document["runs"]) == 50
    assert f"\nrun {rise['worst_run']}: " in found.text
    assert "slide.mass +1.00" in found.text and "limits.chamber_a.pressure, step, bey" in found.text
    assert len(found.text.splitlines()) < 10


def test_without_a_specification_many_runs_tell_how_often_the_goal_is_missed(lq, monkeypatch):
    def heavy_misses(loops, plant, seed):
        late = plant.values[MASS] > RIG.plant.values[MASS]
        return Check((metrics(final_error_m=1e-3 if late else 1e-5),), (record(),))

    monkeypatch.setattr(Loops, "once", heavy_misses)
    found = check_rig(RIG, lq, ["ekf"], ["step"], runs=40)
    (entry,) = found.document["robustness"]
    heavy = sum(drawn_plant(RIG, k).values[MASS] > RIG.plant.values[MASS] for k in range(40))

    assert (entry["line"], entry["probability"]) == ("goal", heavy / 40)
    assert next(iter(entry["influences"])) == "slide.mass"
    assert f"{heavy} of 40" in found.text and not found.met


def test_few_runs_are_told_one_by_one(lq, monkeypatch):
    monkeypatch.setattr(Loops, "once", heavy_is_slow)
    told = check_rig(RIG, lq, ["ekf"], ["step"], runs=FEW).text.splitlines()

    assert [line.split()[:2] for line in told[1:]] == [["lq", str(k + 1)] for k in range(FEW)]


def drawable(loops, plant, seed):
    """As :func:`heavy_is_slow`, with what a figure draws."""
    names = ("slide.position_m", "reference.slide.position_m", "valve.command_v")
    channels = dict.fromkeys(names, np.linspace(0.1, 0.2, 3000))
    pressure = record().recording["chamber_a.pressure_pa"]
    channels["chamber_a.pressure_pa"] = np.resize(pressure, 3000)
    rows = heavy_is_slow(loops, plant, seed).rows
    return Check(rows, (SimpleNamespace(recording=Recording("run", 1e-3, channels)),))


def test_a_check_writes_its_tables_and_a_report_with_parameters_and_seeds(
    lq, monkeypatch, tmp_path
):
    monkeypatch.setattr(Loops, "once", drawable)
    rig, spec, folder = (tmp_path / name for name in ("rig.toml", "spec.toml", "out"))
    rig.write_text('plant = "servo_drive"\n[values]\n"slide.mass" = "3.21 kg"\n')
    spec.write_text(SPEC)
    answer = call(
        "check", rig, lq, "--scenario", "step", "--spec", spec, "--runs", 15, "--workers", 1,
        "--figures", folder,
    )  # fmt: skip

    with (folder / "tables" / "table_1.csv").open(newline="") as file:
        head, *lines = csv.reader(file)
    assert head[:3] == ["line", "asked", "median"] and len(lines) == 3
    told = answer.stdout.splitlines()[1]  # the same words as on the terminal
    assert all(word in told for word in lines[0])
    assert r"\toprule" in (folder / "tables" / "table_1.tex").read_text()
    page = (folder / "report.html").read_text()
    assert page.count("<svg") == 4 and (folder / "limits_step.svg").exists()
    for word in ("slide.mass", "3.21", "seed (0, k - 1)", np.__version__, "positioning"):
        assert word in page


def test_the_report_of_a_single_run_says_one_run(lq, monkeypatch, tmp_path):
    monkeypatch.setattr(Loops, "once", drawable)
    rig = tmp_path / "rig.toml"
    rig.write_text('plant = "servo_drive"\n')
    call("check", rig, lq, "--scenario", "step", "--figures", tmp_path / "out", "-q")

    assert "1 run of lq.toml against" in (tmp_path / "out" / "report.html").read_text()


def test_figures_close_the_first_and_the_worst_loops_again_and_no_others(lq, monkeypatch):
    again = []

    def noted(loops, plant, seed):
        again.append(seed)
        return drawable(loops, plant, seed)

    monkeypatch.setattr(Loops, "once", heavy_is_slow)
    asked = read_specification('rise_time = "150 ms"\n', RIG)
    found = check_rig(RIG, lq, ["ekf"], ["step"], spec=asked, runs=FEW + 8)
    monkeypatch.setattr(Loops, "once", noted)

    assert set(found.figures()) == {"closed_loop_step", "influences", "spread"}
    assert again == [0, found.document["robustness"][0]["worst_run"] - 1]


@pytest.mark.parametrize(("rise_s", "code"), [(float("nan"), 1), (0.1, 0)])
def test_a_step_that_never_rose_overshoots_swings_and_settles_out_of_specification(
    lq, monkeypatch, tmp_path, rise_s, code
):
    """A drive that stayed 53 mm off was in specification: it neither overshot nor swung."""
    stays = metrics(rise_s=rise_s, overshoot_m=0.0, limit_cycle_m=0.0)
    monkeypatch.setattr(Loops, "once", lambda loops, plant, seed: Check((stays,), (record(),)))
    rig, spec = tmp_path / "rig.toml", tmp_path / "spec.toml"
    rig.write_text('plant = "servo_drive"\n')
    spec.write_text('overshoot = "2 mm"\nlimit_cycle = "0.1 mm"\nair = "4 g"\n')
    answer = call("check", rig, lq, "--spec", spec, "--scenario", "step", "-q")

    assert answer.exit_code == code
    told = "not reached: step\nout of specification: overshoot, limit_cycle\n"
    assert answer.stderr == (told if code else "")


@pytest.mark.parametrize(
    "line", ['air = "4 g"', "switches = 9", '[limits]\n"chamber_a.pressure" = "9 bar"']
)
@pytest.mark.parametrize(("rise_s", "code"), [(float("nan"), 1), (0.1, 0)])
def test_what_stays_where_it_is_does_not_meet_a_specification_of_air_switches_or_limits(
    lq, monkeypatch, tmp_path, line, rise_s, code
):
    """A shut valve takes no air: the check ended with 0 and said beside it that nothing moved."""
    stays = metrics(rise_s=rise_s, air_kg=0.0, switches=0.0)
    monkeypatch.setattr(Loops, "once", lambda loops, plant, seed: Check((stays,), (record(),)))
    rig, spec, told = (tmp_path / name for name in ("rig.toml", "spec.toml", "check.json"))
    rig.write_text('plant = "servo_drive"\n')
    spec.write_text(f"{line}\n")
    asked = ("--spec", spec, "--scenario", "step", "--json", told, "-q")
    answer = call("check", rig, lq, *asked)

    assert answer.exit_code == code, answer.output
    assert json.loads(told.read_text())["in_specification"] is (code == 0)
    assert answer.stderr == ("not reached: step\n" if code else "")


@pytest.mark.parametrize(
    ("lines", "rmse_m", "code"),
    [
        ('air = "4 g"', 0.03, 1),
        ('air = "4 g"', 0.003, 0),
        ('air = "4 g"\ntracking_error = "40 mm"', 0.03, 0),
    ],
)
def test_a_lost_sine_is_missed_unless_a_line_says_how_closely_it_is_followed(
    lq, monkeypatch, tmp_path, lines, rmse_m, code
):
    nan = float("nan")
    lost = metrics(scenario="sine", rise_s=nan, amplitude_m=0.08, way_m=nan, rmse_m=rmse_m)
    monkeypatch.setattr(Loops, "once", lambda loops, plant, seed: Check((lost,), (record(),)))
    rig, spec = tmp_path / "rig.toml", tmp_path / "spec.toml"
    rig.write_text('plant = "servo_drive"\n')
    spec.write_text(f"{lines}\n")
    answer = call("check", rig, lq, "--spec", spec, "--scenario", "sine", "-q")

    assert answer.exit_code == code, answer.output


def test_of_several_runs_those_whose_step_never_rose_are_counted(lq, monkeypatch):
    def heavy_stays(loops, plant, seed):
        stays = plant.values[MASS] > RIG.plant.values[MASS]
        return Check((metrics(rise_s=float("nan") if stays else 0.1),), (record(),))

    monkeypatch.setattr(Loops, "once", heavy_stays)
    found = check_rig(RIG, lq, ["ekf"], ["step"], runs=9)
    heavy = sum(drawn_plant(RIG, k).values[MASS] > RIG.plant.values[MASS] for k in range(9))

    assert found.unreached == (f"step in {heavy} of 9 runs",)


def test_a_controller_that_runs_on_its_fallback_is_told_on_stderr_and_in_the_document(
    lq, monkeypatch, tmp_path
):
    """A solver that failed at every sample of a step had been met with a table alone."""

    def failing(loops, plant, seed):
        (scenario,) = loops.scenarios
        lost = 600.0 if scenario == "step" else 0.0
        row = metrics(scenario=scenario, control_samples=650.0, fallback_samples=lost)
        return Check((row,), (record(),))

    monkeypatch.setattr(Loops, "once", failing)
    rig, told = tmp_path / "rig.toml", tmp_path / "check.json"
    rig.write_text('plant = "servo_drive"\n')
    answer = call("check", rig, lq, "--json", told, "-q")
    runs = {run["scenario"]: run for run in json.loads(told.read_text())["runs"]}

    assert answer.stderr == (
        "warning: the controller had no answer, and ran on its fallback, in 600 of 650 samples "
        "of step with lq and ekf\n"
    )
    assert runs["step"]["fallback_samples"] == 600 and runs["sine"]["fallback_samples"] == 0
    assert runs["step"]["control_samples"] == 650


@pytest.mark.parametrize(("call_s", "told"), [(1.9e-3, 0), (2.1e-3, 1)])
def test_a_control_that_takes_longer_than_its_sample_is_told(
    lq, monkeypatch, recwarn, call_s, told
):
    def timed(loops, plant, seed):
        return Check((metrics(solve_median_s=call_s),), (record(),))

    monkeypatch.setattr(Loops, "once", timed)
    check_rig(RIG, lq, ["ekf"], ["step"])
    said = [str(each.message) for each in recwarn if "longer than its sample" in str(each.message)]

    assert (
        said
        == ["a call of the controller takes 2.1 ms here, longer than its sample of 2 ms"][:told]
    )
