"""Errors of a fit in units: what a person reads beside the weighted ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.fitting.gauss_newton import Fit
from workbench.fitting.windows import Windows
from workbench.units import public_name


@dataclass(frozen=True)
class Place:
    """A sample: the name of its recording, and its time from the start of that."""

    recording: str
    time_s: float


@dataclass(frozen=True)
class SignalError:
    """Error of one output: RMSE in SI, fit percent and noise.

    ``left_out`` are the recorded samples that it does not count, because nothing could be simulated
    there or, in a comparison, no window reaches them; ``left_out_from`` is the first that a fit
    could not simulate.
    """

    rmse: float
    fit_percent: float
    noise: float
    left_out: int = 0
    left_out_from: Place | None = None

    @property
    def chi2_per_sample(self) -> float:
        """chi2/n = (RMSE / noise)^2: one where nothing but noise is left."""
        return (self.rmse / self.noise) ** 2


MOST = 0.5  # of the recorded samples of an output
LEAST_SIMULATED = 0.05  # of the recorded samples: starts alone, which are free, tell no error
AT_NOISE = 1.5  # mean square of an output's error over that of its noise
COLOURED = 0.1  # of a mean square, beyond what successive differences tell of it
CHANCE = 5.0  # deviations of that share, 1 / sqrt(n) each, for white noise

Errors = Mapping[str, Mapping[str, SignalError]]


def in_units(fit: Fit) -> np.ndarray:
    """Errors of a fit in SI, (n_y, n_windows, L), zero where nothing is recorded."""
    return fit.residual * fit.windows.scale[:, :, None]


def signal_errors(fit: Fit) -> dict[str, SignalError]:
    """RMSE and fit percent of each output over all windows, by public name.

    Samples that could not be simulated are counted, not mixed in; NaN where hardly any could be:
    the first of each window is its free start, which has no error.  Fit percent is MATLAB's
    100 (1 - |y - yhat| / |y - mean(y)|), over windows with free start.
    """
    windows = fit.windows
    error = in_units(fit)
    found, lost = {}, fit.unsimulated
    for k, name in enumerate(windows.plant.measured):
        recorded = np.isfinite(windows.measured[k])
        seen = recorded & ~lost[k]
        noise, left_out = float(windows.noise[k]), (int(lost[k].sum()), _first(windows, lost[k]))
        if seen.sum() <= LEAST_SIMULATED * recorded.sum():
            found[public_name(name)] = SignalError(np.nan, np.nan, noise, *left_out)
            continue
        values, e = windows.measured[k][seen], error[k][seen]
        spread = float(np.linalg.norm(values - values.mean()))
        percent = 100.0 * (1.0 - float(np.linalg.norm(e)) / spread) if spread else np.nan
        rmse = float(np.sqrt(np.mean(e**2)))
        found[public_name(name)] = SignalError(rmse, percent, noise, *left_out)
    return found


def require_simulated(when: str, *fits: Fit | None) -> None:
    """Refuse a plant that most recorded samples of an output could not be simulated with.

    ``when`` says which plant it is, as ``with cogging``.

    Raises
    ------
    ArithmeticError
        With the first such output, how many samples it loses, and where the first of them lies.
    """
    for fit in (each for each in fits if each is not None):
        windows = fit.windows
        for name, values, lost in zip(
            windows.plant.measured, windows.measured, fit.unsimulated, strict=True
        ):
            recorded, gone = int(np.isfinite(values).sum()), int(lost.sum())
            if gone <= MOST * recorded:
                continue
            place = _first(windows, lost)
            raise ArithmeticError(
                f"{public_name(name)}: {when}, {gone} of {recorded} samples could not be "
                f"simulated, the first at {place.time_s:.4g} s of {place.recording}; expected "
                "terms that are finite wherever the plant goes"
            )


def _first(windows: Windows, marked: np.ndarray) -> Place | None:
    """Where the first of the marked samples (n_windows, L) lies; None where none is."""
    starts = [
        (recording, first)
        for recording, firsts in zip(windows.recordings, windows.firsts, strict=True)
        for first in firsts
    ]
    for (recording, first), samples in zip(starts, marked, strict=True):
        if samples.any():
            sample = first + int(np.argmax(samples))
            return Place(recording.name, recording.sample_time_s * sample)
    return None


def per_sample(fit: Fit | None) -> float:
    """Mean squared error in noise deviations, nothing capped; NaN without a fit."""
    if fit is None:
        return float("nan")
    windows = fit.windows
    error = in_units(fit) / windows.noise[:, None, None]
    return float((error**2).sum() / windows.count)


def plain_ratio(before: Fit | None, after: Fit | None) -> float:
    """Squared error after over before, nothing capped: geometric mean over outputs, NaN without.

    What could not be simulated counts with its penalty: a plant is no better for stopping short.
    An output of which nothing is recorded has no say.
    """
    sums = _plain_sums(before, after)
    return float("nan") if sums is None else float(np.exp(_log_ratio(*sums.sum(axis=2))))


def plain_chance(before: Fit | None, after: Fit | None) -> float:
    """Standard deviation of the logarithm of :func:`plain_ratio`, NaN without.

    Windows are a sample of what may be recorded: where the ratio hangs on one of them, another
    recording may well say the opposite.  None without others to compare it to: 0.

    Source: the jackknife, Efron 1982, "The Jackknife, the Bootstrap and Other Resampling Plans".
    """
    sums = _plain_sums(before, after)
    if sums is None:
        return float("nan")
    count = sums.shape[2]
    if count < 2:
        return 0.0
    without = np.array([_log_ratio(*np.delete(sums, k, axis=2).sum(axis=2)) for k in range(count)])
    return float(np.sqrt((count - 1) * np.var(without)))


def _plain_sums(before: Fit | None, after: Fit | None) -> np.ndarray | None:
    """Squared errors in SI before and after of each output seen and window, (2, n_y, n_windows)."""
    if before is None or after is None:
        return None
    seen = np.isfinite(before.windows.measured).any(axis=(1, 2))
    if not seen.any():
        return None
    return np.stack([(in_units(fit)[seen] ** 2).sum(axis=2) for fit in (before, after)])


def _log_ratio(before: np.ndarray, after: np.ndarray) -> float:
    """Mean logarithm of the ratios of the squared errors of all outputs, (n_y,) each.

    Without its only window an output has no errors left, and no say.
    """
    there = (before > 0.0) | (after > 0.0)
    if not there.any():
        return 0.0
    ratios = after[there] / np.maximum(before[there], 1e-300)
    return float(np.mean(np.log(np.maximum(ratios, 1e-24))))


def penalised_rmse(fit: Fit) -> np.ndarray:
    """RMSE of each output in SI with the penalty of what could not be simulated, (n_y,)."""
    windows = fit.windows
    squares = (in_units(fit) ** 2).sum(axis=(1, 2))
    return np.sqrt(squares / np.maximum(np.isfinite(windows.measured).sum(axis=(1, 2)), 1))


def errors_of(train: Fit, validation: Fit | None) -> Errors:
    """Errors in units of a fit and of its validation."""
    found = {"train": signal_errors(train)}
    return {**found, "validation": signal_errors(validation)} if validation else found


def at_noise(fit: Fit) -> bool:
    """True where the mean square error of every output is that of its noise."""
    return bool(np.all(penalised_rmse(fit) ** 2 < AT_NOISE * fit.windows.noise**2))


def white_level(fit: Fit) -> np.ndarray:
    """What of the errors of each output is white, from their successive differences; SI, (n_y,).

    Half of the mean squared difference of neighbours is the variance of white noise, and hardly
    holds what is left of the plant, which is slower.  NaN where no neighbours are recorded.
    """
    windows = fit.windows
    seen = np.isfinite(windows.measured) & ~fit.unsimulated
    error = np.where(seen, in_units(fit), np.nan)
    steps = np.diff(error, axis=2)
    count = np.isfinite(steps).sum(axis=(1, 2))
    squares = np.nansum(steps**2, axis=(1, 2))
    return np.sqrt(np.divide(squares, 2 * count, out=np.full(len(count), np.nan), where=count > 0))


def only_noise(fit: Fit) -> bool:
    """True where the errors of every output are at their noise and, as noise is, white.

    The noise that quiet parts of a recording tell is too large where few parts are quiet: errors a
    tenth above the true one then pass for it.  So each output is also asked for the ratio of its
    mean square to that of its successive differences.

    Source: von Neumann 1941, "Distribution of the ratio of the mean square successive difference to
    the variance"; its standard deviation over n values is 1 / sqrt(n).
    """
    count = np.isfinite(fit.windows.measured).sum(axis=(1, 2))
    most = 1.0 + np.maximum(COLOURED, CHANCE / np.sqrt(np.maximum(count, 1)))
    coloured = penalised_rmse(fit) ** 2 > most * white_level(fit) ** 2
    return at_noise(fit) and not np.any(coloured)
