"""The wanted motion of a reference, and what pressures and opening go with it on the modes."""

import numpy as np
import pytest
from crr_loops import DT

from controllers.axis import axis_of
from controllers.motion import MotionLimits, going_with, motion, sliding_on
from controllers.scheduled import constant, driven_modes, scheduled
from linearize.standard import axis_modes
from workbench.plants.crr_rig import crr_rig


@pytest.fixture(scope="module")
def rig():
    return axis_modes(crr_rig())


def test_the_motion_of_a_reference_is_its_differences_and_nothing_where_it_jumps():
    t = DT * np.arange(4)
    limits = MotionLimits(speed=2.0, acceleration=30.0, jerk=1e3)

    assert motion(0.1 + 0.5 * t + 2.0 * t**2, DT, limits) == pytest.approx(
        [0.502, 4.0, 0.0], abs=1e-6
    )
    assert motion(np.array([0.0, 0.0, 0.1, 0.1]), DT, limits) == pytest.approx(0.0)
    assert motion(np.array([0.0, 0.0, 1e-3, 2e-3]), DT, limits)[1] == 0.0


@pytest.mark.parametrize("ahead", [0.0, 0.3, 1.0])
def test_between_modes_and_directions_what_goes_with_a_motion_is_mixed(rig, ahead):
    sliding = scheduled(rig, lambda mode: sliding_on(mode, axis_of(rig.plant), 0.0))
    wanted, (left_m, right_m) = np.array([0.1, 2.0, 50.0]), sliding.positions_m[:2]
    place_m = left_m + 0.25 * (right_m - left_m)
    parts = [
        share * side * going_with(constant(designs[k]), place_m, 1.0, wanted)
        for side, designs in ((ahead, sliding.forward), (1.0 - ahead, sliding.backward))
        for k, share in enumerate((0.75, 0.25))
    ]

    assert going_with(sliding, place_m, ahead, wanted) == pytest.approx(np.sum(parts, axis=0))


def test_pressures_and_opening_of_a_motion_are_those_under_which_the_mode_moves_so(rig):
    """Put back into the affine mode they give the wanted acceleration, at every time."""
    mode, axis = driven_modes(rig)[0][1], axis_of(rig.plant)
    found = sliding_on(mode, axis, 0.0)
    place, h = mode.state[0], 1e-4

    def at(time_s):
        wanted = np.array([0.1 + 0.4 * time_s + 3.0 * time_s**2, 0.4 + 6.0 * time_s, 6.0])
        with_it = going_with(constant(found), place, 1.0, wanted)
        return np.array([place, wanted[0], *with_it[:2]]), with_it[2:], wanted

    x, u, wanted = at(0.01)
    rates = mode.rates(x, u)
    pressures = (at(0.01 + h)[0][2:] - at(0.01 - h)[0][2:]) / (2.0 * h)

    assert rates[1] == pytest.approx(wanted[1], rel=1e-6)
    assert rates[2:] == pytest.approx(pressures, rel=1e-6)
