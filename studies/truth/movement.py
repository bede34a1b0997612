"""Pieces of reference movements at 1 kHz, the same for all plants that move."""

import numpy as np


def time_s(samples: int) -> np.ndarray:
    """Time from 0 at 1 kHz."""
    return np.arange(samples) * 1e-3


def move(start: float, stop: float, samples: int, speed: float) -> np.ndarray:
    """Half-cosine move with the given top speed, then rest."""
    duration = max(np.pi / 2 * abs(stop - start) / speed, 0.05)
    phase = np.minimum(time_s(samples) / duration, 1.0)
    return start + (stop - start) * 0.5 * (1 - np.cos(np.pi * phase))
