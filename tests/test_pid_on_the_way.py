"""What a PID sends as the direction turns, and through a spool that nobody tells of."""

from dataclasses import replace

import numpy as np
import pytest
from test_two_degree_pid import steps

from controllers.pid_tuning import PidParts, pid_with
from controllers.scheduled import Schedule
from controllers.two_degree_pid import PidGains
from linearize.standard import axis_modes, standard_modes
from workbench.plants.crr_rig import crr_rig
from workbench.plants.servo_drive import servo_drive


def test_a_step_that_turns_the_direction_leaves_nothing_in_the_integral():
    """The error of a step met the gains of both directions: 0.6 V stayed, and 1.6 mm of the rig."""
    up = PidGains(proportional=60.0, integral=1e-3, derivative=0.1)
    down = replace(up, proportional=75.0)
    sides = Schedule(np.array([0.08]), (up,), (down,))
    feedforward = PidParts(turn_speed=1e-4, standing_per_s=20.0)
    pid = pid_with(axis_modes(crr_rig()), sides, feedforward)
    openings, _ = steps(pid, [0.0799] * 5 + [0.1] * 5, [0.08] * 10)

    assert openings[:5] == pytest.approx(-75.0 * 1e-4, rel=1e-3)
    assert openings[5:] == pytest.approx(60.0 * 0.02, rel=3e-3)


def test_a_spool_that_an_estimator_does_not_tell_of_is_not_led():
    """With a valve lag `check --estimator raw`, `kalman` and `imm` ended with a KeyError."""
    slow = standard_modes(servo_drive().with_values({"valve_lag.time_constant_s": 8e-3}))
    pid = pid_with(slow, PidGains(proportional=10.0, integral=0.0, derivative=0.0))
    _, commands = steps(pid, 0.15, [0.14] * 3)

    assert pid.valve.lag is not None
    assert commands == pytest.approx(pid.valve.command(0.1)[0])
