"""Nonlinear MPC by real-time iteration: one Gauss-Newton program per sample along the last plan.

The problem is that of :mod:`controllers.linear_mpc`, with the reduced plant itself in place of a
mode: at each sample it runs from the estimate under the shifted last plan, and the program of the
sensitivities along that path is solved once.  The terminal cost and the limits are those of the
mode to which the plan leads, and so is the force on the slide that takes out steady errors: what
differs from linear MPC are the flows and volumes alone.

Source: Diehl, Bock and Schloeder 2005, "A real-time iteration scheme for nonlinear optimization in
optimal feedback control", SIAM J. Control Optim. 43(5).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from controllers.condensed import Asked, Program
from controllers.linear_mpc import (
    NO_LIMIT,
    LinearMpc,
    Plan,
    half_way_m,
    linear_mpc,
    plan_at_limits,
)
from controllers.mpc_spec import MpcSpec
from controllers.positioning import STATES, Task
from controllers.rollout import Rollout, sliding_advance
from linearize.modes import HybridModel


@dataclass(frozen=True, kw_only=True)
class NonlinearMpc(LinearMpc):
    """Linear MPC whose program is made anew along the last plan; see the module."""

    rollout: Rollout

    def _best(
        self, program: Program, asked: Asked, now: Task, before: Plan | None
    ) -> tuple[Plan, dict[str, float]]:
        program, unforced = self._predicted(program, asked, now, before)
        g = program.gradient(unforced, asked.targets, asked.steady_v, asked.last_v)
        openings = program.unlimited(g)
        if program.keeps(openings, unforced, asked.last_v):
            return Plan(openings, half_way_m(program, unforced, openings)), dict(NO_LIMIT)
        return plan_at_limits(program, g, unforced, asked, before)

    def _predicted(
        self, program: Program, asked: Asked, now: Task, before: Plan | None
    ) -> tuple[Program, np.ndarray]:
        """The program along the last plan, and its stacked states under zero openings."""
        shifted = before.shifted().openings if before else np.full(program.horizon, now.opening_v)
        openings = np.clip(shifted, *program.limits.openings)
        side = 1.0 if now.ahead >= 0.5 else -1.0  # a share of friction would leave the slide stuck
        return along(program, self.rollout, asked.x, openings, [side, asked.force_n])


def along(
    program: Program, rollout: Rollout, x: np.ndarray, openings: np.ndarray, d: list[float]
) -> tuple[Program, np.ndarray]:
    """The program along the path of these openings (N,), and its states under zero openings."""
    states, forced = rollout(x, openings, np.array(d))
    return replace(program, forced=forced), states - forced @ openings


def nonlinear_mpc(hybrid: HybridModel, spec: MpcSpec | None = None) -> NonlinearMpc:
    """The design on the reduced plant of the hybrid model."""
    spec = spec or MpcSpec()
    linear = linear_mpc(hybrid, spec, method="nonlinear-mpc")
    advance = sliding_advance(hybrid.model, spec.sample_time_s)
    rollout = Rollout(advance, spec.horizon, tuple(map(hybrid.model.states.index, STATES)))
    _ = rollout.ahead  # compiled now, so that the first sample need not wait
    parts = {f.name: getattr(linear, f.name) for f in fields(linear)}
    return NonlinearMpc(**parts, rollout=rollout)
