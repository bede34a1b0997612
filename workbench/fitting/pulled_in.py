"""A way out of far valleys: a fit begins again with what it has moved far nearer to its priors.

The prior fit of a model that lacks something moves what it may to imitate it, and the fit of the
missing effect begins there.  With the effect in its place there is nothing to imitate any more.
But where the cost is rough, as that of impacts which come at the wrong instant, no way may lead
down from there: the effect gets a part of its size, and the nuisances keep theirs.  So they are
taken back half the way to their priors, or the whole way, with what was added and all start states
left as they are; both places are followed (:mod:`workbench.fitting.halving`), and the lower one
stays where it is lower than the fit.

Source: the starts of diagnosis.md 1.5 are those of the scan, near the base; these are the same two
ends, at the base and at the priors, from which ``studies.hidden_cases`` measures what can be seen.
"""

from __future__ import annotations

import numpy as np

from workbench.fitting.gauss_newton import Fit
from workbench.fitting.halving import lowest_from
from workbench.fitting.linearised import Point

FAR = 1.5  # prior deviations: beyond, a parameter may imitate what is missing
SHARES = (0.5, 0.0)  # of the way that the nuisances have gone


def pulled_in(fit: Fit, iterations: int) -> Fit:
    """The same fit, or a lower one from nearer to the priors, after at most so many iterations.

    Where none has gone further than 1.5 deviations of its prior, none imitates much: the fit stays.
    """
    if not gone_far(fit):
        return fit
    points = [Point(towards_priors(fit, share), fit.point.starts) for share in SHARES]
    best = lowest_from(fit, points, iterations)
    return min(fit, best, key=lambda each: each.cost)


def gone_far(fit: Fit, deviations: float = FAR) -> bool:
    """Whether a fit has taken a parameter further than so many deviations from its prior."""
    return bool(np.any(np.abs(fit.point.t[fit.unknowns.with_prior]) > deviations))


def towards_priors(fit: Fit, share: float) -> np.ndarray:
    """The scaled unknowns of a fit, (n_p,), with so much left of the way from the priors.

    What was added has no prior, and stays.
    """
    t = fit.point.t
    return fit.unknowns.clipped(np.where(fit.unknowns.with_prior, share * t, t))
