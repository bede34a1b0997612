"""Where a sampled loop crosses the unit circle and the negative real axis.

L(z) = C (z I - A)^-1 B on z = exp(j w T).  A change of sign between two frequencies of a grid tells
that a crossing lies between them, and Brent's method finds it on L itself, not on an interpolation.

Source: K. J. Astrom and B. Wittenmark, "Computer-Controlled Systems", 3rd ed., Ch. 3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class LoopResponse:
    """L at angular frequencies (any shape), from A (n, n), B (n, 1) and C (1, n)."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    sample_time_s: float

    def __call__(self, omega: np.ndarray | float) -> np.ndarray:
        z = np.exp(1j * self.sample_time_s * np.asarray(omega))[..., None, None]
        states = np.linalg.solve(z * np.eye(len(self.A)) - self.A, self.B.astype(complex))
        return (self.C @ states)[..., 0, 0]


def unit_crossings(response: LoopResponse, omega: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Frequencies at which |L| = 1, in rising order; ``values`` are L on the grid, (n,) each."""
    return _roots(lambda w: np.abs(response(w)) - 1.0, omega, np.abs(values) - 1.0)


def negative_crossings(response: LoopResponse, omega: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Frequencies at which L is real and negative, in rising order."""
    real = _roots(lambda w: response(w).imag, omega, values.imag)
    return real[response(real).real < 0.0]


def _roots(
    function: Callable[[float], np.ndarray], omega: np.ndarray, on_grid: np.ndarray
) -> np.ndarray:
    from scipy.optimize import brentq

    before = np.flatnonzero(on_grid[:-1] * on_grid[1:] < 0.0)
    return np.array([brentq(function, omega[k], omega[k + 1], rtol=1e-12) for k in before])
