"""`design --json`: what is printed of a design, as numbers."""

import json

import numpy as np
import pytest
from commands import call

from controllers.design_file import design
from controllers.margins import margins_of
from controllers.output_feedback import lqg_law
from controllers.scheduled import driven_modes
from studies.closed_loop_check import PROCESS_NOISE, noise_of
from studies.design_document import design_document
from studies.design_doubts import design_doubts
from studies.design_report import design_report
from studies.design_text import NO_LAWS, design_texts
from workbench.plants.crr_arm import crr_arm
from workbench.plants.crr_leg import crr_leg
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import servo_drive


def document(method, plant, numbers=None):
    """Of a design, as it is written and read again."""
    report = design_report(design(method, plant, numbers), lambda said: None)
    return json.loads(json.dumps(design_document("mine", report), allow_nan=False))


def test_the_command_writes_what_it_prints(tmp_path):
    rig = tmp_path / "drive.toml"
    rig.write_text('plant = "servo_drive"\n')
    path = tmp_path / "lq.json"
    answer = call(
        "design", rig, "--controller", "lq", "-o", tmp_path / "lq.toml", "--json", path, "-q"
    )

    assert answer.exit_code == 0
    found = json.loads(path.read_text())
    (law,) = found["laws"]
    rows = {row["mode"]: row for row in law["margins"]}
    known, filtered = answer.stdout.split("the same with the steady Kalman filter")
    assert len(law["margins_with_kalman_filter"]) == filtered.count(" stable\n") == len(rows)
    table = [line.split() for line in known.splitlines() if line.endswith(" stable")]
    assert len(table) == len(rows) > 0
    for line in table:
        row, (phase, delay) = rows[" ".join(line[:-8])], map(float, line[-6:-4])
        assert row["phase_deg"] == pytest.approx(phase, rel=5e-3)
        assert 1e3 * row["delay_s"] == pytest.approx(delay, rel=5e-3)
    first = found["gains"][0]
    said = answer.stdout.splitlines()[0]
    assert said.startswith(f"{first['at']}: ")
    assert all(f"{name} {g['value']:.4g} {g['unit']}" in said for name, g in first["gains"].items())


def test_of_an_unstable_loop_there_is_what_grows_and_no_margin():
    gains = {"proportional": 4000.0, "integral": 0.0, "derivative": 0.0}
    (law,) = document("axis-pid", crr_arm(), {"gains": gains})["laws"]

    row = next(row for row in law["margins"] if not row["stable"])
    assert row["grows_s"] > 0.0 and row["phase_deg"] is None and row["distance"] is None
    assert law["certificate"]["unstable"]


def test_margins_are_told_without_and_with_a_filter_and_for_which_samples():
    """LQG has no margins of its own by right: here 54 deg become 38."""
    found = design("lq", servo_drive())
    report = design_report(found, lambda said: None)
    text = "\n".join(design_texts(report))
    noise, dt = noise_of(found.plant), found.controller.sample_time_s
    mode, law = driven_modes(found.hybrid)[0][0], found.controller.laws.forward[0]
    lqg = margins_of(mode, lqg_law(mode, law, PROCESS_NOISE, noise, dt), dt)

    assert "sampled every 2 ms, without delays; all states are taken as known" in text
    assert "margins of full-state feedback" in text
    assert report.laws[0].filtered[0].phase_rad == pytest.approx(lqg.phase_rad)
    phases = [
        min(np.degrees(each.phase_rad) for each in rows)
        for rows in (report.laws[0].margins, report.laws[0].filtered)
    ]
    assert phases == pytest.approx([54.2, 38.2], abs=0.1)


def test_a_law_on_the_measurement_has_no_margins_with_a_filter():
    assert document("axis-pid", servo_drive())["laws"][0]["margins_with_kalman_filter"] == []


def test_margins_with_a_filter_are_told_behind_delays_and_of_every_axis():
    """They were left out of a rig with a network and of a drive whose commands come late."""
    late = servo_drive().with_values({"command_delay.delay_s": 3e-3})
    for method, plant in (("lq", late), ("axis-lq", crr_arm())):
        (law,) = document(method, plant)["laws"]
        known, filtered = law["margins"], law["margins_with_kalman_filter"]

        assert [each["mode"] for each in filtered] == [each["mode"] for each in known]
        assert law["delays_s"]["commands"] > 0.0 and all(each["stable"] for each in known)
        assert all(f["phase_deg"] != k["phase_deg"] for f, k in zip(filtered, known, strict=True))


@pytest.mark.parametrize(
    ("method", "numbers", "said"),
    [
        (
            "pid",
            {},
            [
                "the smallest phase margin is 3.79 deg in mode 'charge b slide - near a', below 30",
                "the smallest delay margin is 0.53 ms in mode 'charge b slide - near a', below one "
                "sample of 1 ms",
            ],
        ),
        ("lq", {}, []),
        (
            "axis-pid",
            {"setpoint": 0.7},
            [
                "a setpoint weight of 0.7 leaves 30 % of every step to the integral, whose time is "
                "4.14 s: ask for fewer integral_periods"
            ],
        ),
        ("axis-pid", {"setpoint": 0.7, "tuning": {"integral_periods": 5.0}}, []),
    ],
)
def test_loops_that_bear_hardly_anything_are_doubts(method, numbers, said):
    report = design_report(design(method, servo_drive(), numbers), lambda said: None)

    assert [*design_doubts(report)] == said


def test_a_doubt_is_a_warning_of_the_command_beside_its_tables(tmp_path):
    """It stood in the tables alone, or nowhere."""
    rig, spec = tmp_path / "arm.toml", tmp_path / "spec.toml"
    rig.write_text('plant = "crr_arm"\n')
    spec.write_text("[axis-pid.gains]\nproportional = 4000.0\n")
    made = tmp_path / "pid.toml"
    answer = call("design", rig, "--controller", "axis-pid", "--spec", spec, "-o", made, "-q")

    assert answer.exit_code == 0
    assert answer.stderr == (
        "warning: unstable loops, of 6 of 6 modes: 'slide + low', 'slide + mid', ...\n"
    )


def test_nonlinear_mpc_has_no_margins_and_says_so():
    """Those of linear MPC, from which it takes its terminal costs, are not its own."""
    report = design_report(design("nonlinear-mpc", servo_drive()), lambda said: None)

    assert report.laws == ()
    assert [*design_texts(report)] == [NO_LAWS]


def test_a_leg_has_a_law_for_each_joint_and_hybrid_mpc_none():
    leg, box = document("joint-lq", crr_leg()), document("hybrid-mpc", gearbox())

    assert [law["body"] for law in leg["laws"]] == ["joint_1", "joint_2", "joint_3"]
    assert all(np.isfinite(p).all() for row in leg["gains"] for p in row["poles_per_s"])
    assert box["laws"] == [] and box["gains"] == []
