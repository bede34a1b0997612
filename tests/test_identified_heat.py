"""How sure several decays are of one coefficient: never surer where they contradict each other."""

from dataclasses import replace

import pytest

from studies import identification as study
from studies.identification_text import doubts, identification_document
from workbench.identification import PROCEDURES
from workbench.identification.wall_heat import wall_heat
from workbench.rig import load_rig

DRIVE, DEAD = load_rig(study.WRONG_DRIVE), "chamber_a.dead_volume_m3"
COEFFICIENT = "wall_heat.coefficient_w_m2_k"
HEAT = PROCEDURES["wall-heat"]


def knowing(off_m3, deviation_m3):
    """The drive with its dead volume so far off, and so well known."""
    volume_m3 = study.DRIVE.dead_volume_a_m3 + off_m3
    plant = DRIVE.plant.with_values({DEAD: volume_m3})
    return replace(DRIVE, plant=plant, deviations={DEAD: deviation_m3})


@pytest.fixture(scope="module")
def decays():
    return study.recordings_of_heat()


@pytest.fixture(scope="module")
def contradicting(decays):
    """A pull and a push behind a dead volume that is 10 % off and believed to the last drop."""
    rig = knowing(3e-6, 0.0)
    return [wall_heat(rig, each) for each in (decays[:1], decays[1:], decays)]


def test_decays_that_contradict_each_other_do_not_come_out_surer_than_each(contradicting):
    """They lay 3.5 deviations apart, and both together claimed less than each alone."""
    pull, push, both = (found[COEFFICIENT] for found in contradicting)

    assert both.deviation > max(pull.deviation, push.deviation)
    assert both.deviation == pytest.approx(0.5 * abs(push.value - pull.value), rel=0.2)


def test_that_they_contradict_each_other_is_said(contradicting):
    *alone, both = contradicting

    assert any("the 2 decays contradict each other, 23.0" in said for said in doubts(HEAT, both))
    assert any("contradict" in said for said in identification_document(HEAT, both)["warnings"])
    assert not any("contradict" in said for each in alone for said in doubts(HEAT, each))


def test_decays_that_agree_are_surer_together_and_said_nothing_of(decays):
    found = wall_heat(knowing(0.0, 0.0), decays)

    assert not found.doubts
    assert found[COEFFICIENT].deviation < 0.01 * found[COEFFICIENT].value


def test_what_is_not_known_of_the_dead_volume_counts(decays):
    """The gas that cools is that of the whole volume: 10 % of the dead one are 5 % of a push."""
    sure, unsure = (wall_heat(knowing(3e-6, by), decays[1:]) for by in (0.0, 3e-6))
    true = study.DRIVE.heat_transfer_w_m2_k

    assert abs(sure[COEFFICIENT].value - true) > 5.0 * sure[COEFFICIENT].deviation
    assert abs(unsure[COEFFICIENT].value - true) < 2.0 * unsure[COEFFICIENT].deviation
    assert unsure[COEFFICIENT].value == pytest.approx(sure[COEFFICIENT].value)
    tau = "rest_time_constant_s"  # which does not depend on the volume
    assert unsure[tau].deviation == pytest.approx(sure[tau].deviation)
