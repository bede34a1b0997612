"""Where openings ahead lead a nonlinear model, and how that depends on each of them.

The states along a plan and their sensitivities are one function in machine code: with
F_i = dx_i+1/dx_i and G_i = dx_i+1/du_i along the way,

    S_0 = 0,    S_i+1 = F_i S_i + G_i e_i'

where column j of S is the dependence on the opening j.  So the stages are condensed on the way,
and no equality is left to the quadratic program.

Source: Bock and Plitt 1984, "A multiple shooting algorithm for direct solution of optimal control
problems", for the condensing; here it is single shooting, from the estimate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from controllers.axis import axis_of
from linearize.reduction import DesignModel, closed_command, design_model
from workbench.called import prepared
from workbench.compiled import compiled
from workbench.effect import Conditions
from workbench.effects.stribeck_friction import StribeckFriction
from workbench.parts import Chamber
from workbench.plant import Plant
from workbench.rosenbrock import single_step, steps_of

COARSEST_S = 2e-3  # the step of the integrator: the 4-state model has nothing faster


@dataclass(frozen=True)
class Rollout:
    """A model over a horizon, openings held over the samples.

    Attributes
    ----------
    advance
        (x, u, d) -> x one sample later, d held over the horizon.
    horizon
        Samples ahead.
    read
        Places of the states that are told.
    """

    advance: ca.Function
    horizon: int
    read: tuple[int, ...]

    def __call__(
        self, x: np.ndarray, openings: np.ndarray, d: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Stacked states (n_r N,) under openings (N,), and their sensitivities (n_r N, N)."""
        (told,) = self.ahead(*map(np.ascontiguousarray, (x, openings, d)))
        N, n = self.horizon, len(self.read)
        by_sample = told.reshape(N, 1 + N, n)
        slopes = by_sample[:, 1:].transpose(0, 2, 1).reshape(n * N, N)
        return by_sample[:, 0].ravel(), slopes

    def __getstate__(self) -> dict[str, Any]:
        """All but the call in machine code, which another process makes again."""
        return {key: value for key, value in self.__dict__.items() if key != "ahead"}

    @cached_property
    def ahead(self) -> Callable[..., list[np.ndarray]]:
        """(x, openings, d) -> state and sensitivities [x S] of all samples, (n_r, (1 + N) N)."""
        n, N = self.advance.numel_out(0), self.horizon
        x, u, d = (ca.MX.sym(k, self.advance.numel_in(i)) for i, k in enumerate("xud"))
        both, chosen = ca.MX.sym("both", n, 1 + N), ca.MX.sym("chosen", N)
        x_next, F, G = self.tangent(both[:, 0], u, d)
        later = ca.horzcat(x_next, F @ both[:, 1:] + G @ chosen.T)
        once = ca.Function("once", [both, u, chosen, d], [ca.densify(later)])
        begun, openings = ca.horzcat(x, ca.MX.zeros(n, N)), ca.MX.sym("openings", N)
        way = once.mapaccum(N)(begun, openings.T, ca.DM.eye(N), ca.repmat(d, 1, N))
        run = ca.Function("rollout", [x, openings, d], [way[self.read, :]])
        return prepared(compiled(run))

    @cached_property
    def tangent(self) -> ca.Function:
        """(x, u, d) -> (x, F, G) one sample later; what they have in common is worked out once."""
        x, u, d = (ca.SX.sym(k, self.advance.numel_in(i)) for i, k in enumerate("xud"))
        later = self.advance(x, u, d)
        slopes = [ca.densify(ca.jacobian(later, s)) for s in (x, u)]
        return ca.Function("tangent", [x, u, d], ca.cse([later, *slopes]))


def advance_of(
    x: ca.SX, u: ca.SX, d: ca.SX, rates: ca.SX, sample_time_s: float, coarsest_s: float
) -> ca.Function:
    """(x, u, d) -> x one sample later, by steps of equal length of the plant's integrator."""
    steps = steps_of(sample_time_s, coarsest_s)
    once = single_step((x, u, d, ca.SX(0, 1)), rates)
    now = x
    for _ in range(steps):
        now = once(now, u, d, ca.SX(0, 1), sample_time_s / steps)[0]
    return ca.Function("advance", [x, u, d], [now])


def sliding_advance(model: DesignModel, sample_time_s: float) -> ca.Function:
    """(x, opening, d) -> x one sample later on a design model with one axis; d is (s, force in N).

    Dry friction acts against the direction s, 1 or -1, in which the axis is to move: so the
    prediction has slopes where the plant has a kink, as the modes have.  What friction rises by
    near standstill is left to the force.
    """
    rubbing = [e for e in model.plant.effects if isinstance(e, StribeckFriction)]
    smooth = design_model(model.plant.without(*(e.name for e in rubbing)))
    axis, now = axis_of(model.plant), smooth.plant.model.conditions
    x, command = smooth.symbols
    opening, direction, force_n = ca.SX.sym("opening"), ca.SX.sym("s"), ca.SX.sym("force")
    against_n = [
        e.viscous_force_n(e.sliding_velocity_m_s(now)) + direction * fast_dry_n(e, now)
        for e in rubbing
    ]
    (rubbed_n,) = smooth.reduced([ca.SX(sum(against_n))])
    rates = ca.SX(smooth.expressions[0])
    v, pressure = (smooth.states.index(name) for name in (axis.velocity, axis.pressures[0]))
    per_n = ca.jacobian(rates[v], x[pressure]) / area_m2(model.plant)
    rates[v] += per_n * (force_n - rubbed_n)
    rates = ca.substitute(rates, command, opening + closed_command(model.plant))
    d = ca.vertcat(direction, force_n)
    return advance_of(x, opening, d, rates, sample_time_s, COARSEST_S)


def fast_dry_n(friction: StribeckFriction, now: Conditions) -> ca.SX:
    """Dry friction of fast sliding."""
    return replace(friction, stiction_excess_n=0.0).dry_force_n(now)


def area_m2(plant: Plant) -> float:
    """Area on which the first chamber pushes."""
    return next(m.area_m2 for m in plant.parts if isinstance(m, Chamber))
