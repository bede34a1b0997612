"""Fewer points of long rows, so that a browser draws them at once, with every peak kept.

A stretch of samples becomes those at which any row is smallest or largest in it.  So all rows keep
the same samples, and what is selected in one picture lights up in all.
"""

from __future__ import annotations

import numpy as np

MOST_POINTS = 4000  # of a picture: a canvas draws a dozen of them well within 0.3 s


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
    edges = np.linspace(first, last, buckets + 1).astype(int)[:-1]
    kept = [np.array([first, last - 1])]
    for row in rows[:, first:last]:
        kept += [_extremes(row, edges - first, first, sign) for sign in (1.0, -1.0)]
    return np.unique(np.concatenate(kept))


def _extremes(row: np.ndarray, edges: np.ndarray, first: int, sign: float) -> np.ndarray:
    """The sample of the smallest value of each bucket, of the largest for a negative sign."""
    signed = np.where(np.isfinite(row), sign * row, np.inf)
    least = np.minimum.reduceat(signed, edges)
    widths = np.diff([*edges, len(row)])
    candidates = np.flatnonzero(signed == np.repeat(least, widths))
    buckets = np.searchsorted(edges, candidates, side="right") - 1
    _, once = np.unique(buckets, return_index=True)
    return candidates[once] + first
