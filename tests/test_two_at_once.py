"""Two large effects missing at once on the rescue robot's rig, recorded by code not the model's."""

from dataclasses import replace

import pytest

from studies.hidden_benches import CRR_RIG
from studies.hidden_effects import recordings
from studies.truth.cases import read_cases
from workbench.diagnosis.improve import improve

FRICTION, LEAK = "coulomb_friction", "chamber_leak@cap"


@pytest.fixture(scope="module")
def improved():
    """The true rig leaks; its user knows of no dry friction either, which is 13 N there."""
    case = read_cases(CRR_RIG.truth.stored)["chamber_leak", 1]
    ((train, held_out),) = recordings([case])
    rig = CRR_RIG.user_rig(case)
    plant = rig.plant.at_null(rig.plant.candidates[FRICTION])
    rig = replace(rig, plant=plant, removed=(*rig.removed, FRICTION))
    return case, improve(rig, [train], [held_out])


@pytest.mark.slow
def test_both_are_found_though_either_alone_leaves_the_recording_contradicted(improved):
    case, found = improved
    values = found.rig.plant.values

    assert found.diagnoses[0].contradicted and not found.diagnoses[1].contradicted
    assert {FRICTION, LEAK} <= set(found.kept)
    assert values["chamber_leak@cap.area_m2"] == pytest.approx(case.size, rel=0.1)
    assert values["friction.coulomb_force_n"] == pytest.approx(13.3, rel=0.15)
    for name, error in found.after["validation"].items():
        assert error.rmse < 0.05 * found.before["validation"][name].rmse


@pytest.mark.slow
def test_each_of_them_is_still_needed_beside_all_that_came_later(improved):
    _, found = improved
    asked = {each.candidate.name: each for each in found.removals}

    assert not asked[LEAK].dropped and not asked[FRICTION].dropped
    assert all(each.reasons == () for each in asked.values() if not each.dropped)
