"""Clocks that tick evenly, in files that lost some rows.

A step twice as long as usual is a lost row, or a tick of a clock that is slower than its stamps are
fine: stamps in ms of 990 Hz skip one in a hundred.  An even clock takes the steps as they are if it
fits the stamps as well; one or two steps tell no such pattern, and are lost rows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

TELLING = 2  # double steps: more of them may be the pattern of a clock between its stamps
MOST = 0.1  # of the ticks: stamps that lack more of them are not those of this clock
FEWEST = 20  # stamps that tell a line


def ticks(t: np.ndarray, usual: float) -> np.ndarray | None:
    """Ticks of a clock at which stamps, shape (n,), were taken; None where one tick has two."""
    steps = np.round(np.diff(t) / usual).astype(int)
    return np.concatenate([[0], np.cumsum(steps)]) if (steps >= 1).all() else None


def lost_rows(
    time_s: np.ndarray,
    pieces: tuple[slice, ...],
    usual: float,
    rounded: Callable[[np.ndarray, float, np.ndarray], bool],
) -> tuple[list[np.ndarray], float] | None:
    """Ticks of each piece and the time between two, where rows are lost; else None.

    ``rounded`` tells whether stamps at ticks are those of an even clock but for their rounding.
    """
    found = [ticks(time_s[piece], usual) for piece in pieces]
    if any(each is None for each in found):
        return None
    counts = [np.arange(len(each)) for each in found]
    lost = sum(int(each[-1]) + 1 - len(each) for each in found)
    longest = int(np.argmax([len(each) for each in found]))
    if not 0 < lost <= MOST * len(time_s) or len(found[longest]) < FEWEST:
        return None
    slopes = [_slope(time_s[pieces[longest]], each[longest]) for each in (found, counts)]
    stamped = [time_s[piece] for piece in pieces]
    if lost > TELLING and all(
        rounded(t, slopes[1], k) for t, k in zip(stamped, counts, strict=True)
    ):
        return None
    off, plain = (
        max(np.ptp(t - slope * k) for t, k in zip(stamped, each, strict=True))
        for slope, each in zip(slopes, (found, counts), strict=True)
    )
    # Further off than a quarter of a tick, the clock wanders: no stamp tells which tick it is.
    return (found, slopes[0]) if off < min(plain, 0.5 * slopes[0]) else None


def _slope(t: np.ndarray, at: np.ndarray) -> float:
    """Time of one tick: a line is moved less by what is off than its ends are."""
    return float(np.polyfit(at, t - t[0], 1)[0])
