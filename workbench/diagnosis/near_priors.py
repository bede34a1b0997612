"""How well a rival explains both recordings with little help of the nuisances: the order of ties.

Rivals that cannot be told apart differ by how the nominal parameters bend for them, and these bend
too easily.  A likelihood counts every effective sample as evidence of its own; but what a model has
otherwise than the plant, a dozen small things, is the same in all windows and averages out in none.
A fit therefore believes its windows more than they deserve, goes where a few of them have the last
word, and predicts what it never saw worse than one that stayed near the priors.  Its minimum is the
lowest of several valleys, and which one that is hangs on next to nothing.

So each rival is fitted once more with its likelihood to the power 1/400, from where its refit
ended: deviations of priors a twentieth as wide say the same.  What counts is

    min over p, X0 of  chi2 + 400 |(p - p0) / s_p|^2 + |(x0 - guess) / s_x|^2   in training,

and the squared error on what is held out with these parameters, no window counted too much.  The
power is chosen: of thousands of effective samples as many say something of their own as the plant
has small things of its own.  A tenth of the width orders the ties of study ``hidden-effects`` as
well; a twentieth orders them the same whether a rig believes its parameters to 5 % or to 15 %.

Source: Gruenwald and van Ommen 2017, "Inconsistency of Bayesian inference for misspecified linear
models, and a proposal for repairing it"; Miller and Dunson 2019, "Robust Bayesian inference via
coarsening".
"""

from __future__ import annotations

from workbench.diagnosis.refit import ITERATIONS, Refit, bounded_squares
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.problem import Problem

NEARER = 0.05  # of the deviations of the priors


def left_near_priors(problem: Problem, rival: Refit) -> float:
    """Cost of a rival in both recordings near the priors; see the module's equation."""
    unknowns = rival.fit.unknowns.loosened(NEARER)
    fit = fit_windows(rival.fit.windows, unknowns, rival.fit.point, ITERATIONS)
    held_out = problem.validated(fit)
    return fit.cost + (float(bounded_squares(held_out).sum()) if held_out else 0.0)
