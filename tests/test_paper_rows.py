"""Rows of the papers: every one has a study; what is read off runs, against known answers."""

import numpy as np
import pytest
from figure_faults import faults

from studies.papers import (
    drive_details,
    joint_models,
    network_loop,
    rig_loops,
    rig_open_loop,
    rig_valve,
    shift_timing,
    soft_valve,
)
from studies.papers.findings import Finding, findings_text
from studies.papers.loops import Pid
from studies.papers.network_loop import network, packets
from studies.papers.rig_valve_fits import input_pressure_pa
from studies.papers.shift_timing import Shift, error
from studies.registry import STUDIES
from studies.study import Extent
from workbench.contracts import Estimate
from workbench.effects.timing import sent_at_s
from workbench.plants.crr_rig import crr_rig

COUNTS = {"S000": 9, "S001": 7, "S002": 11, "S003": 3, "S004": 5}
ROWS = {f"{paper}-{k}" for paper, n in COUNTS.items() for k in range(1, n + 1)}
LONG = (
    drive_details, joint_models, network_loop, rig_loops, rig_open_loop, rig_valve, shift_timing,
)  # fmt: skip


def test_every_experiment_of_the_papers_has_a_study():
    covered = {row for study in STUDIES.values() for row in study.rows}

    assert len(ROWS) == 35
    assert covered == ROWS


def test_a_finding_stands_in_the_table_and_its_sentence_below():
    text = findings_text([
        Finding("S000-1", "offset", "5.25 V", "5.26 V", "it was drawn"),
        Finding("S000-2", "area", "-", "2 mm2"),
    ])  # fmt: skip

    assert text.splitlines()[1].split() == ["S000-1", "offset", "5.25", "V", "5.26", "V"]
    assert text.endswith("\n\nS000-1, offset: it was drawn")


def commanded(pid, angles):
    command = pid.start()
    for angle in angles:
        seen = Estimate(("angle",), np.array([angle]), np.eye(1))
        command = pid.step(command, np.array([[1.0]]), seen)
    return float(command.value[0])


def test_a_derivative_over_several_samples_is_the_slope_over_them():
    """Errors 1, 0.9, 0.9, 0.7: over three samples the slope is -100 per second, over one -200."""
    angles = (0.0, 0.1, 0.1, 0.3)
    one, three = (Pid((0.0, 0.0, 0.01), "angle", filter_s=0.0, over=n) for n in (1, 3))

    assert commanded(one, angles) == pytest.approx(5.25 - 0.01 * 200)
    assert commanded(three, angles) == pytest.approx(5.25 - 0.01 * 100)


def test_the_integral_stands_still_while_the_command_is_at_a_limit():
    stuck, free = (Pid((k, 1.0, 0.0), "angle") for k in (100.0, 1.0))

    assert commanded(stuck, [0.0] * 1000 + [1.0]) == pytest.approx(5.25)
    assert commanded(free, [0.0] * 1000 + [1.0]) == pytest.approx(6.25, abs=2e-3)


def test_packets_stop_at_a_redraw_and_then_every_other_one_is_missing():
    time_s = 1e-3 * np.arange(150)
    age_ms = np.round(1e3 * (time_s - sent_at_s(network(10.0), "drive.torque_n_m", time_s)))

    assert set(age_ms[5:100]) == {1.0}
    assert age_ms[119] == 21.0
    assert list(age_ms[120:131]) == [1, 2] * 5 + [1]
    seen = packets(10.0)
    assert seen.gap_s == pytest.approx(0.020)
    assert seen.lost_after == 5


def test_the_error_of_equation_13_counts_both_signs():
    """Offsets of 1 and -1 over a range of 10 are an error of a tenth, not none (E003-5)."""
    real = np.tile(np.concatenate([np.zeros(5), np.linspace(0, 10, 6)]), (3, 1))
    off = np.where(np.arange(11) % 2 == 0, 1.0, -1.0)
    rig, model = Shift(real, 1e-3), Shift(real + off, 1e-3)

    assert error(rig, model, 10.0) == pytest.approx([0.1] * 3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_input_pressure_that_is_fitted_is_the_plants_own(side):
    """Physics.md section 10: 102323, 375650 and 648977 Pa."""
    numbers = np.array([5.25, 0.75, 1.013e5, 6.5e5])
    found = input_pressure_pa(crr_rig().lean(), np.array([4.5, 5.25, 6.0]), numbers, side)

    assert sorted(found) == pytest.approx([102323, 375650, 648977], abs=2)
    assert (found[-1] > found[0]) == (side > 0)


def outcome(study, folder):
    return study.run(folder, Extent.QUICK, lambda _: None)


def test_the_valve_of_the_soft_joint_keeps_its_claims(tmp_path):
    found = outcome(soft_valve.STUDY, tmp_path)

    assert not [claim for claim in found.claims if not claim.holds]
    assert not [fault for figure in found.figures.values() for fault in faults(figure)]
    assert {each["row"] for each in found.numbers["findings"]} == set(soft_valve.STUDY.rows)


@pytest.mark.slow
@pytest.mark.parametrize("module", LONG, ids=lambda module: module.STUDY.name)
def test_the_studies_of_the_papers_keep_their_claims(module, tmp_path):
    found = outcome(module.STUDY, tmp_path)

    assert not [claim for claim in found.claims if not claim.holds]
    assert not [fault for figure in found.figures.values() for fault in faults(figure)]
    assert set(module.STUDY.rows) <= {each["row"] for each in found.numbers["findings"]}
