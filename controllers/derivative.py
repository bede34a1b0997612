"""Derivatives of a sampled measurement, as linear filters.

Each gives A, B, C, D of  m[k+1] = A m[k] + B y[k],  slope[k] = C m[k] + D y[k]: the controller runs
these and the margins are taken with them, so both mean the same filter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Filter = tuple[np.ndarray, np.ndarray, np.ndarray, float]


@dataclass(frozen=True)
class LowPassDerivative:
    """The difference over one period behind a first-order lag: s / (T_f s + 1).

    Source: K. J. Astrom and T. Hagglund, "Advanced PID Control", ISA 2006, by backward
    differences.
    """

    time_constant_s: float

    def filter(self, sample_time_s: float) -> Filter:
        """Its memory is the last slope and the last measurement."""
        share = sample_time_s / (sample_time_s + self.time_constant_s)
        per_s = share / sample_time_s
        C = np.array([1.0 - share, -per_s])
        return np.array([C, [0.0, 0.0]]), np.array([per_s, 1.0]), C, per_s


@dataclass(frozen=True)
class SpanDerivative:
    """The difference over several periods, (y[k] - y[k-n]) / (n T).

    Source: paper 001, which takes the derivative over several samples where noise and resolution
    drown that over one; the number of samples is not printed.
    """

    periods: int

    def filter(self, sample_time_s: float) -> Filter:
        """Its memory is the last n measurements, oldest first."""
        n = self.periods
        last, C = np.zeros(n), np.zeros(n)
        last[-1], C[0] = 1.0, -1.0 / (n * sample_time_s)
        return np.eye(n, k=1), last, C, 1.0 / (n * sample_time_s)


Derivative = LowPassDerivative | SpanDerivative


def settled(found: Filter, value: float) -> np.ndarray:
    """The memory of a filter that has always seen this value, shape (n,)."""
    A, B, _, _ = found
    return np.linalg.solve(np.eye(len(A)) - A, B * value)
