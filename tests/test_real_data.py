"""The same loop on real recordings: friction bench and vertical cylinder.

Held-out errors are compared with those of plain least squares, effect by effect, that the data
set's README gives; they may lie at most 10 % above its best.
"""

import pytest

from studies.real_recordings import whole_kicks_m
from workbench.diagnosis.improve import improve
from workbench.recordings import printed_cylinder, real_data_folder, vertical_cylinder

FOLDER = real_data_folder()
pytestmark = pytest.mark.skipif(
    FOLDER is None, reason="the real recordings are not beside the project"
)
BEST_HELD_OUT_N = {"O-ring257": 1.19, "KDN": 1.06, "X-ring257": 1.38}


def improved(seal):
    train = printed_cylinder.recordings(FOLDER, seal, printed_cylinder.TRAIN_BAR)
    held_out = printed_cylinder.recordings(FOLDER, seal, printed_cylinder.HELD_OUT_BAR)
    return improve(printed_cylinder.rig(seal), train, held_out)


def names(found):
    return [step.candidate.name for step in found.steps]


def held_out_n(found):
    """Of the rig that is written in the end."""
    return found.after["validation"]["rod.force"].rmse


@pytest.mark.filterwarnings("ignore::workbench.reading.RecordingWarning")
@pytest.mark.parametrize(
    "seal",
    ["KDN", *(pytest.param(seal, marks=pytest.mark.slow) for seal in ("X-ring257", "O-ring257"))],
)
def test_the_bench_starts_with_coulomb_friction_and_ends_at_the_best_held_out_error(seal):
    found = improved(seal)

    assert names(found)[0] == "coulomb_friction"
    assert held_out_n(found) <= 1.10 * BEST_HELD_OUT_N[seal]
    if seal != "O-ring257":
        assert "friction_pressure" not in {*names(found), *found.kept}


@pytest.mark.slow
def test_the_vertical_cylinder_starts_with_coulomb_friction_and_predicts_unseen_kicks():
    """Kicks 2 and 4 fall 20 % slower than the others: trained on all four, two terms are earned."""
    found, unseen_m = improved_cylinder(vertical_cylinder.TRAIN)

    assert names(found) == ["coulomb_friction", "viscous_friction"]
    assert found.kept == tuple(names(found))
    assert unseen_m < 1.1 * 7.6e-3


def test_kicks_that_agree_earn_friction_that_depends_on_position():
    found, unseen_m = improved_cylinder(vertical_cylinder.ALIKE)

    # A cushion at the end stands in for the place at first; the backward pass takes it out again.
    assert names(found)[:2] == ["coulomb_friction", "viscous_friction"]
    assert found.kept == ("coulomb_friction", "viscous_friction", "friction_position")
    assert unseen_m < 1.1 * 4.4e-3


def improved_cylinder(train):
    """The improved cylinder, and its error on whole kicks it never saw, in m."""
    kicks = vertical_cylinder.kicks(FOLDER)
    test = kicks[vertical_cylinder.TEST]
    found = improve(vertical_cylinder.rig(), kicks[train], test)
    return found, whole_kicks_m(found.rig, test)
