"""Nonlinear MPC: its prediction, its program, and what it falls back on."""

import pickle
from dataclasses import fields, replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from controllers.linear_mpc import limited_plan, linear_mpc
from controllers.mpc_spec import MpcSpec
from controllers.nonlinear_mpc import NonlinearMpc, along, nonlinear_mpc
from controllers.positioning import STATES
from controllers.rollout import Rollout
from controllers.scheduled import constant
from linearize.standard import standard_modes
from studies.closed_loop_check import check
from workbench.contracts import Estimate
from workbench.plants.servo_drive import servo_drive

REST = np.array([0.145, 0.0, 5.65e5, 5.65e5])
SLIDING = np.array([0.145, 0.2, 5.9e5, 5.0e5])
FORWARD = np.array([1.0, 0.0])
CENTRE_V = 4.95


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


@pytest.fixture(scope="module")
def controller(hybrid):
    return nonlinear_mpc(hybrid, MpcSpec())


def seen(state):
    return Estimate(STATES, np.array(state, dtype=float), np.eye(4))


def held(controller, position_m):
    """A reference that stays."""
    return np.full((1, controller.preview), position_m)


def test_the_prediction_is_that_of_the_reduced_plant_while_it_slides(hybrid, controller):
    """Oracle: the rates of the design model itself, integrated by SciPy."""
    openings = 0.3 + 0.4 * np.sin(np.arange(20))
    states, _ = controller.rollout(SLIDING, openings, FORWARD)
    x, way = SLIDING, []
    for opening in openings:
        found = solve_ivp(
            lambda _, x, u=opening: hybrid.model.f(x, CENTRE_V + u)[0].full().ravel(),
            (0.0, 2e-3), x, method="LSODA", rtol=1e-9, atol=[1e-12, 1e-9, 1e-3, 1e-3],
        )  # fmt: skip
        x = found.y[:, -1]
        way.append(x)

    assert np.array(way)[:, 1].min() > 0.1
    worst = np.abs(states.reshape(20, 4) - way).max(axis=0)
    assert (worst < [1e-6, 1e-4, 30.0, 30.0]).all(), worst


def test_sensitivities_are_slopes_of_the_prediction(controller):
    openings, e = np.full(20, 0.2), 1e-4
    _, slopes = controller.rollout(SLIDING, openings, FORWARD)
    for j in (0, 7, 19):
        ends = [
            controller.rollout(SLIDING, openings + way * np.eye(20)[j], FORWARD)[0]
            for way in (e, -e)
        ]
        expected = (ends[0] - ends[1]) / (2.0 * e)
        assert slopes[:, j] == pytest.approx(expected, rel=1e-5, abs=1e-3)
        assert (slopes[: 4 * j, j] == 0.0).all()


def linear_rollout(program):
    """The rollout of a plant that is linear, from the first sample of a program."""
    x, u, d = ca.MX.sym("x", 4), ca.MX.sym("u"), ca.MX.sym("d", 2)
    F, G = program.free[:4], program.forced[:4, 0]
    later = ca.DM(F) @ x + ca.DM(G) * u + ca.DM(program.drift[:4] + 0.0)
    later += ca.DM(program.pushed[:4]) * d[1]
    return Rollout(ca.Function("advance", [x, u, d], [later]), program.horizon, (0, 1, 2, 3))


@pytest.mark.parametrize("position_m", [0.146, 0.25])
def test_on_a_linear_plant_it_is_linear_mpc(hybrid, position_m):
    """Whatever the last plan, near the target and at the limits."""
    linear = linear_mpc(hybrid, MpcSpec())
    program = linear.programs.forward[1]
    one = replace(linear, programs=constant(program))
    parts = {f.name: getattr(one, f.name) for f in fields(one)}
    nonlinear = NonlinearMpc(**parts, rollout=linear_rollout(program))
    commands = [each.start() for each in (one, nonlinear)]
    for x in SLIDING + np.outer(np.arange(5), [2e-3, 0.1, 1e4, -1e4]):
        commands = [
            each.step(last, held(one, position_m), seen(x))
            for each, last in zip((one, nonlinear), commands, strict=True)
        ]
        plans = [c.memory.plan.openings for c in commands]

        assert commands[1].notes["fallback"] == 0.0
        assert plans[1] == pytest.approx(plans[0], abs=1e-4)


def test_repeated_at_one_state_it_comes_to_the_optimum_of_the_nonlinear_problem(hybrid, controller):
    """Oracle: the same cost and bounds, unlinearised, by IPOPT."""
    program = controller.programs.forward[1]
    n, advance = program.horizon, controller.rollout.advance
    targets, d = np.tile([0.155, 0.0, 5.9e5, 5.0e5], n), [1.0, 0.0]
    u, states, x = ca.MX.sym("u", n), [], ca.DM(SLIDING)
    for i in range(n):
        x = advance(x, u[i], ca.DM(d))
        states.append(x)
    off, moves = ca.vertcat(*states) - targets, u - ca.vertcat(0.3, u[:-1])
    cost = ca.bilin(ca.DM(program.Q), off, off)
    cost += program.R * ca.sumsqr(u - 0.1) + program.S * ca.sumsqr(moves)
    quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.tol": 1e-10}
    solver = ca.nlpsol("exact", "ipopt", {"x": u, "f": cost}, quiet)
    smallest, largest = program.limits.openings
    wanted = solver(x0=0.1, lbx=smallest, ubx=largest)["x"].full().ravel()

    openings, changes = np.full(n, 0.1), []
    for _ in range(8):
        near, unforced = along(program, controller.rollout, SLIDING, openings, d)
        g = near.gradient(unforced, targets, 0.1, 0.3)
        plan, notes = limited_plan(near, g, *near.limits.bounds(unforced, 0.3), None, 0.1)
        assert notes["fallback"] == 0.0
        changes.append(abs(plan.openings - wanted).max())
        openings = plan.openings

    assert changes[-1] < 1e-3 < changes[0]


def test_it_settles_a_step_on_the_full_drive_without_a_limit_cycle():
    plant = servo_drive().lean()
    design = nonlinear_mpc(standard_modes(servo_drive()))
    for seed in (0, 1):
        found = check(plant, {"nonlinear-mpc": design}, ["ekf"], ["step"], seed=seed)

        row, notes = found.rows[0], found.records[0].notes
        assert row.reached, row
        assert row.overshoot_m < 2e-3 and row.rise_s < 0.1
        assert row.violation_s < 5e-3
        assert np.nanmax(notes["fallback"]) == 0.0


def test_a_prediction_that_is_not_finite_lets_the_last_plan_go_on(controller):
    reference = held(controller, 0.16)
    first = controller.step(controller.start(), reference, seen(REST))
    nowhere = Rollout(
        ca.Function("advance", [ca.MX.sym("x", 4), ca.MX.sym("u"), ca.MX.sym("d", 2)],
                    [ca.MX(ca.DM([np.nan] * 4))]),
        20, (0, 1, 2, 3),
    )  # fmt: skip
    command = replace(controller, rollout=nowhere).step(first, reference, seen(REST))

    assert command.notes["fallback"] == 1.0
    assert command.notes["opening_v"] == first.memory.plan.openings[1]


def test_a_late_answer_is_replaced_by_the_shifted_last_plan_and_told(controller):
    times = iter([0.0, 0.5e-3, 1.0, 1.0011])
    timed = replace(controller, deadline_s=1e-3, clock=lambda: next(times))
    reference = held(controller, 0.16)
    first = timed.step(timed.start(), reference, seen(REST))
    late = timed.step(first, reference, seen(REST))

    assert [c.notes["late"] for c in (first, late)] == [0.0, 1.0]
    assert late.notes["opening_v"] == first.memory.plan.openings[1]


def test_it_gives_the_same_answer_twice_and_unpickled(controller):
    reference, limited = held(controller, 0.25), seen([0.145, 0.3, 6.8e5, 1.3e5])
    first = controller.step(controller.start(), reference, seen(REST))
    found = [
        each.step(first, reference, limited)
        for each in (controller, controller, pickle.loads(pickle.dumps(controller)))
    ]

    assert found[0].notes["iterations"] > 0
    for one in found[1:]:
        assert np.array_equal(one.memory.plan.start.z, found[0].memory.plan.start.z)
