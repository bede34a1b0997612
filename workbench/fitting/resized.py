"""A way out of valleys of a size: a fit begins again with what was added smaller, then larger.

Where impacts or switching come at sampled instants the cost of a fit is rough in the size of what
is added: every other parameter has bent to suit the size it stands at, and Gauss-Newton finds no
way to the next.  The posterior deviation tells the width of such a dent and not that of the valley,
so points drawn by it (:mod:`workbench.fitting.shaken`) stay inside.  A fit from a size that is a
fifth off bends the others to that size instead, and the lowest stays; while it leads lower, the
next begin a fifth off that one.

Source: the profile of a cost over one parameter (Raue et al. 2009, "Structural and practical
identifiability analysis of partially observed dynamical models by exploiting the profile
likelihood"), sampled coarsely.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from workbench.fitting.gauss_newton import Fit, worth_it
from workbench.fitting.halving import lowest_from
from workbench.fitting.linearised import Point

FACTORS = (1.0 / 1.2, 1.2)  # twice the tenth to which a size should be known
ROUNDS = 4


def resized(fit: Fit, names: Sequence[str], iterations: int) -> Fit:
    """The same fit, or a lower one from other sizes of the named parameters.

    ``iterations`` bound each round; a parameter that is not fitted, or is zero, is left.
    """
    for _ in range(ROUNDS):
        points = points_of_sizes(fit, names, FACTORS)
        lowest = lowest_from(fit, points, iterations)
        if not worth_it(lowest.cost, fit):
            break
        fit = lowest
    return fit


def points_of_sizes(fit: Fit, names: Iterable[str], factors: Sequence[float]) -> list[Point]:
    """The point of a fit with one named parameter at a time multiplied by each factor.

    Where bounds leave a parameter as it is there is no point.
    """
    unknowns, points = fit.unknowns, []
    for row in (unknowns.names.index(name) for name in names if name in unknowns.names):
        at = unknowns.prior[row] / unknowns.scale[row] + fit.point.t[row]
        for factor in factors:
            t = fit.point.t.copy()
            t[row] += (factor - 1.0) * at
            t = unknowns.clipped(t)
            if t[row] != fit.point.t[row]:
                points.append(replace(fit.point, t=t))
    return points
