"""How far a mode may be trusted, and from which outputs its state can be told."""

from dataclasses import replace

import numpy as np
import pytest

from linearize.analysis import analyse
from linearize.discrete import sampled
from linearize.equilibrium import operating_point
from linearize.modes import linearised
from linearize.reduction import design_model
from linearize.regions import GROWTH, TOLERANCE, validity
from linearize.shift_modes import ShiftPoints, gearbox_modes
from linearize.standard import COMMAND, POSITION, PRESSURES, VELOCITY, standard_modes
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import servo_drive

SLIDES = "charge a slide + middle"


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


@pytest.fixture(scope="module")
def found(hybrid):
    return validity(hybrid, hybrid[SLIDES])


def worst_error(hybrid, mode, moved):
    """Largest error over 50 ms of one start and command off the point, over the scale."""
    model, plant, small = hybrid.model, hybrid.model.plant, sampled(mode, 1e-3)
    x, u = mode.state + moved[:-1], mode.command + moved[-1:]
    rows = [plant.model.states.index(name) for name in mode.state_names]
    full, step, worst = model.full_under(x, u), plant.model.step(1e-3), 0.0
    for _ in range(50):
        full = step(full, u, *plant.nominal[1:])
        x = small.F @ x + small.G @ u + small.offset
        worst = max(worst, float((np.abs(full.full().ravel()[rows] - x) / mode.scale).max()))
    return worst


def test_inside_of_its_region_a_mode_predicts_within_the_tolerance(hybrid, found):
    half = np.array([*found.together.values()])
    rng = np.random.default_rng(2)

    for moved in rng.uniform(-0.9, 0.9, (6, len(half))) * half:
        assert worst_error(hybrid, hybrid[SLIDES], moved) < TOLERANCE


@pytest.mark.parametrize("horizon_s", [4e-4, 1.4e-3])
def test_a_horizon_of_no_whole_number_of_samples_is_kept(hybrid, horizon_s):
    """Shorter than half a sample, too, or up to 40 % longer than one."""
    mode = hybrid[SLIDES]
    found = validity(hybrid, mode, horizon_s)
    divided = validity(hybrid, mode, horizon_s, sample_time_s=horizon_s)

    assert found.horizon_s == horizon_s
    assert found == divided


def test_one_step_beyond_it_does_not(hybrid, found):
    one_more = 1.01 * GROWTH[1] / GROWTH[0]
    for k, half in enumerate(found.alone.values()):
        if half < GROWTH[-1] * [*hybrid[SLIDES].scale, 1.0][k]:
            off = np.eye(5)[k] * half * one_more
            both = (worst_error(hybrid, hybrid[SLIDES], sign * off) for sign in (1.0, -1.0))

            assert max(both) > TOLERANCE


def test_signals_off_together_may_go_less_far_than_each_alone(found):
    share = [found.together[name] / found.alone[name] for name in found.alone]

    assert np.ptp(share) < 1e-12
    assert 0.1 <= share[0] <= 1.0
    assert [*found.alone] == [POSITION, VELOCITY, *PRESSURES, COMMAND]


def test_the_region_grows_with_the_tolerance_and_shrinks_with_the_horizon(hybrid, found):
    longer = validity(hybrid, hybrid[SLIDES], horizon_s=0.1)
    wider = validity(hybrid, hybrid[SLIDES], tolerance=4.0 * TOLERANCE)

    for name in (VELOCITY, *PRESSURES, COMMAND):
        assert longer.alone[name] <= found.alone[name] < wider.alone[name]
    assert longer.alone[COMMAND] < found.alone[COMMAND]


def test_a_mode_whose_point_errs_already_has_no_region(hybrid):
    found = validity(hybrid, hybrid["closed slide - near a"], tolerance=0.01)

    assert found.at_point > 0.01
    assert not any(found.alone.values())


def test_the_valve_of_a_sticking_slide_may_move_until_pressure_breaks_it_away(hybrid):
    """Static friction of 46 N holds 94 kPa between two equal chambers."""
    found = validity(hybrid, hybrid["closed stick middle"])

    assert [*found.alone] == [*PRESSURES, COMMAND]
    assert 0.5e5 < found.alone[PRESSURES[0]] < 0.94e5


def seen_from_position(mode, position):
    """The report of a mode whose only sensor is that of the position."""
    row = [mode.output_names.index(position)]
    return analyse(replace(mode, C=mode.C[row], D=mode.D[row], output_names=(position,)))


def test_at_rest_position_alone_does_not_tell_the_two_pressures_of_the_gearbox_apart():
    """physics.md 4.2: they act through one force.  All three outputs together do."""
    resting = gearbox_modes(gearbox()).modes[1:]
    moving = gearbox_modes(gearbox(), ShiftPoints(velocity_m_s=0.5)).modes[1:]

    for mode in resting:
        seen = seen_from_position(mode, "main_piston.position_m")
        assert (seen.observable, analyse(mode).observable) == (3, 4), mode.name
        assert seen.observability[3] < 1e-15
    for mode in moving:
        seen = seen_from_position(mode, "main_piston.position_m")
        assert seen.observable == 4
        assert seen.observability[3] > 5e-4


@pytest.mark.parametrize(
    ("leak_area_m2", "velocity_m_s", "rank", "least", "most"),
    [
        (0.0, 0.0, 3, 0.0, 1e-18),  # nothing tells them apart
        (8e-8, 0.0, 3, 1e-13, 1e-10),  # their leaks do, but nobody could use it
        (8e-8, 0.1, 4, 1e-3, 1.0),
    ],
)
def test_nor_does_it_on_the_servo_drive(leak_area_m2, velocity_m_s, rank, least, most):
    plant = servo_drive().with_values({"valve.leak_area_m2": leak_area_m2})
    model = design_model(plant)
    mode = linearised(model, {}, operating_point(model, {VELOCITY: velocity_m_s}))

    seen = seen_from_position(mode, POSITION)

    assert (seen.observable, analyse(mode).observable) == (rank, 4)
    assert least <= seen.observability[3] < most
