"""MPC of the position at its limits in closed loop, on the whole servo drive."""

import numpy as np
import pytest

from controllers.design_file import design as design_of
from controllers.linear_mpc import linear_mpc
from controllers.mpc_spec import MpcSpec
from controllers.nonlinear_mpc import nonlinear_mpc
from controllers.program_solvers import Daqp
from linearize.standard import PRESSURES, standard_modes
from studies.closed_loop_check import check, run, standard_estimator
from studies.controller_calls import fallbacks
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


PRICES = {"absurd": {"slack_price": 1e300}, "usual": {}}
DESIGNS = {"mpc": linear_mpc, "nonlinear-mpc": nonlinear_mpc}


@pytest.fixture(params=DESIGNS)
def design(request, hybrid):
    """A design by its specification."""
    return lambda **numbers: DESIGNS[request.param](hybrid, MpcSpec(**numbers))


def test_a_check_counts_the_samples_in_which_no_program_was_solved():
    """A price that no number stands beside: 100 mm were missed, and nothing had said why."""
    plant = servo_drive()
    made = {name: design_of("mpc", plant, numbers).controller for name, numbers in PRICES.items()}
    absurd, usual = check(plant, made, ["ekf"], ["step"]).rows
    resting = 0.1 / made["absurd"].sample_time_s

    assert absurd.control_samples == usual.control_samples == 650
    assert absurd.fallback_samples == absurd.control_samples - resting and not absurd.reached
    assert usual.fallback_samples == 0.0 and usual.reached
    (said,) = fallbacks([absurd, usual])
    assert said.endswith("ran on its fallback, in 600 of 650 samples of step with absurd and ekf")


@pytest.mark.parametrize(("start_m", "beyond_m", "limit_m"), [(0.12, 0.25, 0.2), (0.2, 0.01, 0.09)])
def test_a_reference_beyond_a_limit_of_the_position_leads_to_the_limit(
    design, start_m, beyond_m, limit_m
):
    """Within 0.2 mm of it for all of 5 s, and no farther beyond than 0.1 mm."""
    record = stepped(design(margin_m=0.09), start_m, beyond_m, 5.1).recording
    beyond = (record["slide.position_m"] - limit_m) * np.sign(beyond_m - limit_m)

    assert beyond.max() < 1e-4
    assert np.abs(beyond[500:]).max() < 2e-4


def test_a_limit_of_the_speed_is_kept_on_the_way(design):
    """Within 0.02 m/s of 0.3 m/s; a step of 100 mm without it comes to 0.8 m/s and more."""
    record = stepped(design(fastest_m_s=0.3), 0.095, 0.195, 1.3).recording

    assert record["slide.velocity_m_s"].max() < 0.32
    assert record["slide.position_m"][-1] == pytest.approx(0.195, abs=2e-4)


def test_a_limit_of_the_rate_is_kept_on_the_way(design):
    """Of the opening that is planned, to a hundredth."""
    notes = stepped(design(rate_v_s=50.0), 0.095, 0.195, 1.3).notes

    assert np.nanmax(np.abs(np.diff(notes["opening_v"]))) < 50.5 * 2e-3


def test_a_limit_of_the_pressures_is_kept_on_the_way_and_the_slide_arrives(design):
    """At 6.3 bar, which leaves 1.02 bar across the stuck slide; it breaks away at 0.99 bar."""
    record = stepped(design(below_supply_pa=0.7e5), 0.095, 0.195, 1.3).recording

    assert max(record[name].max() for name in PRESSURES) < 6.32e5
    assert record["slide.position_m"][-1] == pytest.approx(0.195, abs=2e-4)


def test_a_limit_of_the_pressures_that_leaves_too_little_to_break_away_is_kept_without_wind_up(
    design,
):
    """At 6 bar there are 0.6 bar at most.  The integral does not grow while the slide stands."""
    found = stepped(design(below_supply_pa=1e5), 0.095, 0.195, 3.0)

    assert max(found.recording[name].max() for name in PRESSURES) < 6.02e5
    assert np.abs(found.notes["integral_m_s"][-100:]).max() < 1e-5
