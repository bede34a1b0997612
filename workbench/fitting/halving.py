"""Several places followed for some steps, and the lowest of them to its end.

A fit that begins again from other places asks which of them leads lower.  Most of the steps of a
fit are its last, which bring little: so each place is followed for a few, and only the one that
has come lowest goes on.

Source: successive halving, Jamieson and Talwalkar 2016, "Non-stochastic best arm identification and
hyperparameter optimization".
"""

from __future__ import annotations

from collections.abc import Sequence

from workbench.fitting.gauss_newton import Fit, fit_windows
from workbench.fitting.linearised import Point

FOLLOWED = 4  # steps of each place


def lowest_from(fit: Fit, points: Sequence[Point], iterations: int) -> Fit:
    """The fit of the same windows to which the best of the points leads, higher or lower than it.

    At most ``iterations`` lead there; without points it is the fit itself.
    """
    if not points:
        return fit
    first = min(FOLLOWED, iterations)
    tried = (fit_windows(fit.windows, fit.unknowns, point, first) for point in points)
    best = min(tried, key=lambda each: each.cost)
    if best.converged or iterations <= first:
        return best
    left = iterations - first
    return fit_windows(fit.windows, fit.unknowns, best.point, left, best.derivatives)
