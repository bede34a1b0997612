"""Linear MPC: one condensed quadratic program per mode, solved by DAQP from the last plan.

    min   sum_i |x_i - target_i|_Q^2 + |u_i - u_s|_R^2 + |u_i - u_i-1|_S^2 + |x_N - target_N|_P^2
          + rho |slack|^2
    s.t.  x_i+1 = F x_i + G u_i + offset,   u_lower <= u_i <= u_upper,
          lower - slack <= position, pressures <= upper + slack,   slack >= 0

P is the cost-to-go of the LQ design, so that without active limits the first move is that of LQ.
Steady errors are taken out by a disturbance force on the slide, which grows with the integral of
the error: the prediction feels it and the target pressures balance it.  Inputs are limited hard,
states softly, so that the program always has a solution.

Where the unconstrained optimum keeps all limits it is the solution, and DAQP is not asked.  DAQP is
exact and three times faster here than OSQP with polish; ``tests/benchmarks/test_speed_of_mpc.py``
prints both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from controllers.condensed import MpcSpec, Program, limits_of, program_of
from controllers.margins import Law
from controllers.motion import PREVIEW
from controllers.positioning import STATES, Memory, Positioning, Task, positioning
from controllers.scheduled import Schedule, scheduled
from linearize.modes import HybridModel
from linearize.reduction import closed_command
from workbench.contracts import Command, Estimate


@dataclass(frozen=True)
class Plan:
    """The last solution: openings ahead (N,), and the whole primal z."""

    openings: np.ndarray
    primal: np.ndarray


@dataclass(frozen=True)
class LinearMpc:
    """Model-predictive control of the position; see the module."""

    task: Positioning
    programs: Schedule[Program]
    sample_time_s: float
    force_n_m_s: float
    preview: int

    @property
    def laws(self) -> Schedule[Law]:
        """What it does while the slide moves and no limit is met: the first move of each plan."""
        numbers = self.force_n_m_s, self.task.area_m2, self.sample_time_s
        return self.programs.mapped(lambda program: program.law(*numbers))

    def start(self) -> Command:
        return Command(self.task.valve.shut, Memory())

    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        memory, valve = last.memory, self.task.valve
        now = self.task.task(memory, reference, estimate.pick(STATES), self.sample_time_s)
        if now.rests:
            shut = valve.sent(0.0, estimate)
            return Command(shut, Memory(memory.integral_m_s, True), {"resting": 1.0})
        program = self.programs.heaviest(now.x[0], now.ahead)
        integral = memory.integral_m_s + self.sample_time_s * now.rate_m
        plan, notes = self._solved(program, now, reference, memory, integral)
        opening = float(np.clip(plan.openings[0], *valve.openings_v))
        if opening in valve.openings_v:
            integral = memory.integral_m_s
        notes = {"resting": 0.0, "opening_v": opening, "integral_m_s": integral, **notes}
        return Command(valve.sent(opening, estimate), Memory(integral, False, plan), notes)

    def _solved(
        self,
        program: Program,
        now: Task,
        reference: np.ndarray,
        memory: Memory,
        integral: float,
    ) -> tuple[Plan, dict[str, float]]:
        """The new plan; the last one, shifted, where the solver has no answer."""
        n, before = program.horizon, memory.plan
        last_v = before.openings[0] if before else now.opening_v
        friction_n = self.force_n_m_s * integral
        targets = self._targets(now, reference, n, friction_n)
        unforced = program.unforced(now.x, friction_n - now.rise_n)
        g = program.gradient(unforced, targets, now.opening_v, last_v)
        low, high = program.bounds(unforced)
        z = -program.inverse @ g
        at = program.rows @ z
        if (at >= low).all() and (at <= high).all():
            return Plan(z[:n], z), {"fallback": 0.0, "iterations": 0.0}
        return limited_plan(program, g, low, high, before, now.opening_v)

    def _targets(self, now: Task, reference: np.ndarray, n: int, friction_n: float) -> np.ndarray:
        """Stacked targets, shape (4 N,): the coming reference as far off as the approach allows."""
        shift_pa = friction_n / (2.0 * self.task.area_m2)
        coming = reference[0, 1 : n + 1] if now.speed_m_s else np.full(n, reference[0, 0])
        limit = self.task.spec.approach_m
        targets = np.tile(now.target, (n, 1))
        targets[:, 0] = now.x[0] + np.clip(coming - now.x[0], -limit, limit)
        targets[:, 2] -= shift_pa
        targets[:, 3] += shift_pa
        return targets.ravel()


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
    found = program.solved(g, low, high, before.primal if before else None)
    if found:
        z, iterations = found
        return Plan(z[:n], z), {"fallback": 0.0, "iterations": float(iterations)}
    kept = before.openings if before else np.full(n, steady_v)
    shifted = np.append(kept[1:], kept[-1])
    return Plan(shifted, np.append(shifted, np.zeros(len(g) - n))), {"fallback": 1.0}


def linear_mpc(hybrid: HybridModel, spec: MpcSpec | None = None) -> LinearMpc:
    """One program on every mode in which the valve drives the motion."""
    spec = spec or MpcSpec()
    task = positioning(hybrid, spec.positioning)
    centre_v = closed_command(hybrid.plant)
    limits = limits_of(hybrid.plant, spec)
    sizes = centre_v, task.area_m2, limits, task.valve.openings_v
    programs = scheduled(hybrid, lambda mode: program_of(mode, spec, *sizes).prepared())
    return LinearMpc(
        task, programs, spec.sample_time_s, spec.force_n_m_s, max(spec.horizon + 1, PREVIEW)
    )
