"""Holes of a channel: how they are bridged, how far off that is, and where nothing is known.

A slow sensor on a fast clock is silent between its samples.  These are no holes: its usual gap is
what a hole is measured by.  Straight lines over them are off where the signal bends,

    c s (h - s) / 2  in value and  c |s - h / 2|  in slope,  s samples into a gap of h samples

with c the second derivative, the larger of those that recorded samples tell at both ends.

Source: the remainder of linear interpolation, for a parabola exact.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from workbench.plant import Plant
from workbench.recording import Recording

SMOOTHING_SAMPLES = 15  # of the parabola through recorded values that gives their slope
LOST = 2  # usual gaps: a hole is longer, so that at least two samples in a row are lost


def usual_gap(recorded: np.ndarray) -> int:
    """Samples from one recorded value of a channel to the next, as most are; 1 without any.

    ``recorded`` is True where there is a value, shape (n,).
    """
    gaps = np.diff(np.flatnonzero(recorded))
    return int(np.quantile(gaps, 0.5, method="lower")) if len(gaps) else 1


def long_holes(plant: Plant, recording: Recording) -> np.ndarray:
    """True inside and next to holes longer than slopes can bridge, in any channel in use, (n,)."""
    inputs = (signal.name for signal in (*plant.commands, *plant.measured_inputs))
    used = [name for name in (*plant.measured, *inputs) if name in recording.channels]
    blind = np.zeros(len(recording), dtype=bool)
    for name in used:
        recorded = np.isfinite(recording[name])
        longest = max(SMOOTHING_SAMPLES, LOST * usual_gap(recorded))
        missing = np.concatenate([[False], ~recorded, [False]])
        edges = np.flatnonzero(np.diff(missing.astype(int)))
        for first, last in edges.reshape(-1, 2):
            if last - first > longest:
                blind[max(first - SMOOTHING_SAMPLES // 2, 0) : last + SMOOTHING_SAMPLES // 2] = True
    return blind


def bridged(values: np.ndarray, starts: tuple[int, ...]) -> np.ndarray:
    """A channel with straight lines over its holes, piece by piece; the ends are held, (n,)."""
    found = values.copy()
    for first, last in pairwise((*starts, len(values))):
        piece, seen = values[first:last], np.isfinite(values[first:last])
        if seen.any() and not seen.all():
            samples = np.arange(len(piece))
            found[first:last] = np.interp(samples, samples[seen], piece[seen])
    return found


def bridging_errors(values: np.ndarray, starts: tuple[int, ...]) -> np.ndarray:
    """How far off these lines and their slopes may be, the latter per sample, (2, n).

    Zero where nothing is bridged; of slopes also in gaps that a moving parabola can bridge.
    """
    found = np.zeros((2, len(values)))
    for first, last in pairwise((*starts, len(values))):
        piece = values[first:last]
        if 2 < np.isfinite(piece).sum() < len(piece):
            found[:, first:last] = _errors_of(piece)
    return found


def _errors_of(piece: np.ndarray) -> np.ndarray:
    """The same of one piece with three recorded values or more; held ends go on with the slope."""
    seen, samples = np.flatnonzero(np.isfinite(piece)), np.arange(len(piece))
    h = np.diff(seen)
    slopes = np.diff(piece[seen]) / h
    bends = np.abs(np.diff(slopes)) / (0.5 * (h[1:] + h[:-1]))
    bends = np.maximum(np.append(bends[0], bends), np.append(bends, bends[-1]))
    gap = np.clip(np.searchsorted(seen, samples, "right") - 1, 0, len(h) - 1)
    s, h, bend = samples - seen[gap], h[gap], bends[gap]
    beyond = np.maximum(np.maximum(-s, s - h), 0)
    value = bend * np.abs(s * (h - s)) / 2.0 + np.abs(slopes[gap]) * beyond
    slope = np.where(h > SMOOTHING_SAMPLES, bend * np.abs(s - h / 2.0), 0.0)
    return np.stack([value, slope])
