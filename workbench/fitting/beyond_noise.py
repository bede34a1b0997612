"""What squared errors hold beyond sensor noise.

Noise is measured in still pieces and known to a few percent of its square only.  A recording may
hold any number of rests, in which every sample of white noise counts, while errors of motion are
correlated and a thousand samples of them are worth a few: of half a minute at rest these few
percent outweigh all that a minute of motion can show.  So an output where it rests, and the same
where it moves, are looked at each alone, and what is within that of its noise, or within its chance

    sum r^2 - F <= d F + 2 sqrt(2 sum w^4),    F = sum w^2,  w = noise / scale,  d = 5 %

holds nothing.  Where nothing is beyond it all of it is what there is, or a share of next to nothing
would speak for an effect.

What a step of a fit brings is measured on the whole cost, which is what it lowers.
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
    if beyond.any():
        return max(float(excess[beyond].sum()) + price, 1.0)
    return max(float(excess.sum()) + price, float(known_to.sum()), 1.0)


def fall_beyond_noise(windows: Windows, before: np.ndarray, after: np.ndarray) -> float:
    """How much squared errors fall where they are beyond noise before, or after.

    What falls below noise falls no further; all falls count where nothing is beyond it before.
    """
    (had, known_to), (left, _) = (_excess(windows, squares) for squares in (before, after))
    if not np.any(had > known_to):
        return float(np.sum(had - left))
    counted = (had > known_to) | (left > known_to)
    return float(np.sum((np.maximum(had, 0.0) - np.maximum(left, 0.0))[counted]))


def whole_beyond_noise(windows: Windows, cost: float) -> float:
    """A whole cost beyond noise, rests and motion together, at least 1."""
    floor = float(np.sum((windows.weight * windows.noise[:, None, None]) ** 2))
    return max(cost - floor, NOISE_KNOWN_TO * floor, 1.0)


def _excess(windows: Windows, squares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(squares beyond noise, what that is known to), of rests and of motion, each (2, n_y)."""
    noise = windows.noise[:, None]
    weights = (windows.weight * noise[:, :, None]) ** 2
    moves = windows.activity > ACTIVE * noise
    there = np.stack([~moves, moves])
    floors, spread = (np.sum(there * np.sum(weights**k, axis=2), axis=2) for k in (1, 2))
    excess = np.sum(there * squares, axis=2) - floors
    return excess, NOISE_KNOWN_TO * floors + BY_CHANCE * np.sqrt(2.0 * spread)
