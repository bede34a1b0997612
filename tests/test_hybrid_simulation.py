"""Modes in time: they switch by their boxes, hold what friction holds, and let go when it does."""

from dataclasses import replace

import numpy as np
import pytest

from linearize.cuts import Interval
from linearize.discrete import sampled
from linearize.holding import holds_of
from linearize.hybrid_simulation import sampled_hybrid
from linearize.modes import HybridModel
from linearize.shift_modes import gearbox_modes
from linearize.standard import COMMAND, POSITION, PRESSURES, VELOCITY, standard_modes
from workbench.errors import UnknownNameError
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import (
    AREA_M2,
    BRISTLE_STIFFNESS_N_M,
    CENTRE_V,
    REST_PA,
    servo_drive,
)
from workbench.recording import Recording
from workbench.simulation import simulate

STEP_S = 1e-3
MIDDLE_M = 0.145
STATIC_N = {1: 50.97, -1: 46.15}  # paper 002, Table 5


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


@pytest.fixture(scope="module")
def modes(hybrid):
    return sampled_hybrid(hybrid, STEP_S)


def start(velocity_m_s=0.0, pushed_n=0.0, position_m=MIDDLE_M):
    half_pa = pushed_n / AREA_M2 / 2.0
    return np.array([position_m, velocity_m_s, REST_PA + half_pa, REST_PA - half_pa])


def shut(samples):
    return np.full((1, samples), CENTRE_V)


def names_of(hybrid, run):
    """Modes in the order in which they were active."""
    names = [hybrid.modes[k].name for k in run.modes]
    return [name for k, name in enumerate(names) if k == 0 or name != names[k - 1]]


def test_inside_one_mode_it_is_that_mode_sampled(hybrid, modes):
    mode = hybrid["charge a slide + middle"]
    step, x = sampled(mode, STEP_S), start(0.2, 30.0)
    u = mode.command

    run = modes.run(x, np.tile(u[:, None], 11))

    for _ in range(10):
        x = step.F @ x + step.G @ u + step.offset
    assert names_of(hybrid, run) == [mode.name]
    assert run.states[:, -1] == pytest.approx(x, rel=1e-12)


@pytest.mark.parametrize("side", [1, -1])
def test_a_slide_at_rest_breaks_away_at_the_force_of_static_friction(modes, side):
    """The model's tanh and Stribeck curve leave a little less than the table's peak."""
    held = modes.run(start(pushed_n=side * 0.93 * STATIC_N[side]), shut(20))
    gone = modes.run(start(pushed_n=side * 1.01 * STATIC_N[side]), shut(20))

    assert np.ptp(held.states[0]) == 0.0
    assert not held.states[1].any()
    assert side * gone.states[1, 5] > 0.02
    assert (side * np.diff(gone.states[0]) >= 0.0).all()


@pytest.mark.parametrize(("share", "moves"), [(0.88, False), (1.05, True)])
def test_the_full_plant_breaks_away_at_the_same_force(share, moves):
    """Its bristle carries 0.88 of the peak from the start."""
    plant, force_n = servo_drive().lean(), share * STATIC_N[1]
    begun = dict(zip(plant.model.states, plant.initial, strict=True))
    begun |= dict(zip((POSITION, VELOCITY, *PRESSURES), start(pushed_n=force_n), strict=True))
    begun["friction.deflection_m"] = 0.88 * STATIC_N[1] / BRISTLE_STIFFNESS_N_M
    commands = Recording("shut", STEP_S, {COMMAND: np.full(20, CENTRE_V)})

    found = simulate(plant, commands, np.array([*begun.values()]))[POSITION]

    assert (np.ptp(found) > 4e-4) == moves
    assert moves or np.ptp(found) < 1e-5


def test_a_slide_that_runs_out_stops_and_stays(hybrid, modes):
    run = modes.run(start(0.05), shut(60))

    assert names_of(hybrid, run) == ["closed slide + middle", "closed stick middle"]
    assert not run.states[1, -10:].any()
    assert np.ptp(run.states[0, -10:]) == 0.0


def test_a_step_of_the_valve_starts_the_slide_and_its_end_stops_it(hybrid, modes):
    commands = np.concatenate([shut(50), shut(150) + 0.3, shut(300)], axis=1)

    run = modes.run(start(position_m=0.05), commands)

    named = names_of(hybrid, run)
    assert named[0] == "closed stick near a"
    assert "charge a stick near a" in named
    assert "charge a slide + near a" in named
    assert named[-1].startswith("closed stick")


def test_many_starts_at_once_are_each_start_alone(modes):
    starts = np.column_stack([start(0.05), start(pushed_n=60.0), start(-0.3, -20.0)])
    commands = shut(40) + 0.2 * np.sin(np.arange(40) / 5.0)

    together = modes.run(starts, np.repeat(commands[:, :, None], 3, axis=2))

    for k in range(3):
        alone = modes.run(starts[:, k], commands)
        assert together.modes[:, k].tolist() == alone.modes.tolist()
        assert together.states[..., k] == pytest.approx(alone.states, rel=1e-12)


def test_what_is_in_no_box_is_an_error_that_says_where(hybrid, modes):
    below = tuple(m for m in hybrid.modes if m.box[POSITION].label != "near b")
    cut = sampled_hybrid(replace(hybrid, modes=below), STEP_S)

    with pytest.raises(LookupError, match=r"no mode of servo_drive covers .*position_m': 0.25"):
        cut.run(start(position_m=0.25), shut(2))


def test_a_cut_on_something_else_than_states_and_commands_is_an_error(hybrid):
    mode = hybrid.modes[0]
    box = {**mode.box, "slide.position_mm": Interval("all", -np.inf, np.inf, 0.0)}

    with pytest.raises(UnknownNameError, match=r"no slide.position_mm; did you mean slide.pos"):
        sampled_hybrid(HybridModel(hybrid.plant, hybrid.model, (replace(mode, box=box),)), STEP_S)


def test_a_mode_that_holds_nothing_has_no_hold(hybrid):
    assert not holds_of(hybrid, hybrid["closed slide + middle"])


@pytest.fixture(scope="module")
def shift():
    return gearbox_modes(gearbox())


def test_neutral_is_held_from_both_sides_and_left_when_one_chamber_is_vented(shift):
    """Its guards are forces on both sides; both valves on hold it, one alone does not."""
    modes = sampled_hybrid(shift, 1e-4)
    held = modes.run(np.array([8e5, 8e5, 0.0, 0.0]), np.zeros((2, 50)))
    left = modes.run(np.array([8e5, 2e5, 0.0, 0.0]), np.zeros((2, 50)))

    assert names_of(shift, held) == ["held at Neutral"]
    assert held.states[2:].any() == np.False_
    assert names_of(shift, left)[0].startswith("High side")
    assert left.states[2, -1] > 1e-3
