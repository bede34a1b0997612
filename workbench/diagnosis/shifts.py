"""Causes that are only a shift of a fitted parameter: scored with that parameter held.

The prior fit would swallow them.  With V the posterior variance of the scaled parameter at the fit
(prior included) and t its shift in prior deviations, the recording alone would put it at
m = t / (1 - V) with a precision L = 1/V - 1.  The cost L (m - t)^2 + t^2 that it has at the fit is
t^2 / (1 - V), its price included, and freeing it takes all of that away.  Where only what is
believed of it holds it at t (``Unknowns.reach``) and it would go on to t*, m = t* / (1 - V).  Where
m lies beyond a bound it stops there, at b, and L (m - b)^2 of the cost is left.  It is named only
when it leaves its prior by more than three standard deviations (diagnosis.md 1.4), and judged by a
refit in which its prior is taken away.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.size import Size
from workbench.fitting.linearised import Normal, normal_equations
from workbench.fitting.problem import Problem
from workbench.units import public_name

LEAVES_PRIOR = 3.0


@dataclass(frozen=True)
class Shift:
    """How far the recording pulls one parameter, in prior standard deviations.

    size    where it would end, within its bounds
    drop    share of the misfit that freeing it removes, to first order
    """

    candidate: Candidate
    name: str
    size: Size
    deviations: float
    drop: float

    @property
    def leaves(self) -> bool:
        """True where the parameter leaves its prior."""
        return abs(self.deviations) > LEAVES_PRIOR


def stays(name: str) -> str:
    """Why a shift of a parameter is none, in words."""
    return f"{public_name(name)} stays within {LEAVES_PRIOR:g} deviations of its prior"


def shifts(problem: Problem) -> list[Shift]:
    """The shift of every cause whose parameter the base fit may move, largest drop first."""
    base = problem.base
    unknowns, normal = base.unknowns, normal_equations(problem.linearised, base.unknowns)
    variance = _variance(normal)
    found = []
    for candidate in problem.whole.candidates.values():
        name = candidate.held if candidate.held in unknowns.names else candidate.strength
        if name not in unknowns.names or candidate in problem.added or candidate.cause.tolerated:
            continue
        k = unknowns.names.index(name)
        held = normal.precision[k] == 0.0
        pulled = _beyond(problem, k) if held else (float(base.point.t[k]), float(variance[k]))
        if pulled:
            found.append(_freed(problem, candidate, k, *pulled))
    return sorted(found, key=lambda shift: -shift.drop)


def _beyond(problem: Problem, k: int) -> tuple[float, float] | None:
    """Where what is held would go, and its variance; None at a bound, where nothing moves it."""
    alone = normal_equations(problem.linearised, problem.base.unknowns.trusting(k))
    if alone.precision[k] == 0.0:
        return None
    step = -np.linalg.solve(alone.hessian, alone.gradient)[k]
    return float(problem.base.point.t[k] + step), float(_variance(alone)[k])


def _freed(
    problem: Problem, candidate: Candidate, k: int, optimum: float, variance: float
) -> Shift:
    """What the module's equations say of one parameter."""
    unknowns, t = problem.base.unknowns, problem.base.point.t
    alone = optimum / (1.0 - variance)
    moved, trusting = np.where(np.arange(len(t)) == k, alone, t), unknowns.trusting(k)
    at, end = float(t[k]), float(trusting.clipped(moved)[k])
    gained = (1.0 / variance - 1.0) * (end - at) * (2.0 * alone - end - at) + at**2
    spread = float(unknowns.scale[k] * np.sqrt(variance / (1.0 - variance)))
    name = unknowns.names[k]
    size = Size(trusting.values(moved)[name], spread if end == alone else nan)
    return Shift(candidate, name, size, alone, gained / problem.misfit)


def _variance(normal: Normal) -> np.ndarray:
    """Of the scaled parameters at the fit, their priors included, (n_p,)."""
    return np.clip(np.diag(np.linalg.inv(normal.hessian)), 1e-12, 1.0 - 1e-9)
