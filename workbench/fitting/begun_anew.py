"""A way out of wrong valleys: what a fit has moved implausibly far begins again at its prior.

Where a part switches or hits, a fit may come to a place in which one part imitates what happens by
values that nobody would give it, a valve's spring four prior deviations too soft and its damping
six too low, while all else is found.  Errors then stay above the noise, and no way leads down:
those values hold each other.  So they alone begin again at their priors, together, with start
states as they are guessed; the others, which the recording told of, stay where they were.  The fit
from there, weighed by its own errors, is kept where it is the better one, and so on while one is.

:mod:`workbench.fitting.pulled_in` takes all nuisances back instead, for an added effect that they
imitate; here nothing was added, and most of them are right.
"""

from __future__ import annotations

import numpy as np

from workbench.fitting.continued import continued
from workbench.fitting.errors import only_noise
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.own_errors import ITERATIONS, better_of, by_own_errors
from workbench.fitting.problem import fitted_twice

IMPLAUSIBLE = 2.5  # prior deviations: one of eighty right values is further off
ROUNDS = 3


def begun_anew(fit: Fit) -> Fit:
    """The same fit, or a better one from where nothing is far from its prior.

    Nothing is tried where only noise is left, or nothing is that far.
    """
    unknowns = fit.unknowns
    for _ in range(ROUNDS):
        far = (np.abs(fit.point.t) > IMPLAUSIBLE) & unknowns.with_prior
        if only_noise(fit) or not far.any():
            break
        tried = fitted_twice(fit.windows, unknowns, np.where(far, 0.0, fit.point.t))
        before, fit = fit, better_of(fit, by_own_errors(continued(tried, ITERATIONS)))
        if fit is before:
            break
    return fit
