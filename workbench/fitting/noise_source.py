"""How the noise of each output is known, in words where a recording does not show it.

The noise itself is that of :mod:`workbench.fitting.noise`: third differences in the quietest third
of the recording.  It stands for sensor noise where the output is still, and nearly so where it
moves slowly against its sampling; then differences of every order tell the same noise.  Where it is
never still and higher differences tell another noise, motion and noise cannot be told apart.

A block is still if its values spread no wider than the noise of its differences allows.  Where the
resolution is coarser than the noise, a still output hardly changes at all.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from workbench.fitting.noise import NoNoiseError, measured_noise
from workbench.quiet_blocks import BLOCK, deviations, in_blocks
from workbench.recording import Recording
from workbench.saturation import saturated
from workbench.units import public_name

STILL_SPREAD = 2.0  # spread of a still block, in noise deviations
STILL_SHARE = 0.02  # of the blocks: fewer still ones are chance
SAME_NOISE = 1.3  # ratio of two estimates from which on they disagree
FEWEST = BLOCK + 3  # samples for one block of third differences
ASSUMED_SHARE = 1e-3  # of the range, where nothing shows
SMALLEST = 1e-12  # in SI: divides nothing where nothing is recorded


class NoiseSource(Enum):
    """Where the noise of an output is known from."""

    GIVEN = "given with the recording"
    STILL = "still pieces"
    MOVING = "differences while it moves"
    UNCLEAR = "not told from motion"
    SHORT = "the smallest step between two samples"
    ASSUMED = "a thousandth of the range"
    NONE = "nothing recorded"


@dataclass(frozen=True)
class Noise:
    """Standard deviation of the noise of one output, and where it is known from."""

    name: str
    value: float
    source: NoiseSource

    @property
    def sentence(self) -> str:
        """What a reader must know of it; empty where there is nothing to say."""
        output = public_name(self.name)
        return {
            NoiseSource.MOVING: f"{output} is never still: its noise is from differences of "
            "neighbouring samples while it moves",
            NoiseSource.UNCLEAR: f"the noise of {output} could not be estimated: it is never "
            "still; the true noise is smaller if motion is in its differences, and larger if its "
            "sensor is filtered; if you know it, give noise = ... for the channel in [recording]",
            NoiseSource.SHORT: f"the noise of {output} could not be estimated: it has fewer than "
            f"{FEWEST} samples; the smallest step between two of them is taken, and the true noise "
            "may be far larger",
            NoiseSource.ASSUMED: f"the noise of {output} could not be estimated: the recording "
            "shows none; a thousandth of its range is taken",
        }.get(self.source, "")


def recorded_noise(recording: Recording, outputs: Iterable[str]) -> dict[str, Noise]:
    """The noise of each output, by full name."""
    return {name: _noise_of(recording, name) for name in outputs}


def _noise_of(recording: Recording, name: str) -> Noise:
    try:
        (value,) = measured_noise([recording], [name]).values()
    except NoNoiseError:
        seen = recording[name][np.isfinite(recording[name])]
        value = max(ASSUMED_SHARE * float(np.ptp(seen)) if len(seen) else 0.0, SMALLEST)
        return Noise(name, value, NoiseSource.ASSUMED if len(seen) else NoiseSource.NONE)
    if name in recording.noise:
        return Noise(name, value, NoiseSource.GIVEN)
    return Noise(name, value, _source(recording, name, value))


def _source(recording: Recording, name: str, noise: float) -> NoiseSource:
    if np.isfinite(recording[name]).sum() < FEWEST:
        return NoiseSource.SHORT
    blocks = _blocks(recording, name)
    if not len(blocks):
        return NoiseSource.UNCLEAR
    spread = blocks.std(axis=1)
    if np.mean(spread < STILL_SPREAD * noise) > STILL_SHARE:
        return NoiseSource.STILL
    low, high = (deviations(np.diff(blocks, order, axis=1), order) for order in (3, 6))
    quiet = low <= np.quantile(low, 0.3)
    same = np.median(low[quiet]) < SAME_NOISE * np.median(high[quiet])
    return NoiseSource.MOVING if same else NoiseSource.UNCLEAR


def _blocks(recording: Recording, name: str) -> np.ndarray:
    """Stretches of samples that are there and not saturated, shape (n_blocks, BLOCK).

    In one across a hole an output that moves is less still.
    """
    found = []
    at_ends = saturated(name, recording[name])
    kept = np.where(at_ends, np.nan, recording[name])
    for piece in replace(recording, channels={name: kept}).pieces:
        found.append(in_blocks(piece[name]))
    return np.concatenate(found)
