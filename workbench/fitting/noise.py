"""Sensor noise from the recording itself: from its quiet parts, not from the residual of a fit."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from workbench.quiet_blocks import block_deviations
from workbench.recording import Recording
from workbench.saturation import saturated

QUIET_SHARE = 0.3  # this share of the blocks is taken for still
ALIKE = 1.7  # times their level: three deviations of one block above what all have
THIRD_DIFFERENCE_GAIN = 20.0  # variance of y3 - 3 y2 + 3 y1 - y0 over that of y


class NoNoiseError(ValueError):
    """A channel shows no noise, and no step that could stand for it."""


def measured_noise(recordings: Iterable[Recording], channels: Iterable[str]) -> dict[str, float]:
    """Standard deviation of the noise of each channel.

    Each recording is cut into blocks.  The quietest third gives a level, and all blocks that are
    alike within the chance of one block give the noise: the quietest alone would make it a tenth
    too small.  Samples at the end of a sensor's range have no noise, and are left out.  A value
    given with the recording (``Recording.noise``) comes first.  The floor is the quantisation, one
    step over sqrt(12).

    Raises
    ------
    NoNoiseError
        If a channel has no noise at all and no step that could stand for it.
    """
    recordings = tuple(recordings)
    return {name: _noise_of(recordings, name) for name in channels}


def _noise_of(recordings: tuple[Recording, ...], channel: str) -> float:
    given = [r.noise[channel] for r in recordings if channel in r.noise]
    if given:
        return float(max(given))
    spread = np.concatenate([_block_deviations(channel, r[channel]) for r in recordings])
    quiet = _level(spread) if len(spread) else 0.0
    values = np.concatenate([r[channel] for r in recordings])
    noise = max(quiet, _step(values) / np.sqrt(12.0))
    if noise > 0:
        return noise
    raise NoNoiseError(
        f"{channel}: the recording shows no noise; give it as noise = ... in the rig"
    )


def _block_deviations(channel: str, values: np.ndarray) -> np.ndarray:
    """Noise of each block from third differences, which no parabola enters, shape (n_blocks,).

    No difference reaches over a saturated sample: its neighbours are far apart.
    """
    kept = np.where(saturated(channel, values), np.nan, values)
    return block_deviations(kept[np.isfinite(values)], 3)


def _level(spread: np.ndarray) -> float:
    """Root mean square of the blocks that are as quiet as the quietest third."""
    alike = spread[spread <= ALIKE * np.quantile(spread, QUIET_SHARE)]
    return float(np.sqrt(np.mean(alike**2)))


def _step(values: np.ndarray) -> float:
    """Smallest difference between two recorded values: the quantisation, 0 where none shows."""
    levels = np.unique(values[np.isfinite(values)])
    gaps = np.diff(levels)
    span = levels[-1] - levels[0] if len(levels) > 1 else 0.0
    gaps = gaps[gaps > 1e-9 * max(span, 1e-300)]
    return float(gaps.min()) if len(gaps) else 0.0
