"""Fewer points of long rows, so that they are drawn at once, with every peak kept.

A stretch of samples becomes those at which any row is smallest or largest in it.  So all rows keep
the same samples, and what is selected in one picture lights up in all.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

ENDS = np.inf, -np.inf  # in place of NaN, where the smallest and the largest are sought
MOST_POINTS = 1200  # of a picture: two for each of its pixels across


def peaks(rows: np.ndarray, first: int, last: int, most: int = MOST_POINTS) -> np.ndarray:
    """Samples from ``first`` up to, not including, ``last`` that show all peaks of rows (k, n).

    At most ``most`` and the two ends, in order; every sample where there are no more.  NaN is no
    peak.
    """
    first, last = max(first, 0), min(last, rows.shape[1])
    count = last - first
    if count <= most:
        return np.arange(first, max(last, first))
    buckets = max(most // (2 * max(len(rows), 1)), 1)
    width = -(-count // buckets)
    kept = [np.array([first, last - 1])]
    for row in rows[:, first:last]:
        whole = np.isfinite(row).all()
        low, high = (row, row) if whole else (np.where(np.isfinite(row), row, x) for x in ENDS)
        kept += [_in_buckets(low, width, np.argmin) + first]
        kept += [_in_buckets(high, width, np.argmax) + first]
    return np.unique(np.concatenate(kept))


def _in_buckets(row: np.ndarray, width: int, place: Callable[..., np.ndarray]) -> np.ndarray:
    """The place in each bucket of so many samples, the last of which may hold fewer."""
    full = len(row) // width
    found = place(row[: full * width].reshape(full, width), axis=1) + width * np.arange(full)
    rest = row[full * width :]
    return np.append(found, full * width + place(rest, axis=0)) if len(rest) else found
