"""MPC of the position at its limits in closed loop, on the whole servo drive."""

import numpy as np
import pytest

from controllers.condensed import MpcSpec
from controllers.linear_mpc import linear_mpc
from controllers.program_solvers import Daqp
from linearize.standard import standard_modes
from studies.closed_loop_check import run, standard_estimator
from studies.scenarios import Scenario
from workbench.plants.servo_drive import servo_drive


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


def stepped(controller, start_m, end_m, seconds):
    """A run of the whole plant whose reference steps after 0.1 s."""
    plant = servo_drive().lean()
    reference_m = np.full(round(1e3 * seconds), end_m)
    reference_m[:100] = start_m
    estimator = standard_estimator("ekf", plant, controller.sample_time_s)
    return run(plant, controller, estimator, Scenario("step", reference_m, 0.1, 0.1), 0)


class Beside:
    """DAQP as it is started, and cold beside it."""

    def __init__(self):
        self.told = []

    def solved(self, program, g, low, high, start):
        warm, cold = (Daqp().solved(program, g, low, high, each) for each in (start, None))
        self.told.append((warm.iterations, cold.iterations, np.abs(warm.z - cold.z).max()))
        return warm


def test_started_from_the_last_multipliers_a_run_at_limits_takes_half_the_iterations(hybrid):
    """At most half of those of cold starts, with the same answers."""
    solver = Beside()
    stepped(linear_mpc(hybrid, MpcSpec(horizon=30, fastest_m_s=0.6), solver), 0.095, 0.195, 0.6)
    warm, cold, apart = np.array(solver.told).T

    assert len(warm) > 30
    assert warm.sum() < 0.5 * cold.sum()
    assert apart.max() < 1e-9
