"""`design --json`: what is printed of a design, as numbers."""

import json

import numpy as np
import pytest
from commands import call

from controllers.design_file import design
from studies.design_document import design_document
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
    table = [line.split() for line in answer.stdout.splitlines() if line.endswith(" stable")]
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
