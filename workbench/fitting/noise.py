"""Sensor noise from the recording itself: from its quiet parts, not from the residual of a fit."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from workbench.recording import Recording

BLOCK = 40  # samples in which a quiet signal is a straight line
QUIET_SHARE = 0.2  # the quietest blocks are taken for still


def measured_noise(recordings: Iterable[Recording], channels: Iterable[str]) -> dict[str, float]:
    """Standard deviation of the noise of each channel.

    Each recording is cut into blocks; a straight line is taken out of each, and the quietest fifth
    gives the noise.  A value given with the recording (``Recording.noise``) comes first.  The floor
    is the quantisation, one step over sqrt(12).

    Raises
    ------
    ValueError
        If a channel has no noise at all and no step that could stand for it.
    """
    recordings = tuple(recordings)
    return {name: _noise_of(recordings, name) for name in channels}


def _noise_of(recordings: tuple[Recording, ...], channel: str) -> float:
    given = [r.noise[channel] for r in recordings if channel in r.noise]
    if given:
        return float(max(given))
    spread = np.concatenate([_block_deviations(r[channel]) for r in recordings])
    quiet = float(np.quantile(spread, QUIET_SHARE)) if len(spread) else 0.0
    values = np.concatenate([r[channel] for r in recordings])
    noise = max(quiet, _step(values) / np.sqrt(12.0))
    if noise > 0:
        return noise
    raise ValueError(f"{channel}: the recording shows no noise; give it as noise = ... in the rig")


def _block_deviations(values: np.ndarray) -> np.ndarray:
    """Standard deviation about a straight line in each block, shape (n_blocks,)."""
    values = values[np.isfinite(values)]
    count = len(values) // BLOCK
    if not count:
        return np.array([])
    blocks = values[: count * BLOCK].reshape(count, BLOCK)
    time = np.linspace(-1.0, 1.0, BLOCK)
    basis = np.stack([np.ones(BLOCK), time])
    line = (blocks @ np.linalg.pinv(basis)) @ basis
    return np.sqrt(np.sum((blocks - line) ** 2, axis=1) / (BLOCK - 2))


def _step(values: np.ndarray) -> float:
    """Smallest difference between two recorded values: the quantisation, 0 where none shows."""
    levels = np.unique(values[np.isfinite(values)])
    gaps = np.diff(levels)
    span = levels[-1] - levels[0] if len(levels) > 1 else 0.0
    gaps = gaps[gaps > 1e-9 * max(span, 1e-300)]
    return float(gaps.min()) if len(gaps) else 0.0
