"""Causes that are only a shift of a fitted parameter: scored with that parameter held.

The prior fit would swallow them.  With V the posterior variance of the scaled parameter at the fit
(prior included) and t its shift in prior deviations, the recording alone would put it at
m = t / (1 - V) with a precision L = 1/V - 1.  The cost L (m - t)^2 + t^2 that it has at the fit is
t^2 / (1 - V), its price included, and freeing it takes all of that away.  It is named only when it
leaves its prior by more than three standard deviations (diagnosis.md 1.4), and judged by a refit in
which its prior is taken away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.result import Size
from workbench.fitting.linearised import normal_equations
from workbench.fitting.problem import Problem

LEAVES_PRIOR = 3.0


@dataclass(frozen=True)
class Shift:
    """How far the recording pulls one parameter, in prior standard deviations.

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


def shifts(problem: Problem) -> list[Shift]:
    """The shift of every cause whose parameter the base fit may move, largest drop first."""
    base = problem.base
    unknowns, t = base.unknowns, base.point.t
    normal = normal_equations(problem.linearised, unknowns)
    variance = np.clip(np.diag(np.linalg.inv(normal.hessian)), 1e-12, 1.0 - 1e-9)
    found = []
    for candidate in problem.whole.candidates.values():
        name = candidate.held if candidate.held in unknowns.names else candidate.strength
        if name not in unknowns.names or candidate in problem.added or candidate.cause.tolerated:
            continue
        k = unknowns.names.index(name)
        if normal.precision[k] == 0.0:  # pinned at a bound: freeing its prior moves nothing
            continue
        alone = t[k] / (1.0 - variance[k])
        gained = t[k] ** 2 / (1.0 - variance[k])
        drop = gained / problem.misfit
        value = float(unknowns.prior[k] + unknowns.scale[k] * alone)
        deviation = float(unknowns.scale[k] * np.sqrt(variance[k] / (1.0 - variance[k])))
        found.append(Shift(candidate, name, Size(value, deviation), float(alone), float(drop)))
    return sorted(found, key=lambda shift: -shift.drop)
