"""Bounded least squares with standard deviations that count how long errors stay correlated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

DIFFERENCE = 1e-3  # of the scale of an unknown: the integrator chooses its steps by the state
ROOM = 0.1  # of the scale: a start stays that far inside its bounds
MOST_EVALUATIONS = 60
WEIGHINGS = 5  # of priors beside residuals, as large as the last search left them
LOST = 1e-15  # of the largest information, as the pseudo-inverse counts it
SAME_SIZE = 0.1  # of a mean square: closer is the same


@dataclass(frozen=True)
class Unknown:
    """A number to be found.

    ``scale`` is a typical change.  ``prior_deviation`` is that of the start value where something
    is known of it beforehand, infinite where nothing is.
    """

    start: float
    scale: float
    lower: float = -np.inf
    upper: float = np.inf
    prior_deviation: float = np.inf


@dataclass(frozen=True)
class Solution:
    """Values (n,), their covariance (n, n), and the residuals (m,) without those of the priors."""

    values: np.ndarray
    covariance: np.ndarray
    residuals: np.ndarray

    @property
    def deviations(self) -> np.ndarray:
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))


def solve(
    residuals: Callable[[np.ndarray], np.ndarray], unknowns: list[Unknown], noise: float
) -> Solution:
    """Least squares of residuals in one unit, whose smallest standard deviation is ``noise``.

    The covariance is that of the residuals' own size, at least the noise, times the number of
    samples over which they are correlated: 1 000 samples of a slow error are worth a few.  Priors
    are weighed against residuals of that size, so that the search begins again where it turns out
    another one than before.

    Raises
    ------
    ArithmeticError
        If the residuals are not finite at the start, or the search does not come to an end.
    """
    start, scale = (np.array([getattr(u, k) for u in unknowns]) for k in ("start", "scale"))
    lower, upper = (np.array([getattr(u, k) for u in unknowns]) for k in ("lower", "upper"))
    priors = scale / np.array([u.prior_deviation for u in unknowns])
    bounds = (lower - start) / scale, (upper - start) / scale
    # From a bound itself the method creeps: it counts how far away the bound is.
    begun = np.clip(0.0, bounds[0] + ROOM, np.maximum(bounds[1] - ROOM, bounds[0] + ROOM))
    if not np.isfinite(residuals(start + scale * begun)).all():
        raise ArithmeticError("the model is not finite at the rig's own values")
    size = noise**2
    for _ in range(WEIGHINGS):
        weighed_by = size
        t, left, rows = _searched(
            lambda t: residuals(start + scale * t), priors * np.sqrt(size), begun, bounds
        )
        worth = max(len(left) - len(start), 1)
        size = max(float(left @ left) / worth, noise**2) * correlation_samples(left)
        if not priors.any() or abs(size - weighed_by) < SAME_SIZE * weighed_by:
            break
        begun = t
    information = rows.T @ rows / size + np.diag(priors**2)
    covariance = np.linalg.pinv(information) * np.outer(scale, scale)
    unseen = _unseen(information)
    covariance[unseen, unseen] = np.inf
    return Solution(start + scale * t, covariance, left)


def _unseen(information: np.ndarray) -> np.ndarray:
    """Which unknowns no residual depends on, (n,): they are not known at all.

    The pseudo-inverse leaves such directions out, as if they were known exactly.
    """
    sizes, directions = np.linalg.eigh(information)
    lost = directions[:, sizes <= LOST * sizes[-1]]
    return (np.abs(lost) > 1e-3).any(axis=1)


def _searched(
    residuals: Callable[[np.ndarray], np.ndarray],
    priors: np.ndarray,
    begun: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unknowns (n,) in their scale, the residuals (m,) they leave, and their slopes (m, n)."""
    from scipy.optimize import least_squares

    def weighed(t: np.ndarray) -> np.ndarray:
        return np.concatenate([residuals(t), priors * t])

    def slopes(t: np.ndarray) -> np.ndarray:
        """Differences away from the nearer bound, over one step for all."""
        steps = np.where(t + DIFFERENCE > bounds[1], -DIFFERENCE, DIFFERENCE)
        here = weighed(t)
        columns = [
            weighed(t + h * row) - here for h, row in zip(steps, np.eye(len(t)), strict=True)
        ]
        return np.array(columns).T / steps

    found = least_squares(
        weighed,
        begun,
        jac=slopes,
        bounds=bounds,
        max_nfev=MOST_EVALUATIONS,
    )
    if not found.success:
        raise ArithmeticError(f"least squares did not converge in {MOST_EVALUATIONS} evaluations")
    m = len(found.fun) - len(priors)
    return found.x, found.fun[:m], found.jac[:m]


def correlation_samples(residuals: np.ndarray) -> float:
    """Integrated autocorrelation time, up to the first negative correlation; at least 1."""
    n = len(residuals)
    centred = residuals - residuals.mean()
    power = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    correlation = np.fft.irfft(power)[: n // 2]
    if not len(correlation) or correlation[0] <= 0:
        return 1.0
    correlation = correlation / correlation[0]
    negative = np.flatnonzero(correlation < 0)
    end = int(negative[0]) if len(negative) else len(correlation)
    return float(max(1.0, 1.0 + 2.0 * correlation[1:end].sum()))
