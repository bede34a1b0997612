"""What is left of a signal: its spectrum, and whether it is white.

The innovations of a one-step filter are white where plant and noise are right, its process noise
too.  Then their autocorrelation stays within +-1.96/sqrt(n) in 95 % of all lags, n the pairs of
samples so far apart, and their spectrum is flat, at 2 sigma^2 dt for one side.  Holes cost pairs,
at long lags more than at short ones, so that each lag is a mean over its own.

Source: Ljung, System Identification, 2nd ed., 16.6 (residual analysis); Welch 1967 (spectrum).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import floor

import numpy as np

from workbench.fitting.holes import usual_gap
from workbench.recording import Recording

LONGEST_LAG_S = 0.1
LAGS = 50, 200  # fewest and most
LONGEST_SEGMENT = 2048
SEGMENTS = 8  # at least so many, half over each other
NORMAL_95 = 1.96


@dataclass(frozen=True)
class Residual:
    """One output's one-step error, or plain error of a plant without states.

    Attributes
    ----------
    frequency_hz, density
        One-sided spectral density in the square of the output's SI unit per hertz, (n_f,).
    lag_s, correlation
        Autocorrelation from lag 0 on, (n_lags,).
    bands
        Half width at each lag that 95 % of those of white noise keep, (n_lags,).
    floor
        Density of the noise alone.
    """

    frequency_hz: np.ndarray
    density: np.ndarray
    lag_s: np.ndarray
    correlation: np.ndarray
    bands: np.ndarray
    floor: float

    @property
    def outside(self) -> float:
        """Share of the lags outside the band; 0.05 is chance.  NaN where nothing is known."""
        beyond = np.abs(self.correlation[1:]) > self.bands[1:]
        return float(np.mean(beyond)) if len(beyond) else float("nan")


def residual_of(recording: Recording, error: np.ndarray, noise: float) -> Residual:
    """Spectrum and autocorrelation of an error (n,), NaN where there is none.

    Of a sensor slower than the clock of its recording by its own samples.
    """
    step = _step(error)
    dt = step * recording.sample_time_s
    stretches = [*_stretches(recording, error, step)]
    frequency_hz, density = spectrum(stretches, dt)
    correlation, pairs = autocorrelation(stretches, _lags(dt, stretches))
    return Residual(
        frequency_hz=frequency_hz,
        density=density,
        lag_s=dt * np.arange(len(correlation)),
        correlation=correlation,
        bands=NORMAL_95 / np.sqrt(pairs),
        floor=2.0 * noise**2 * dt,
    )


def spectrum(stretches: list[np.ndarray], sample_time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and one-sided density by Welch's method over all stretches, (n_f,) each.

    Stretches shorter than a segment are left out.
    """
    from scipy.signal import welch

    longest = max(map(len, stretches), default=0)
    segment = min(LONGEST_SEGMENT, 2 * longest // SEGMENTS)
    if segment < SEGMENTS:
        return np.zeros(0), np.zeros(0)
    used = [each for each in stretches if len(each) >= segment]
    found = [welch(each, 1.0 / sample_time_s, nperseg=segment) for each in used]
    weights = [len(each) for each in used]
    return found[0][0], np.average([density for _, density in found], axis=0, weights=weights)


def autocorrelation(stretches: list[np.ndarray], lags: int) -> tuple[np.ndarray, np.ndarray]:
    """Correlation of values so many samples apart, and how many pairs there are, (lags + 1,) each.

    Only pairs within one stretch count, and each lag is a mean over its own; both are empty where
    nothing varies.  No lag may be longer than every stretch.
    """
    mean = sum(float(each.sum()) for each in stretches) / max(sum(map(len, stretches)), 1)
    sums, pairs = np.zeros((2, lags + 1))
    for each in (stretch - mean for stretch in stretches):
        most = min(lags + 1, len(each))
        sums[:most] += [float(each[: len(each) - k] @ each[k:]) for k in range(most)]
        pairs[:most] += len(each) - np.arange(most)
    if sums[0] <= 0.0:
        return np.zeros(0), np.zeros(0)
    return sums / pairs * (pairs[0] / sums[0]), pairs


def _lags(sample_time_s: float, stretches: list[np.ndarray]) -> int:
    wanted = min(max(round(LONGEST_LAG_S / sample_time_s), LAGS[0]), LAGS[1])
    return min(wanted, max(map(len, stretches), default=1) - 1)


def _step(error: np.ndarray) -> float:
    """How many samples of the clock lie between two that are there: 1 but for a slow sensor.

    One that fits the clock a whole number of times no better comes a sample early or late.
    """
    there = np.isfinite(error)
    apart, usual = np.diff(np.flatnonzero(there)), usual_gap(there)
    return float(np.mean(apart[np.abs(apart - usual) <= 1.0])) if usual > 1.0 else 1.0


def _stretches(recording: Recording, error: np.ndarray, step: float) -> Iterator[np.ndarray]:
    """The errors that are there, between holes and ends of pieces."""
    most = floor(step) + 1 if step > 1.0 else 1
    for first, piece in zip(recording.starts, recording.pieces, strict=True):
        inside = error[first : first + len(piece)]
        there = np.flatnonzero(np.isfinite(inside))
        edges = np.flatnonzero(np.diff(there) > most) + 1
        yield from (part for part in np.split(inside[there], edges) if len(part))
