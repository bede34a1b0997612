"""A fit weighed by its own errors, and which of two such fits is the better one.

A fit weighs its errors as the one before it left them.  Where that one was rough, or lost impacts,
its weights are those under which a fit that has them is hardly better.  So the fit is followed with
weights from what it leaves itself, and two fits, each with its own weights, are compared by

    2 sum_k n_k log(max(e_k, noise_k)) + price of the priors

with e_k the error of output k over all windows, n_k its samples over the time for which errors are
correlated, and noise_k its noise, or less where the errors of one of the fits are white at a lower
level: twice the negative logarithm of the posterior where the variance of each output's errors is
what it leaves.  A fit that leaves only noise is better than one that does not, whatever its priors
cost: where errors are correlated few samples count, too few to tell what white ones are worth.

Source: the concentrated likelihood, Seber and Wild 1989, "Nonlinear regression", section 2.2.
"""

from __future__ import annotations

import numpy as np

from workbench.fitting.continued import continued
from workbench.fitting.errors import at_noise, only_noise, penalised_rmse, white_level
from workbench.fitting.gauss_newton import Fit, fit_windows
from workbench.fitting.windows import Windows

WEIGHINGS = 2  # the second by what the first leaves
ITERATIONS = 12
STALE = 1.5  # factor of an output's mean square, beyond which the weights are those of another fit
ROUNDS = 4


def weighed_anew(fit: Fit, iterations: int = ITERATIONS) -> Fit:
    """The fit followed further with weights from the errors that it leaves."""
    windows = fit.windows.rescaled(fit.residual)
    return fit_windows(windows, fit.unknowns, fit.point, iterations)


def consistent(fit: Fit) -> Fit:
    """The fit, weighed anew as long as its errors are far from those that its weights tell.

    Nothing is tried where all outputs are at their noise.
    """
    for _ in range(ROUNDS):
        if at_noise(fit) or not _stale(fit):
            break
        before, fit = fit, better_of(fit, weighed_anew(fit))
        if fit is before:
            break
    return fit


def _stale(fit: Fit) -> bool:
    """True where the errors of an output are not those that it is weighed by."""
    told = (fit.residual**2).sum(axis=(1, 2)) / np.maximum(effective_by_output(fit.windows), 1.0)
    return bool(np.any((told > STALE) | (told < 1.0 / STALE)))


def by_own_errors(fit: Fit) -> Fit:
    """The fit weighed anew and from starts that earlier windows give, if that one is better.

    Nothing is tried where only noise is left.
    """
    if only_noise(fit):
        return fit
    tried = fit
    for _ in range(WEIGHINGS):
        tried = continued(weighed_anew(tried), ITERATIONS)
    return better_of(fit, tried)


def better_of(fit: Fit, tried: Fit) -> Fit:
    """Of two fits of the same windows the one with the larger posterior; see the module."""
    if (comes_to_noise := only_noise(tried)) != only_noise(fit):
        return tried if comes_to_noise else fit
    samples = effective_by_output(fit.windows)
    noise = np.fmin(fit.windows.noise, np.fmin(white_level(fit), white_level(tried)))

    def surprise(each: Fit) -> float:
        errors = np.maximum(penalised_rmse(each), noise)
        return float(2.0 * samples @ np.log(errors)) + each.cost - each.chi2

    return tried if surprise(tried) < surprise(fit) else fit


def effective_by_output(windows: Windows) -> np.ndarray:
    """Recorded values of each output over the correlation times of their errors, shape (n_y,)."""
    return ((windows.weight > 0.0).sum(axis=2) / windows.correlation).sum(axis=1)
