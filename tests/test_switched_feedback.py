"""The simple rivals of hybrid MPC: what they switch, and that they keep a valve's least time."""

import numpy as np
import pytest

from controllers.switched_feedback import (
    HOLD,
    SwitchedMemory,
    averaged,
    switched_lq,
    switched_pd,
)
from controllers.unseen import HELD_S
from linearize.shifting import STATES
from linearize.standard import shift_modes
from workbench.contracts import Estimate
from workbench.plants.gearbox import gearbox

FULL, AIR = 9e5, 1.013e5
TO_HIGH = np.array([[12e-3]])


@pytest.fixture(scope="module")
def designs():
    modes = shift_modes(gearbox())
    pd, lq = switched_pd(modes), switched_lq(modes, scheduled=True)
    return {"PD": pd, "LQ": lq, "PD, PWM": averaged(pd), "LQ, PWM": averaged(lq)}


def seen(x):
    return Estimate(STATES, np.array(x, dtype=float), np.eye(4))


def test_pd_brakes_with_both_valves_where_the_piston_is_too_fast_for_what_is_left(designs):
    pd = designs["PD"]
    slow, fast = ([FULL, AIR, 11e-3, v] for v in (0.1, 1.5))

    assert pd.step(pd.start(), TO_HIGH, seen(slow)).value.tolist() == [1.0, 0.0]
    assert pd.step(pd.start(), TO_HIGH, seen(fast)).value.tolist() == [0.0, 1.0]


@pytest.mark.parametrize("name", ["LQ", "PD"])
def test_at_the_target_with_its_pressures_the_commands_are_those_that_hold_it(designs, name):
    made = designs[name]
    for place_m, held, pressures in (
        (12e-3, [1, 0], (FULL, AIR)), (-12e-3, [0, 1], (AIR, FULL)), (0.0, [1, 1], (FULL, FULL))
    ):  # fmt: skip
        there = seen([*pressures, place_m, 0.0])
        assert made.step(made.start(), np.array([[place_m]]), there).value.tolist() == held


@pytest.mark.parametrize("name", ["PD", "LQ", "PD, PWM", "LQ, PWM"])
def test_a_valve_keeps_its_least_time_whatever_the_state_does(designs, name):
    made, rng = designs[name], np.random.default_rng(0)
    command, rows = made.start(), []
    for _ in range(300):
        x = rng.uniform([AIR, AIR, -12e-3, -2.0], [FULL, FULL, 12e-3, 2.0])
        place_m = rng.choice([-12e-3, 0.0, 12e-3])
        command = made.step(command, np.array([[place_m]]), seen(x))
        rows.append(command.value)
    for valve in np.array(rows).T:
        changes = np.flatnonzero(np.diff(valve))
        assert len(changes) > 5
        assert (np.diff(changes) >= HOLD).all()


def test_the_average_of_pwm_is_the_share_in_steps_of_the_least_time(designs):
    made = designs["PD, PWM"]
    steady = seen([FULL, AIR, 10e-3, 0.5])  # shares 1.0 - (0.5 - 0.2) = 0.7 and 0.3
    command, rows = made.start(), []
    for _ in range(20 * made.period):
        command = made.step(command, TO_HIGH, steady)
        rows.append(command.value)

    assert np.mean(rows, axis=0) == pytest.approx([2 / 3, 1 / 3], abs=0.02)


@pytest.mark.parametrize("name", ["PD", "LQ", "PD, PWM", "LQ, PWM"])
def test_without_an_estimate_the_last_command_holds_and_then_both_valves_are_shut(designs, name):
    """As every other law does, with a note; PWM goes on in its period where it was."""
    made, lost = designs[name], seen([FULL, AIR, np.nan, 0.1])
    command = made.step(made.start(), TO_HIGH, seen([AIR, AIR, -12e-3, 0.0]))
    held = round(HELD_S / made.sample_time_s)
    assert command.value.any() and "fallback" not in command.notes
    phase, rows = command.memory.phase, []
    for _ in range(held + 5):
        command = made.step(command, TO_HIGH, lost)
        assert command.notes["fallback"] == 1.0
        rows.append(command.value)

    assert (np.array(rows[:held]) == rows[0]).all() and rows[0].any()
    assert not np.any(rows[held:])
    assert command.memory.memory.phase == phase
    again = made.step(command, TO_HIGH, seen([AIR, AIR, -12e-3, 0.0]))
    assert "fallback" not in again.notes and isinstance(again.memory, SwitchedMemory)


def test_a_valve_keeps_its_least_time_where_the_estimate_comes_and_goes(designs):
    """It comes back a sample after the valves were shut."""
    made = designs["PD"]
    there, lost = seen([FULL, AIR, -12e-3, 0.0]), seen([np.nan] * 4)
    command, rows = made.start(), []
    for k in range(200):
        command = made.step(command, TO_HIGH, lost if k % 40 in range(10, 31) else there)
        rows.append(command.value)
    for valve in np.array(rows).T:
        changes = np.flatnonzero(np.diff(valve))
        assert (np.diff(changes) >= HOLD).all()
    assert np.diff(rows, axis=0).any()
