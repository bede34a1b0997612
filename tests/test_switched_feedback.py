"""The simple rivals of hybrid MPC: what they switch, and that they keep a valve's least time."""

import numpy as np
import pytest

from controllers.switched_feedback import HOLD, averaged, switched_lq, switched_pd
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
