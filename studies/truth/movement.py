"""Pieces of reference movements at 1 kHz, the same for all plants that move."""

from collections.abc import Sequence

import numpy as np


def time_s(samples: int) -> np.ndarray:
    """Time from 0 at 1 kHz."""
    return np.arange(samples) * 1e-3


def move(start: float, stop: float, samples: int, speed: float) -> np.ndarray:
    """Half-cosine move with the given top speed, then rest."""
    duration = max(np.pi / 2 * abs(stop - start) / speed, 0.05)
    phase = np.minimum(time_s(samples) / duration, 1.0)
    return start + (stop - start) * 0.5 * (1 - np.cos(np.pi * phase))


def between(
    rng: np.random.Generator,
    start: float,
    targets: Sequence[float],
    lengths: Sequence[int],
    speeds: tuple[float, float],
) -> np.ndarray:
    """A short rest, then moves from target to target, each of so many samples with its rest."""
    parts, last = [np.full(100, start)], start
    for target, length in zip(targets, lengths, strict=True):
        parts.append(move(last, target, length, speed=rng.uniform(*speeds)))
        last = parts[-1][-1]
    return np.concatenate(parts)


def multi_tone(
    rng: np.random.Generator,
    start: float,
    middle: float,
    samples: int,
    tones: Sequence[tuple[float, float]],
) -> np.ndarray:
    """Tones of about so many Hz and m/s each, around the middle, faded in from the start."""
    t, n = time_s(samples), len(tones)
    frequencies, speeds = np.array(tones).T
    frequency = frequencies * rng.uniform(0.9, 1.1, n)
    speed = speeds * rng.uniform(0.8, 1.1, n)
    phase = rng.uniform(0, 2 * np.pi, n)
    waves = speed / (2 * np.pi * frequency) * np.sin(2 * np.pi * frequency * t[:, None] + phase)
    fade = move(0.0, 1.0, samples, speed=3.5)
    return start + (middle - start) * fade + fade * waves.sum(axis=1)


def sweep(
    rng: np.random.Generator,
    start: float,
    middle: float,
    samples: int,
    highest_hz: float,
    amplitude_m: float,
) -> np.ndarray:
    """Sine from about 0.4 Hz up with falling amplitude, faded in from the start."""
    t = time_s(samples)
    low, high = 0.4 * rng.uniform(0.9, 1.1), highest_hz * rng.uniform(0.9, 1.1)
    span = t[-1]
    phase = 2 * np.pi * low * span / np.log(high / low) * ((high / low) ** (t / span) - 1)
    falling = amplitude_m * (low / high) ** (0.75 * t / span)
    fade = move(0.0, 1.0, samples, speed=3.0)
    return start + fade * (middle + falling * np.cos(phase) - start)
