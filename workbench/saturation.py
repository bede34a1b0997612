"""Outputs whose sensor is at the end of its range: values that are no measurement.

A sensor that would read more than it can gives its last value again and again, to the last bit,
while noise makes every other sample differ from the one before it.  A signal at a natural end may
stand still as well, where the resolution is coarser than the noise or nothing is noisy: a piston at
its stop, a chamber at its supply.  So exactness counts only where the noise of the other samples is
wide enough to move a signal at rest.
"""

from __future__ import annotations

import numpy as np

from workbench.quiet_blocks import block_deviations, in_blocks
from workbench.units import suffix

FEWEST = 50  # samples at an end: fewer are chance
LEAST_SHARE = 0.005  # of the samples
IN_ROWS = 0.5  # share of them beside another: a peak of a coarse signal has lone ones
LIVELY = 0.2  # share of unchanged samples below which a channel usually changes
DITHER = 0.7  # of the resolution: noise from which on no signal at rest stays on one value
ORDERS = (3, 6)  # of differences, which agree on noise: motion is in the lower ones alone
AGREE = 1.3  # times one another
NOISIEST = 0.03  # of the span: more is motion that is sampled too seldom
FEWEST_BLOCKS, QUIET_SHARE = 10, 0.05  # of fewer none need be quiet; all have the noise
NEAR_END = 200  # values nearest to an end, whose gaps tell the resolution there
FINE_SHARE = 0.1  # of the gaps: the smallest may be the last digit of a small number


def saturated(name: str, values: np.ndarray) -> np.ndarray:
    """Which samples of an output are at an end of its sensor's range, of type bool, (n,).

    Samples are held against the next one there is: on a fast clock a slow sensor misses most.
    """
    found, seen = np.zeros(len(values), bool), np.isfinite(values)
    found[seen] = _saturated(name, values[seen])
    return found


def _saturated(name: str, values: np.ndarray) -> np.ndarray:
    """The same of values without holes."""
    none = np.zeros(len(values), bool)
    ends = [values == end(values) for end in (np.min, np.max)] if _moves(values) else []
    piled = [at for at in ends if _piled_up(at) and not _at_rest(name, values[at][0])]
    if not piled:
        return none
    elsewhere = ~np.any(piled, axis=0)
    noise = _noise(np.where(elsewhere, values, np.nan)) if _lively(values, elsewhere) else 0.0
    at_ends = [at for at in piled if noise > DITHER * _resolution(values, values[at][0])]
    return np.any(at_ends, axis=0) if at_ends else none


def _moves(values: np.ndarray) -> bool:
    return bool(len(values) > FEWEST and np.ptp(values) > 0.0)


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


def _noise(values: np.ndarray) -> float:
    """Noise where a signal is quiet, from differences of several orders; 0 where they disagree."""
    found = [_quiet(block_deviations(values, order)) for order in ORDERS]
    most = min(AGREE * min(found), NOISIEST * float(np.ptp(values[np.isfinite(values)])))
    return min(found) if max(found) < most else 0.0


def _quiet(spread: np.ndarray) -> float:
    """What all blocks have; 0 of so few that none need be quiet."""
    return float(np.quantile(spread, QUIET_SHARE)) if len(spread) >= FEWEST_BLOCKS else 0.0


def _resolution(values: np.ndarray, end: float) -> float:
    """A small gap between two values near an end, anywhere, or where it is quiet: the largest.

    Numbers of so many digits have one that grows with them.
    """
    levels = np.unique(values)
    near = levels[:NEAR_END] if end == levels[0] else levels[-NEAR_END:]
    gaps = [float(np.quantile(np.diff(each), FINE_SHARE)) for each in (near, levels)]
    return max(*gaps, _smallest_step(values))


def _smallest_step(values: np.ndarray) -> float:
    """Of third differences, multiples of the resolution without motion, in a quiet block."""
    steps = np.abs(np.diff(values, 3))
    blocks = in_blocks(steps[steps > 1e-9 * np.ptp(values)])
    return float(np.quantile(blocks.min(axis=1), QUIET_SHARE)) if len(blocks) else 0.0
