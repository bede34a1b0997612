"""What squared errors hold beyond sensor noise.

Noise is measured in still pieces and known to a few percent of its square only.  A recording may
hold any number of rests, in which every sample of white noise counts, while errors of motion are
correlated and a thousand samples of them are worth a few: of half a minute at rest these few
percent outweigh all that a minute of motion can show.  So an output where it rests, and the same
where it moves, are looked at each alone, and what is within that of its noise, or within its chance

    sum r^2 - F <= d F + 2 sqrt(2 sum w^4),    F = sum w^2,  w = noise / scale,  d = 5 %

holds nothing; of more that much is taken off.  Where nothing is beyond it all of it is what there
is, or a share of next to nothing would speak for an effect.
"""

from __future__ import annotations

import numpy as np

from workbench.fitting.error_model import ACTIVE
from workbench.fitting.windows import Windows

NOISE_KNOWN_TO = 0.05  # of its square
BY_CHANCE = 2.0  # deviations of a sum of squares of white noise


def beyond_noise(windows: Windows, squares: np.ndarray, price: float) -> float:
    """The squared error beyond noise, at least 1.

    ``squares`` are sums of squared weighted residuals, (n_y, n_windows), ``price`` that of the
    priors: a fit that reaches the same error with a heat flow five deviations off its prior has
    explained less than one that stays near it.
    """
    excess, known_to = _excess(windows, squares)
    beyond = excess > known_to
    if not beyond.any():
        return max(float(excess.sum()) + price, float(known_to.sum()), 1.0)
    return max(float((excess - known_to)[beyond].sum()) + price, float(known_to[beyond].sum()), 1.0)


def whole_beyond_noise(windows: Windows, cost: float) -> float:
    """The same of a whole cost, rests and motion together: what a linear model works on."""
    floor = float(np.sum((windows.weight * windows.noise[:, None, None]) ** 2))
    return max(cost - floor, NOISE_KNOWN_TO * floor, 1.0)


def fall_beyond_noise(windows: Windows, before: np.ndarray, after: np.ndarray) -> float:
    """How much squared errors fall beyond noise; all of them where none is beyond it before."""
    (had, known_to), (left, _) = (_excess(windows, squares) for squares in (before, after))
    if not np.any(had > known_to):
        return float(np.sum(had - left))
    return float(np.sum(np.maximum(had, known_to) - np.maximum(left, known_to)))


def _excess(windows: Windows, squares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(squares beyond noise, what that is known to), of rests and of motion, each (2, n_y)."""
    noise = windows.noise[:, None]
    weights = (windows.weight * noise[:, :, None]) ** 2
    moves = windows.activity > ACTIVE * noise
    there = np.stack([~moves, moves])
    floors, spread = (np.sum(there * np.sum(weights**k, axis=2), axis=2) for k in (1, 2))
    excess = np.sum(there * squares, axis=2) - floors
    return excess, NOISE_KNOWN_TO * floors + BY_CHANCE * np.sqrt(2.0 * spread)
