"""Outputs whose sensor is at the end of its range: values that are no measurement.

A sensor that would read more than it can gives its last value again and again, to the last bit,
while noise makes every other sample differ from the one before it.  A signal at a natural end may
stand still as well, where the resolution is coarser than the noise: a piston at its stop, a
velocity of zero.  So exactness counts only where the noise of the other samples is wide enough to
move a signal at rest.  A pressure has no natural end that it meets at a slope: one that does is
clipped, without noise too.
"""

from __future__ import annotations

from math import comb

import numpy as np

from workbench.units import suffix

FEWEST = 50  # samples at an end: fewer are chance
LEAST_SHARE = 0.005  # of the samples
IN_ROWS = 0.5  # share of them beside another: a peak of a coarse signal has lone ones
LIVELY = 0.2  # share of unchanged samples below which a channel usually changes
DITHER = 0.5  # of the resolution: noise from which on no signal at rest stays on one value
ORDERS = (3, 6)  # differences that must agree on the noise: motion is in the lower ones alone
BLOCK = 40  # samples
QUIET_SHARE = 0.3  # of the blocks
STEEP = 0.2  # of the usual step between samples: with such a step no pressure comes to rest
COARSE = 2.5  # resolutions: a smaller step is a slow approach


def saturated(name: str, values: np.ndarray) -> np.ndarray:
    """Which samples of an output are at an end of its sensor's range, of type bool, (n,)."""
    none = np.zeros(len(values), bool)
    ends = [values == end(values) for end in (np.nanmin, np.nanmax)] if _moves(values) else []
    piled = [at for at in ends if _piled_up(at) and not _at_rest(name, values[at][0])]
    if not piled:
        return none
    elsewhere = ~np.any(piled, axis=0)
    if not _lively(values, elsewhere):
        return none
    if _dithers(values, elsewhere):
        return ~elsewhere
    clipped = [at for at in piled if suffix(name) == "pa" and _met_at_a_slope(values, at)]
    return np.any(clipped, axis=0) if clipped else none


def _moves(values: np.ndarray) -> bool:
    seen = values[np.isfinite(values)]
    return bool(len(seen) > FEWEST and np.ptp(seen) > 0.0)


def _piled_up(at: np.ndarray) -> bool:
    count = int(at.sum())
    beside = np.concatenate([[False], at[:-1]]) | np.concatenate([at[1:], [False]])
    return count >= max(FEWEST, LEAST_SHARE * len(at)) and (at & beside).sum() >= IN_ROWS * count


def _at_rest(name: str, value: float) -> bool:
    """Whether this is a body at rest, which no sensor needs to be saturated for."""
    return suffix(name) in ("m_s", "rad_s") and value == 0.0


def _lively(values: np.ndarray, elsewhere: np.ndarray) -> bool:
    """Whether the other samples usually differ from the one before them."""
    same = np.diff(values)[elsewhere[1:] & elsewhere[:-1]] == 0.0
    return len(same) >= FEWEST and float(same.mean()) <= LIVELY


def _dithers(values: np.ndarray, elsewhere: np.ndarray) -> bool:
    """Whether the noise of the other samples is wide enough to move a signal at rest."""
    return _noise(np.where(elsewhere, values, np.nan)) > DITHER * _resolution(values)


def _noise(values: np.ndarray) -> float:
    """Noise where a signal is quiet, from differences of every order; the least of them.

    White noise of variance s^2 gives differences of order k the variance C(2k, k) s^2.
    """
    return min(_from_differences(values, order) for order in ORDERS)


def _from_differences(values: np.ndarray, order: int) -> float:
    differences = np.diff(values, order)
    differences = differences[np.isfinite(differences)]
    count = len(differences) // BLOCK
    if not count:
        return 0.0
    blocks = differences[: count * BLOCK].reshape(count, BLOCK)
    spread = np.sqrt(np.mean(blocks**2, axis=1) / comb(2 * order, order))
    return float(np.quantile(spread, QUIET_SHARE))


def _resolution(values: np.ndarray) -> float:
    """The smallest difference between two values."""
    gaps = np.diff(np.unique(values[np.isfinite(values)]))
    gaps = gaps[gaps > 1e-9 * gaps.sum()]
    return float(gaps.min()) if len(gaps) else 0.0


def _met_at_a_slope(values: np.ndarray, at: np.ndarray) -> bool:
    """Whether a signal comes to its end, and leaves it, with the steps of a signal in motion.

    The steps beside those at the edges count: at an edge the end cuts the step short.
    """
    steps = np.abs(np.diff(values))
    edges = at[1:] != at[:-1]
    outside = ~at[1:] & ~at[:-1] & (steps > 0.0)
    beside = np.append(edges[1:], False) | np.append(False, edges[:-1])
    if not (outside & beside).any():
        return False
    least = max(STEEP * float(np.median(steps[outside])), COARSE * _resolution(values))
    return float(np.median(steps[outside & beside])) > least
