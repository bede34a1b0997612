"""Linear MPC: what its program solves, what it falls back on, and that nothing is kept."""

import pickle
from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest

from controllers.linear_mpc import limited_plan, linear_mpc
from controllers.lq import dlqr
from controllers.mpc_spec import MpcSpec
from controllers.positioning import STATES
from controllers.program_solvers import Answer, Daqp, Osqp
from linearize.discrete import sampled
from linearize.standard import standard_modes
from workbench.contracts import Estimate
from workbench.plants.servo_drive import servo_drive

REST = np.array([0.145, 0.0, 5.65e5, 5.65e5])
FAST = np.array([0.145, 0.3, 6.8e5, 1.3e5])


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


@pytest.fixture(scope="module")
def controller(hybrid):
    return linear_mpc(hybrid, MpcSpec())


def seen(state):
    return Estimate(STATES, np.array(state, dtype=float), np.eye(4))


def held(controller, position_m):
    """A reference that stays."""
    return np.full((1, controller.preview), position_m)


UNITS = {"position": 1e-3, "velocity": 0.1, "pressure a": 1e4, "pressure b": 1e4}


def oracle(program, spec, x, targets, without=""):
    """The same problem with its states for cvxpy, shape (N,); last opening 0.3 V, steady 0.1 V."""
    n, unit = program.horizon, np.array([*UNITS.values()])
    F, G = program.free[:4], program.forced[:4, :1]
    stage, last = (np.linalg.cholesky(Q).T for Q in (program.Q[:4, :4], program.Q[-4:, -4:]))
    u, slack, z = cp.Variable((1, n)), cp.Variable(5, nonneg=True), cp.Variable((4, n))
    X = cp.diag(unit) @ z
    off, moves = X - targets[:4, None], cp.diff(cp.hstack([np.array([[0.3]]), u]), axis=1)
    cost = spec.slack_weight * cp.sum_squares(slack)
    cost += spec.slack_price * (slack @ [0.1, 1.0, 1.0, 1.0, 10.0])
    cost += cp.sum_squares(stage @ off[:, :-1]) + cp.sum_squares(last @ off[:, -1])
    cost += program.R * cp.sum_squares(u - 0.1) + program.S * cp.sum_squares(moves)
    after = F @ cp.hstack([x[:, None], X[:, :-1]]) + G @ u + program.drift[:4, None]
    limits = [z == cp.diag(1.0 / unit) @ after]
    limits += [u >= program.limits.openings[0], u <= program.limits.openings[1]]
    if without != "rate":
        limits += [cp.abs(moves) <= spec.rate_v_s * spec.sample_time_s + slack[4]]
    low = [spec.margin_m, -spec.fastest_m_s, spec.lowest_pa, spec.lowest_pa] / unit
    high = [0.29 - spec.margin_m, spec.fastest_m_s, *[7e5 - spec.below_supply_pa] * 2] / unit
    for k in (k for k, name in enumerate(UNITS) if name != without):
        limits += [z[k] >= low[k] - slack[k], z[k] <= high[k] + slack[k]]
    cp.Problem(cp.Minimize(cost), limits).solve(solver=cp.CLARABEL)
    return u.value[0]


LIMITS = {
    "position": (dict(margin_m=0.13), [0.15, 0.5, 5.9e5, 5.0e5], 0.2),
    "velocity": (dict(fastest_m_s=0.25), [0.145, 0.3, 5.9e5, 5.0e5], 0.2),
    "pressure a": (dict(), FAST, 0.2),
    "pressure b": (dict(), [0.145, 0.3, 3.0e5, 1.3e5], 0.2),
    "rate": (dict(rate_v_s=200.0), [0.145, 0.1, 5.9e5, 5.0e5], 0.16),
}


@pytest.mark.parametrize("solver", [Daqp(), Osqp()], ids=["daqp", "osqp"])
@pytest.mark.parametrize("limit", LIMITS)
def test_each_soft_limit_has_the_solution_of_a_readable_oracle(hybrid, limit, solver):
    """From a state where that limit counts: without it the oracle plans otherwise."""
    numbers, x, position_m = LIMITS[limit]
    spec = MpcSpec(**numbers)
    program = linear_mpc(hybrid, spec, solver).programs.forward[1]
    targets = np.tile([position_m, 0.0, 5.9e5, 5.0e5], program.horizon)
    unforced = program.unforced(np.array(x), 0.0)
    g = program.gradient(unforced, targets, 0.1, 0.3)

    plan, notes = limited_plan(program, g, *program.limits.bounds(unforced, 0.3), None, 0.1)

    wanted = oracle(program, spec, np.array(x), targets)
    assert notes["fallback"] == 0.0
    assert plan.openings[:5] == pytest.approx(wanted[:5], abs=1e-3)
    assert np.abs(oracle(program, spec, np.array(x), targets, limit) - wanted).max() > 0.01


class NextToTheEnd:
    """A solver that opens the valve as far as it goes, but for rounding."""

    def solved(self, program, g, low, high, start):
        z = np.zeros(len(g))
        z[0] = np.nextafter(program.limits.openings[1], 0.0)
        return Answer(z, 1, np.zeros(len(low)))


def test_the_integral_rests_where_rounding_alone_keeps_the_valve_from_its_end(hybrid):
    """It grows where the same solver opens the valve less far."""

    class HalfWay(NextToTheEnd):
        def solved(self, program, g, low, high, start):
            answer = super().solved(program, g, low, high, start)
            return answer._replace(z=0.5 * answer.z)

    grown = []
    for solver in (NextToTheEnd(), HalfWay()):
        made = linear_mpc(hybrid, MpcSpec(), solver)
        command = made.step(made.start(), held(made, 0.27), seen([0.145, 0.0, 6.95e5, 1.1e5]))
        assert command.notes["iterations"] == 1.0
        grown.append(command.memory.integral_m_s)

    assert grown[0] == 0.0 and abs(grown[1]) > 0.0


def test_both_solvers_make_the_same_step_at_the_limits_and_repeat_it(hybrid):
    """States all over the range, from the last plan each: within a millivolt, to the last bit."""
    made = [linear_mpc(hybrid, MpcSpec(), solver) for solver in (Daqp(), Osqp())]
    rng, at_limits = np.random.default_rng(5), 0
    for x in REST + [0.1, 1.5, 1.3e5, 1.3e5] * rng.uniform(-1.0, 1.0, (12, 4)):
        one, other = (
            c.step(c.step(c.start(), held(c, 0.2), seen(x)), held(c, 0.2), seen(x)) for c in made
        )
        again = made[1].step(made[1].start(), held(made[1], 0.2), seen(x))
        again = made[1].step(again, held(made[1], 0.2), seen(x))

        assert other.notes["fallback"] == one.notes["fallback"] == 0.0
        assert other.notes["opening_v"] == pytest.approx(one.notes["opening_v"], abs=1e-3)
        assert np.array_equal(other.value, again.value)
        if other.notes["iterations"] > 0:
            at_limits += 1
            multipliers = [each.memory.plan.start.multipliers for each in (one, other)]
            assert multipliers[1] == pytest.approx(multipliers[0], abs=1e-3)
    assert at_limits >= 5


def test_a_program_that_osqp_does_not_finish_has_no_answer(hybrid):
    program = linear_mpc(hybrid, MpcSpec(), Osqp(most_iterations=2)).programs.forward[1]
    unforced = program.unforced(FAST, 0.0)
    g = program.gradient(unforced, np.tile([0.2, 0.0, 5.9e5, 5.0e5], 20), 0.1, 0.3)
    plan, notes = limited_plan(program, g, *program.limits.bounds(unforced, 0.3), None, 0.1)

    assert notes == {"fallback": 1.0}
    assert plan.openings == pytest.approx(0.1)


def test_mpc_without_limits_and_move_cost_is_the_regulator(hybrid):
    """The terminal cost is the cost-to-go, so any horizon gives the gain of the infinite one."""
    spec = MpcSpec(move_v=1e6, horizon=7)
    program = linear_mpc(hybrid, spec).programs.forward[1]
    mode = hybrid["charge a slide + middle"]
    small, tolerable = sampled(mode, spec.sample_time_s), np.array([1e-3, 0.1, 1e6, 1e6])
    K = dlqr(small.F, small.G, np.diag(tolerable**-2.0), np.eye(1) / 0.3**2, mode.scale)

    def first_move(x):
        g = program.gradient(program.unforced(x, 0.0), np.tile(REST, 7), 0.0, 0.0)
        return program.unlimited(g)[0]

    for away in np.diag([1e-3, 0.1, 1e4, 1e4]):
        assert first_move(REST + away) - first_move(REST) == pytest.approx(-(K @ away)[0], rel=1e-3)


def test_mpc_at_its_limits_gives_the_same_answer_whatever_it_solved_before(controller):
    far = seen([0.145, -1.5, 1.1e5, 6.95e5])
    first = controller.step(controller.start(), held(controller, 0.28), far)
    controller.step(first, held(controller, 0.01), seen([0.01, 1.0, 6.9e5, 1.0e5]))
    again = controller.step(controller.start(), held(controller, 0.28), far)

    assert first.notes["iterations"] > 0
    assert np.array_equal(first.value, again.value)


def test_mpc_replays_a_run_at_its_limits_to_the_last_bit(hybrid, controller):
    """In any order, after a program without an answer, with a solver of its own, and unpickled."""
    fresh = linear_mpc(hybrid, MpcSpec())
    rng = np.random.default_rng(3)
    states = REST + [0.1, 1.5, 1.3e5, 1.3e5] * rng.uniform(-1.0, 1.0, (30, 4))

    def planned(program, order):
        found = {}
        for k in order:
            unforced = program.unforced(states[k], 0.0)
            g = program.gradient(unforced, np.tile([0.28, 0.0, 5.9e5, 5.0e5], 20), 0.1, 0.3)
            plan, notes = limited_plan(program, g, *program.limits.bounds(unforced, 0.3), None, 0.1)
            found[k] = (plan.start.z, plan.openings, notes)
        return [found[k] for k in range(len(states))]

    first = planned(controller.programs.forward[1], range(len(states)))
    program = fresh.programs.forward[1]
    limited_plan(
        program,
        np.full(len(program.hessian), np.nan),
        *program.limits.bounds(program.unforced(states[0], 0.0), 0.3),
        None,
        0.0,
    )
    for other in (program, pickle.loads(pickle.dumps(program))):
        for one, again in zip(first, planned(other, rng.permutation(len(states))), strict=True):
            assert np.array_equal(one[0], again[0]) and np.array_equal(one[1], again[1])
            assert one[2] == again[2]


def test_mpc_falls_back_on_its_last_plan(controller):
    program = controller.programs.forward[1]
    before = controller.step(controller.start(), held(controller, 0.16), seen(REST)).memory.plan
    low, high = program.limits.bounds(program.unforced(REST, 0.0), 0.0)

    unknown = np.full(len(program.hessian), np.nan)
    plan, notes = limited_plan(program, unknown, low, high, before, 0.0)

    assert notes["fallback"] == 1.0
    assert plan.openings[:-1] == pytest.approx(before.openings[1:])


class Clock:
    """Seconds that pass from call to call."""

    def __init__(self, *passing):
        self.left, self.now = list(passing), 0.0

    def __call__(self):
        self.now += self.left.pop(0) if self.left else 0.0
        return self.now


def test_a_late_answer_is_replaced_by_the_shifted_last_plan_and_told(controller):
    clock = Clock(0.0, 0.9e-3, 0.0, 1.1e-3, 0.0, 0.9e-3)
    timed = replace(controller, deadline_s=1e-3, clock=clock)
    reference = held(controller, 0.16)
    first = timed.step(timed.start(), reference, seen(REST))
    late = timed.step(first, reference, seen(REST))
    after = timed.step(late, reference, seen(REST))

    assert [c.notes["late"] for c in (first, late, after)] == [0.0, 1.0, 0.0]
    assert [c.notes["fallback"] for c in (first, late, after)] == [0.0, 1.0, 0.0]
    assert late.notes["opening_v"] == first.memory.plan.openings[1]
    assert late.memory.plan.openings[:-1] == pytest.approx(first.memory.plan.openings[1:])


def test_a_late_first_answer_leaves_the_valve_at_the_steady_opening(controller):
    timed = replace(controller, deadline_s=1e-3, clock=Clock(0.0, 1.0))
    command = timed.step(timed.start(), held(controller, 0.16), seen(REST))

    assert command.notes["late"] == 1.0
    assert abs(command.notes["opening_v"]) < 0.05


def test_the_mode_is_that_of_the_place_to_which_the_last_plan_leads(controller):
    """Just before a boundary of modes at speed: the first sample has no plan, the second has."""
    edge_m = controller.programs.positions_m[:2].mean()
    fast = seen([edge_m - 5e-3, 1.0, 5.9e5, 5.0e5])
    first = controller.step(controller.start(), held(controller, 0.25), fast)
    place_m = first.memory.plan.place_m
    second = controller.step(first, held(controller, 0.25), fast)
    near, ahead = controller.programs.forward[:2]
    only = [
        replace(controller, programs=controller.programs.mapped(lambda _, p=p: p))
        for p in (near, ahead)
    ]
    by_near, by_ahead = (c.step(first, held(c, 0.25), fast).value for c in only)

    assert edge_m < place_m < edge_m + 0.03
    assert np.array_equal(second.value, by_ahead) and not np.array_equal(by_near, by_ahead)
