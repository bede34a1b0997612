"""Noise of blocks of samples, from differences of neighbours, which motion hardly enters.

White noise of variance s^2 gives differences of order k the variance C(2k, k) s^2, and a polynomial
of a degree below k gives none.
"""

from __future__ import annotations

from math import comb

import numpy as np

BLOCK = 40  # samples


def in_blocks(values: np.ndarray) -> np.ndarray:
    """The finite ones of some values (n,), in whole blocks, shape (n_blocks, BLOCK)."""
    finite = values[np.isfinite(values)]
    count = len(finite) // BLOCK
    return finite[: count * BLOCK].reshape(count, BLOCK)


def block_deviations(values: np.ndarray, order: int) -> np.ndarray:
    """Standard deviation of the noise of each block of values (n,), shape (n_blocks,).

    No difference reaches over a value that is missing.
    """
    return deviations(in_blocks(np.diff(values, order)), order)


def deviations(differences: np.ndarray, order: int) -> np.ndarray:
    """Noise behind the differences of one order in each block, (n_blocks, n), shape (n_blocks,)."""
    return np.sqrt(np.mean(differences**2, axis=1) / comb(2 * order, order))
