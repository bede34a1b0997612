"""Sampled modes: exact for a held command, drift included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from linearize.modes import Mode


@dataclass(frozen=True)
class SampledMode:
    """x[k+1] = F x[k] + G u[k] + offset, absolute states and commands in SI units.

    F, G, offset       shapes (n_x, n_x), (n_x, n_u), (n_x,)
    """

    mode: Mode
    sample_time_s: float
    F: np.ndarray
    G: np.ndarray
    offset: np.ndarray


def sampled(mode: Mode, sample_time_s: float) -> SampledMode:
    """The mode at samples, by one exponential of [[A, B, c], [0]] in scaled states.

    Source: Van Loan 1978, "Computing integrals involving the matrix exponential".
    """
    A, B, _ = mode.scaled
    n, m = B.shape
    constant = mode.drift - mode.A @ mode.state - mode.B @ mode.command
    block = np.zeros((n + m + 1, n + m + 1))
    block[:n] = np.column_stack([A, B, constant / mode.scale])
    moved = expm(block * sample_time_s)[:n]
    size = mode.scale[:, None]
    F, G, offset = moved[:, :n] * size / mode.scale, moved[:, n:-1] * size, moved[:, -1]
    return SampledMode(mode, sample_time_s, F, G, offset * mode.scale)
