"""How well a rival explains both recordings with little help of the nuisances: the order of ties.

Rivals that cannot be told apart differ by how the nominal parameters bend for them, and these bend
too easily.  A likelihood counts every effective sample as evidence of its own; but what a model has
otherwise than the plant, a dozen small things, is the same in all windows and averages out in none.
A fit therefore believes its windows more than they deserve, goes where a few of them have the last
word, and may predict what it never saw worse than one that stayed near the priors.  Its minimum is
the lowest of several valleys, and which one that is hangs on next to nothing.

So each rival is fitted once more with its likelihood to the power 1/400, which is to say with
deviations of priors a twentieth as wide, by way of a quarter.  What counts is

    min over p, X0 of  chi2 + 400 |(p - p0) / s_p|^2 + |(x0 - guess) / s_x|^2   in training,

with p the nuisances, and the squared error on what is held out with them, no window counted too
much.  The deviations s_p are those of the rig, in the median no wider than the catalogue's: which
of two rivals a plant has does not hang on how unsure a user is of all parameters alike, and priors
of 15 % in place of 5 % would let them bend three times as far.  What has no prior, as the size of
the rival itself, stays free, and what is tolerated in every fit, as a few milliseconds of delay,
keeps the width that it is tolerated to.

The power is chosen: of thousands of effective samples as many say something of their own as the
plant has small things of its own.  A tenth of the width orders the ties of study ``hidden-effects``
as well.

Source: Gruenwald and van Ommen 2017, "Inconsistency of Bayesian inference for misspecified linear
models, and a proposal for repairing it"; Miller and Dunson 2019, "Robust Bayesian inference via
coarsening".
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.diagnosis.refit import ITERATIONS, Refit, bounded_error, counted_from
from workbench.fitting.continued import continued
from workbench.fitting.costs import points_costs
from workbench.fitting.gauss_newton import Fit, fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.problem import Problem
from workbench.fitting.pulled_in import towards_priors
from workbench.fitting.unknowns import Unknowns

STAGES = (0.25, 0.05)  # widths of priors, of their own or of what is usual
SHARES = (1.0, 0.3, 0.0)  # of the way that the nuisances have gone, to begin from


def near_priors(problem: Problem, rival: Refit) -> Refit:
    """The same rival, fitted and validated where nuisances hardly move; see the module.

    Each stage begins where the one before ended, or nearer to the priors, as costs less.
    """
    windows, fit = rival.fit.windows, rival.fit
    for nearer in STAGES:
        unknowns = hardly_moving(rival.fit, nearer)
        points = [Point(towards_priors(fit, share), fit.point.starts) for share in SHARES]
        begun = points_costs(windows, unknowns, points).best
        fit = fit_windows(windows, unknowns, begun, ITERATIONS)
    fit = continued(fit, ITERATIONS)
    found = replace(rival, fit=fit, validation=problem.validated(fit))
    return counted_from(problem.base, problem.base_validation, found)


def left_of_both(near: Refit) -> float:
    """Cost in training and squared error held out, no window counted too much there."""
    return near.fit.cost + (bounded_error(near.validation) if near.validation else 0.0)


def hardly_moving(fit: Fit, nearer: float) -> Unknowns:
    """The unknowns of a fit with priors ``nearer`` times as wide; see the module for which."""
    unknowns, candidates = fit.unknowns, fit.windows.plant.candidates.values()
    usual = {each.strength for each in candidates if each.cause.tolerated}
    held = unknowns.with_prior & [name not in usual for name in unknowns.names]
    width = nearer / _wider_than_usual(fit, held)
    precision = np.where(held, unknowns.precision / width**2, unknowns.precision)
    return replace(unknowns, precision=precision)


def _wider_than_usual(fit: Fit, held: np.ndarray) -> float:
    """How many times as wide as the catalogue's the priors in ``held``, (n_p,), are, the median.

    At least 1: what is known better than usual tells nothing of what is not.
    """
    unknowns, known = fit.unknowns, fit.windows.plant.parameters
    priors = zip(unknowns.names, unknowns.prior, strict=True)
    usual = np.array([known[name].standard_deviation(value) for name, value in priors])
    held = held & (usual > 0.0)
    return max(float(np.median(unknowns.scale[held] / usual[held])), 1.0) if held.any() else 1.0
