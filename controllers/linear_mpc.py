"""Linear MPC: one condensed quadratic program per mode, solved from the last plan.

    min   sum_i |x_i - target_i|_Q^2 + |u_i - u_s|_R^2 + |u_i - u_i-1|_S^2 + |x_N - target_N|_P^2
          + rho |slack|^2 + sigma slack
    s.t.  x_i+1 = F x_i + G u_i + offset,   u_lower <= u_i <= u_upper,
          lower - slack <= position, velocity, pressures <= upper + slack,   slack >= 0,
          |u_i - u_i-1| <= move + slack

P is the cost-to-go of the LQ design, which has no price S of moves: without active limits the first
move is that of LQ, but for what S takes off it.
Steady errors are taken out by a disturbance force on the slide, which grows with the integral of
the error: the prediction feels it and the target pressures balance it.  Inputs are limited hard,
states and the rate of the input softly, so that the program always has a solution.  Since a
violation has a price in proportion too, a limit that can be kept is kept as long as it is worth
less to violate it.  The reference counts as far as the position may go, and the integral rests
where velocity or pressures are at a limit towards which it pushes, as at an end of the valve: a
slide that a limit leaves too little force to break away stands still.

The mode is that of the place to which the last plan leads in half a horizon.  Where the solver has
no answer, or its answer comes after the deadline, the last plan goes on, and the notes say so.

Where the unconstrained optimum keeps all limits it is the solution, and no solver is asked.  At the
limits it is DAQP unless another one is given, see :mod:`controllers.program_solvers`.

Source: E. C. Kerrigan and J. M. Maciejowski, "Soft constraints and exact penalty functions in model
predictive control", Proc. UKACC Int. Conf. Control (2000), for the price of a violation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, nan
from time import perf_counter

import numpy as np

from controllers.condensed import BALANCING, Asked, Program, program_of
from controllers.margins import Law
from controllers.motion import PREVIEW
from controllers.mpc_limits import soft_rows, state_limits
from controllers.mpc_spec import MpcSpec
from controllers.positioning import STATES, Memory, Positioning, Task, positioning
from controllers.program_solvers import Daqp, Solver, Start
from controllers.scheduled import Schedule, scheduled
from controllers.unseen import waiting
from linearize.modes import HybridModel
from linearize.reduction import closed_command
from workbench.contracts import Command, Estimate

PUSHED = np.array([0.0, 1.0, 1.0, -1.0])  # ways of velocity and pressures as the slide is pushed
AT_END_V = 1e-9  # from an end of the valve, which a solver meets to rounding
NO_LIMIT = {"fallback": 0.0, "iterations": 0.0}  # notes of a plan that needs no solver
ROUNDED = 1e-3  # cost per unit of a slack: multipliers below are rounding of a solver


@dataclass(frozen=True)
class Plan:
    """The last solution.

    openings      those ahead, shape (N,)
    place_m       the place half-way
    start         where a solver may begin: what was active is likely to be so a sample later;
                  None where no limit was met
    """

    openings: np.ndarray
    place_m: float = nan
    start: Start | None = None

    def against(self, force: float) -> bool:
        """Whether velocity or pressures are at a limit towards which such a force pushes."""
        if self.start is None:
            return False
        n, states = len(self.openings), len(STATES)
        below, above = (self.start.multipliers[rows][: n * states] for rows in soft_rows(n))
        held = (below + above).reshape(n, states).sum(axis=0)
        return bool((held * PUSHED * np.sign(force) > ROUNDED).any())

    def shifted(self) -> Plan:
        """The same plan a sample later, its last opening held."""
        kept = np.append(self.openings[1:], self.openings[-1])
        if self.start is None:
            return replace(self, openings=kept)
        z = np.append(kept, self.start.z[len(kept) :])
        return replace(self, openings=kept, start=self.start._replace(z=z))


@dataclass(frozen=True, kw_only=True)
class LinearMpc:
    """Model-predictive control of the position; see the module.

    Attributes
    ----------
    deadline_s
        What takes longer is late.  That is seen only once the solver has ended, which nothing cuts
        short: the command is then that of the last plan, but comes as late.  No limit by default,
        so that a run does not depend on the speed of the machine.
    clock
        Seconds, from any moment on.
    places_m
        From where to where the position may go.
    """

    task: Positioning
    programs: Schedule[Program]
    sample_time_s: float
    force_n_m_s: float
    preview: int
    places_m: tuple[float, float]
    deadline_s: float = inf
    clock: Callable[[], float] = perf_counter

    @property
    def laws(self) -> Schedule[Law]:
        """What it does while the slide moves and no limit is met: the first move of each plan."""
        numbers = self.force_n_m_s, self.task.area_m2, self.sample_time_s
        return self.programs.mapped(lambda program: program.law(*numbers))

    def start(self) -> Command:
        return Command(self.task.valve.shut, Memory())

    @waiting
    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        begun, memory, valve = self.clock(), last.memory, self.task.valve
        x = estimate.pick(STATES)
        lowest_m, highest_m = self.places_m
        reference = np.minimum(np.maximum(reference, lowest_m), highest_m)
        now = self.task.task(memory, reference, x, self.sample_time_s)
        if now.rests:
            shut = valve.sent(0.0, estimate)
            return Command(shut, Memory(memory.integral_m_s, True), {"resting": 1.0})
        integral = memory.integral_m_s + self.sample_time_s * now.rate_m
        plan, notes = self._solved(now, reference, memory, integral)
        late = self.clock() - begun > self.deadline_s
        if late:
            steady = steady_plan(len(plan.openings), now.opening_v, now.x[0])
            plan, notes = (memory.plan or steady).shifted(), {"fallback": 1.0}
        smallest_v, largest_v = valve.openings_v
        opening = min(max(float(plan.openings[0]), smallest_v), largest_v)
        room_v = min(opening - smallest_v, largest_v - opening)
        if room_v < AT_END_V or plan.against(-now.rate_m):
            integral = memory.integral_m_s
        notes = {"resting": 0.0, "opening_v": opening, "integral_m_s": integral, **notes}
        notes["late"] = float(late)
        return Command(valve.sent(opening, estimate), Memory(integral, False, plan), notes)

    def _solved(
        self, now: Task, reference: np.ndarray, memory: Memory, integral: float
    ) -> tuple[Plan, dict[str, float]]:
        """The new plan; the last one, shifted, where the solver has no answer."""
        before, friction_n = memory.plan, self.force_n_m_s * integral
        place_m = before.place_m if before else now.x[0]
        program = self.programs.heaviest(place_m, now.ahead)
        asked = Asked(
            now.x,
            friction_n - now.rise_n,
            self._places(now, reference, program.horizon),
            now.target[1:] + friction_n / self.task.area_m2 * BALANCING[1:],
            now.opening_v,
            before.openings[0] if before else now.opening_v,
        )
        return self._best(program, asked, now, before)

    def _best(
        self, program: Program, asked: Asked, now: Task, before: Plan | None
    ) -> tuple[Plan, dict[str, float]]:
        """The plan that is best on the mode of the program."""
        n = program.horizon
        at = program.without_limits(asked)
        if program.limits.kept(at):
            return Plan(at[:n], float(at[n + middle_of(n)])), dict(NO_LIMIT)
        unforced = program.unforced(asked.x, asked.force_n)
        g = program.gradient(unforced, asked.targets, asked.steady_v, asked.last_v)
        return plan_at_limits(program, g, unforced, asked, before)

    def _places(self, now: Task, reference: np.ndarray, n: int) -> np.ndarray:
        """The coming reference as far off as the approach allows, shape (n,)."""
        if not now.speed_m_s:
            return np.full(n, now.target[0])
        limit = self.task.spec.approach_m
        coming = np.maximum(reference[0, 1 : n + 1], now.x[0] - limit)
        return np.minimum(coming, now.x[0] + limit)


def middle_of(horizon: int) -> int:
    """Where the place half-way stands among stacked states."""
    return len(STATES) * (horizon // 2)


def plan_at_limits(
    program: Program, g: np.ndarray, unforced: np.ndarray, asked: Asked, before: Plan | None
) -> tuple[Plan, dict[str, float]]:
    """The best plan where the one without limits breaks some, and what is noted of it."""
    sides = program.limits.bounds(unforced, asked.last_v)
    plan, notes = limited_plan(program, g, *sides, before, asked.steady_v)
    return replace(plan, place_m=half_way_m(program, unforced, plan.openings)), notes


def half_way_m(program: Program, unforced: np.ndarray, openings: np.ndarray) -> float:
    """The place half-way under openings (N,)."""
    middle = middle_of(program.horizon)
    return float(unforced[middle] + program.forced[middle] @ openings)


def limited_plan(
    program: Program,
    g: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    before: Plan | None,
    steady_v: float,
) -> tuple[Plan, dict[str, float]]:
    """The best plan, started from the last one; without an answer the last one, shifted."""
    n = program.horizon
    found = program.solved(g, low, high, before.start if before else None)
    if found:
        plan = Plan(found.z[:n], start=Start(found.z, found.multipliers))
        return plan, {"fallback": 0.0, "iterations": float(found.iterations)}
    return (before or steady_plan(n, steady_v)).shifted(), {"fallback": 1.0}


def steady_plan(horizon: int, steady_v: float, place_m: float = nan) -> Plan:
    """One opening all along."""
    return Plan(np.full(horizon, steady_v), place_m)


def linear_mpc(
    hybrid: HybridModel,
    spec: MpcSpec | None = None,
    solver: Solver | None = None,
    method: str = "mpc",
) -> LinearMpc:
    """One program on every mode in which the valve drives the motion; DAQP is the usual solver.

    ``method`` is the controller that limits without room are told of.
    """
    spec = spec or MpcSpec()
    task = positioning(hybrid, spec.positioning)
    centre_v = closed_command(hybrid.plant)
    limits = state_limits(hybrid.plant, spec, method)
    sizes = centre_v, task.area_m2, limits, task.valve.openings_v
    by = solver or Daqp()
    programs = scheduled(
        hybrid, lambda mode: replace(program_of(mode, spec, *sizes), solver=by).prepared()
    )
    return LinearMpc(
        task=task,
        programs=programs,
        sample_time_s=spec.sample_time_s,
        force_n_m_s=spec.force_n_m_s,
        preview=max(spec.horizon + 1, PREVIEW),
        places_m=tuple(limits[:, 0]),
    )
