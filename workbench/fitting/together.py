"""How much less windows say than they hold, where the plant lacks something.

Scales count the errors of an output once in their correlation time.  Where the plant lacks
something the outputs go wrong together, and windows that are alike go wrong alike: they pull the
parameters apart by more than such errors would.  With g_w the gradient of each window's squared
error, H their curvature and Lambda that of the priors, the windows are worth

    k = tr((H + Lambda)^-1 n cov(g_w)) / tr((H + Lambda)^-1 H)

times less than their scales say: one where errors are as these tell them.  Counted in full they
outvote the priors, and parameters go far off to imitate what is missing.

Source: White 1982, "Maximum likelihood estimation of misspecified models"; the ratio of these
traces is that of Takeuchi's penalty to the effective number of parameters; a posterior tempered by
it: Holmes and Walker 2017, "Assigning a value to a power likelihood in a general Bayesian model".
"""

from __future__ import annotations

import numpy as np

from workbench.fitting.gauss_newton import Fit
from workbench.fitting.linearised import Normal, normal_equations, rescaled
from workbench.fitting.windows import Windows


def with_worth(fit: Fit, windows: Windows) -> Windows:
    """The windows of a fit, which weigh its own errors, scaled by what they are worth."""
    return windows.worth(together(normal_of(fit, windows)))


def normal_of(fit: Fit, windows: Windows) -> Normal:
    """The quadratic model of the cost where a fit ended, on windows with other scales."""
    return normal_equations(rescaled(fit.derivatives, fit.windows, windows), fit.unknowns)


def pulls(normal: Normal) -> np.ndarray:
    """Covariance of the gradient of all windows by how the windows differ, (n_p, n_p)."""
    by_window = np.einsum("wrp,wr->wp", normal.derivatives, normal.residual)
    n = len(by_window)
    apart = by_window - by_window.mean(axis=0)
    return n / max(n - 1, 1) * (apart.T @ apart)


def together(normal: Normal) -> float:
    """The factor k of the module, at least one."""
    curvature = np.einsum("wrp,wrq->pq", normal.derivatives, normal.derivatives)
    inverse = np.linalg.inv(normal.hessian)
    told = float(np.trace(inverse @ curvature))
    return max(float(np.trace(inverse @ pulls(normal))) / told, 1.0) if told > 0.0 else 1.0
