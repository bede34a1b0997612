"""A, B, C, D of every mode of every plant against central differences of the whole plant's rates.

The plant is evaluated with all its states, the left-out ones where they follow the kept ones; what
is rigidly coupled is put together here by its masses, and what is held by the leg's mass matrix.
Away from kinks: the steps stay on one side of Neutral, of the direction of sliding and of the
choking of a valve.
"""

import casadi as ca
import numpy as np
import pytest

from linearize.modes import hybrid_modes, placed_at
from linearize.shift_modes import (
    DIRECTIONS,
    ShiftPoints,
    driving_modes,
    gearbox_modes,
    side_cut,
    switched_modes,
)
from linearize.shifting import DETENT, FLOWS, HEAT, shift_model
from linearize.standard import (
    REGIME_MODES,
    STANDARD_MODES,
    axis_modes,
    servo_drive_cuts,
    standard_modes,
)
from workbench.leg import Leg
from workbench.plants import PLANTS
from workbench.plants.crr_leg import crr_leg
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import servo_drive

STEP = 1e-5  # of the scale of a state, and of a command's: the curvature of the valve's area
# jumps where it is closed, and a difference over that errs in proportion to the step
ALLOWED = 1e-6  # of the largest scaled entry
COMMAND_SCALE = {"valve.pwm": 0.1, **dict.fromkeys(FLOWS, 1e-2)}  # 1 V of any other


def held_by_the_leg(plant, x, rate, held):
    """Accelerations of the leg with some joints held: M_ff a_f = (M a)_f, none of the held."""
    leg = next(part for part in plant.parts if isinstance(part, Leg))
    names = [f"{joint}.velocity_rad_s" for joint in leg.joints]
    free = [k for k, name in enumerate(names) if name not in held]
    M = ca.DM(leg.mass_matrix([x[f"{joint}.angle_rad"] for joint in leg.joints])).full()
    torque = M @ [rate[name] for name in names]
    found = dict.fromkeys(names, 0.0)
    if free:
        inverse = np.linalg.inv(M[np.ix_(free, free)])
        found |= zip((names[k] for k in free), inverse @ torque[free], strict=True)
    return rate | found


def whole_rates(hybrid, x, u, held=()):
    """Rates of the kept states, shape (n_x,), from the plant with all of its own, and outputs."""
    model, plant = hybrid.model, hybrid.model.plant
    changed = plant.with_values(dict(model.nulls))
    full = model.full_under(x, u)
    rates, outputs = plant.model.f(full, u, [], changed.nominal[2])
    rate = dict(zip(plant.model.states, rates.full().ravel(), strict=True))
    if model.couplings:
        tip_m_s2 = 0.05 * rate["finger.velocity_rad_s"]
        carried = [(1.0, rate["main_piston.velocity_m_s"]), (0.6, tip_m_s2)]
        if x[model.states.index("main_piston.position_m")] > 0.0:
            carried.append((0.35, rate["floating_piston.velocity_m_s"]))
        force_n = sum(mass * a for mass, a in carried)
        rate["main_piston.velocity_m_s"] = force_n / sum(mass for mass, _ in carried)
    if model.pushes:
        rate = held_by_the_leg(plant, dict(zip(model.states, x, strict=True)), rate, held)
    return np.array([rate[name] for name in model.states]), outputs.full().ravel()


def differences(hybrid, mode, sizes):
    """[[A, B], [C, D]] of a mode by central differences, in units of the sizes."""
    model = hybrid.model
    held = {name: region.point for name, region in mode.box.items()}
    at = held | dict(zip(mode.state_names, mode.state, strict=True))
    x = np.array([at.get(n, v) for n, v in zip(model.states, model.initial, strict=True)])
    u = mode.sent(model, mode.command)
    rows = [model.states.index(name) for name in mode.state_names]
    stuck = [name for region in mode.box.values() for name in region.holds]
    columns = []
    for name, size in zip((*mode.state_names, *mode.command_names), sizes, strict=True):
        ends = []
        for sign in (1.0, -1.0):
            x_moved, u_moved = x.copy(), u.copy()
            vector, names = (x_moved, model.states) if name in model.states else (u_moved, ())
            place = names.index(name) if names else model.commands.index(name)
            vector[place] += sign * STEP * size
            rates, outputs = whole_rates(hybrid, x_moved, u_moved, stuck)
            ends.append(np.concatenate([rates[rows], outputs]))
        columns.append((ends[0] - ends[1]) / (2.0 * STEP))
    return np.column_stack(columns)


def assert_exact(hybrid, mode):
    command = [COMMAND_SCALE.get(name, 1.0) for name in mode.command_names]
    sizes = np.array([*mode.scale, *command])
    found = np.block([[mode.A, mode.B], [mode.C, mode.D]]) * sizes
    expected = differences(hybrid, mode, sizes)
    n = len(mode.state_names)
    read = np.abs(expected[n:]).max(axis=1)
    rows = np.concatenate([mode.scale, np.where(read > 0.0, read, 1.0)])[:, None]
    error = np.abs(found - expected) / rows
    largest = np.abs(expected / rows).max()

    assert error.max() <= ALLOWED * max(largest, 1.0), mode.name


@pytest.mark.parametrize("velocity_m_s", [0.0, 0.7])
def test_modes_of_the_gearbox_under_flows(velocity_m_s):
    hybrid = gearbox_modes(gearbox(), ShiftPoints(velocity_m_s=velocity_m_s))

    for mode in hybrid.modes[1:] if velocity_m_s else hybrid.modes:
        assert_exact(hybrid, mode)


def test_modes_of_the_gearbox_with_its_valves():
    hybrid = switched_modes(gearbox(), ShiftPoints(velocity_m_s=-0.4))

    for mode in hybrid.modes:
        assert_exact(hybrid, mode)


def test_modes_of_the_gearbox_with_dry_friction_and_detent():
    plant = gearbox()
    for omitted in ((DETENT, HEAT), (HEAT,)):
        dry = shift_model(plant, omitted)
        cuts = {"main_piston.position_m": side_cut(dry, 2), **DIRECTIONS}
        hybrid = hybrid_modes(plant, cuts, placed_at({"chamber_1.pressure_pa": 3e5}), dry)

        for mode in hybrid.modes:
            assert_exact(hybrid, mode)


@pytest.mark.parametrize(
    ("plant", "number"),
    [
        ("servo_drive", 27),
        ("crr_rig", 60),
        ("crr_arm", 33),
        ("crr_leg", 216),
        ("servo_reservoir", 5),
        ("soft_joint", 4),
        ("soft_joint_parametric", 2),
    ],
)
def test_standard_modes_of_every_plant(plant, number):
    hybrid = standard_modes(PLANTS[plant]())

    assert len(hybrid.modes) == number
    for mode in hybrid.modes:
        assert_exact(hybrid, mode)


def test_modes_of_the_servo_drive_by_flow_regimes():
    hybrid = REGIME_MODES["servo_drive"](servo_drive())

    assert len(hybrid.modes) == 45
    for mode in hybrid.modes:
        assert_exact(hybrid, mode)


@pytest.mark.parametrize("every", [37, pytest.param(1, marks=pytest.mark.slow)])
def test_modes_of_the_leg_with_its_valves_and_stops(every):
    hybrid = REGIME_MODES["crr_leg"](crr_leg())

    assert len(hybrid.modes) == (2 * (2 + 3) + 2) ** 3
    for mode in hybrid.modes[::every]:
        assert_exact(hybrid, mode)


def test_modes_of_the_gearbox_for_driving():
    """With gas masses, dry friction, stops and Neutral."""
    hybrid = driving_modes(gearbox())

    assert len(hybrid.modes) == 3 + 2 * 3
    for mode in hybrid.modes:
        assert_exact(hybrid, mode)


@pytest.mark.parametrize("plant", ["crr_rig", "crr_arm"])
def test_modes_that_controllers_are_designed_on(plant):
    hybrid = axis_modes(PLANTS[plant]())

    assert hybrid.modes
    for mode in hybrid.modes:
        assert_exact(hybrid, mode)


def test_no_plant_with_a_command_is_without_standard_modes():
    commanded = {name for name, make in PLANTS.items() if make().commands}

    assert commanded == set(STANDARD_MODES)


def test_a_difference_would_show_an_entry_that_is_wrong():
    hybrid = standard_modes(servo_drive())
    mode = hybrid.modes[0]
    mode.A[0, 1] *= 1.0 + 1e-4

    with pytest.raises(AssertionError):
        assert_exact(hybrid, mode)


def test_a_hundred_modes_take_one_set_of_derivatives(monkeypatch):
    """Counted, not timed: the time is printed by tests/benchmarks."""
    from linearize import reduction

    plant, built = servo_drive(), []
    whole = reduction.ca.jacobian
    monkeypatch.setattr(reduction.ca, "jacobian", lambda *a: built.append(a) or whole(*a))
    position = "slide.position_m"
    edges = np.linspace(0.0, 0.29, 101)
    cuts = servo_drive_cuts(plant)
    interval = type(cuts[position][0])
    parts = [
        interval(f"{k}", edges[k], edges[k + 1], 0.5 * (edges[k] + edges[k + 1]))
        for k in range(100)
    ]

    hybrid = hybrid_modes(plant, {position: parts})

    assert len(hybrid.modes) == 100
    assert len(built) == 4
