"""Velocity from a recorded position by a smoothing differentiator.

Savitzky-Golay: in a window of 11 samples a parabola is laid through the positions by least squares,
and its slope is taken at the middle; at the ends of a piece, the slope of the outermost window's
parabola.  A gap is never differentiated across.

Source: A. Savitzky and M. J. E. Golay, Analytical Chemistry 36 (1964) 1627, first derivative.
"""

from __future__ import annotations

import numpy as np

WINDOW = 11
ORDER = 2


def derivative(
    values: np.ndarray, sample_time_s: float, starts: tuple[int, ...] = (0,)
) -> np.ndarray:
    """Time derivative of a channel, shape (n,), inside each piece that begins at ``starts``.

    A piece shorter than the window gets one parabola (or line) through all its samples.
    """
    ends = (*starts[1:], len(values))
    pieces = (_piece(values[a:b]) for a, b in zip(starts, ends, strict=True))
    return np.concatenate([*pieces]) / sample_time_s


def _piece(values: np.ndarray) -> np.ndarray:
    n, half = len(values), WINDOW // 2
    if n < WINDOW:
        return _slopes(values, np.arange(n))
    offsets = np.arange(-half, half + 1)
    middle = np.convolve(values, -offsets / np.sum(offsets**2), mode="valid")
    first = _slopes(values[:WINDOW], np.arange(half))
    last = _slopes(values[-WINDOW:], np.arange(half + 1, WINDOW))
    return np.concatenate([first, middle, last])


def _slopes(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Slope per sample of the parabola through all values, at these samples."""
    if len(values) < 2:
        return np.zeros(len(at))
    parabola = np.polynomial.Polynomial.fit(
        np.arange(len(values)), values, min(ORDER, len(values) - 1)
    )
    return parabola.deriv()(at)
