"""A plant against its recordings, over three horizons, because positions integrate.

one step    innovations of the extended Kalman filter: what is missed within one sample
window      a fifth of a second with free start states: forces and flows stay visible, drift is cut
free run    the whole recording from its first sample: what a user of a simulation feels

A plant without states has one horizon, ``sample by sample``.

Source: diagnosis.md 1.1; the fit percent is that of System Identification:
100 (1 - |y - yhat| / |y - mean y|).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.comparison.regimes import regimes, shares
from workbench.filtering import filter_pass, recording_filter
from workbench.fitting.errors import SignalError
from workbench.fitting.noise import measured_noise
from workbench.fitting.start_states import refit_starts
from workbench.fitting.starts import guessed_states
from workbench.fitting.window_length import window_length_s
from workbench.fitting.windows import Windows, cut_windows
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.simulation import simulate

ONE_STEP, WINDOW, FREE_RUN, PLAIN = "one step", "window", "free run", "sample by sample"
WORST = 3  # windows that are marked
PROCESS_SHARE = 0.1  # of a state's scale per square root of a second, in the one-step filter

Rows = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Regime:
    """One regime: its share of the squared error, and of the time."""

    name: str
    share_of_error: float
    share_of_time: float


@dataclass(frozen=True)
class Span:
    """A stretch of a recording, and its share of the squared error."""

    start_s: float
    end_s: float
    share_of_error: float


@dataclass(frozen=True)
class RecordingComparison:
    """One recording against the plant.

    Attributes
    ----------
    errors
        By horizon, then by full output name.
    by_regime
        Largest share of the error first.
    worst
        Windows with the largest error, worst first.
    measured, simulated
        Recorded outputs (n,) by full name, and what each horizon gives, NaN where nothing.
    notes
        What could not be done, in words.
    """

    name: str
    time_s: np.ndarray
    errors: Mapping[str, Mapping[str, SignalError]]
    by_regime: tuple[Regime, ...]
    worst: tuple[Span, ...]
    measured: Rows
    simulated: Mapping[str, Rows]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Comparison:
    """A rig against its recordings, in the order they were given."""

    rig_name: str
    recordings: tuple[RecordingComparison, ...]


def compare(rig: Rig, recordings: Sequence[Recording]) -> Comparison:
    """How well the rig's plant tells what was recorded; see the module for the horizons."""
    return Comparison(rig.name, tuple(_compared(rig, recording) for recording in recordings))


def _compared(rig: Rig, recording: Recording) -> RecordingComparison:
    plant = rig.fit_for(recording).lean()
    noise = _noise(recording, plant.measured)
    measured = {name: recording[name] for name in plant.measured}
    states = guessed_states(plant, recording)[0]
    simulated, notes = _simulated(plant, recording, noise, states)
    errors = {
        horizon: {n: signal_error(measured[n], rows[n], noise[n]) for n in rows}
        for horizon, rows in simulated.items()
    }
    horizon = next(name for name in (WINDOW, PLAIN, FREE_RUN, ONE_STEP) if name in simulated)
    squared = _squared(measured, simulated[horizon])
    chosen = regimes(plant, recording, states)
    by_regime = tuple(
        Regime(name, share, float(np.mean(chosen[name])))
        for name, share in shares(chosen, squared).items()
    )
    return RecordingComparison(
        name=recording.name,
        time_s=recording.time_s,
        errors=errors,
        by_regime=by_regime,
        worst=_worst(squared, recording.sample_time_s, window_length_s(plant, [recording])),
        measured=measured,
        simulated=simulated,
        notes=tuple(notes),
    )


def signal_error(measured: np.ndarray, simulated: np.ndarray, noise: float) -> SignalError:
    """RMSE, fit percent and noise over the samples that both have; NaN where there is none."""
    both = np.isfinite(measured) & np.isfinite(simulated)
    if not both.any():
        return SignalError(np.nan, np.nan, noise)
    y, error = measured[both], (measured - simulated)[both]
    spread = float(np.linalg.norm(y - y.mean()))
    fit = 100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread > 0 else np.nan
    return SignalError(float(np.sqrt(np.mean(error**2))), fit, noise)


def _noise(recording: Recording, outputs: tuple[str, ...]) -> dict[str, float]:
    """Noise by output; a channel that shows none counts a thousandth of its range."""
    found = {}
    for name in outputs:
        try:
            found |= measured_noise([recording], [name])
        except ValueError:
            span = float(np.nanmax(recording[name]) - np.nanmin(recording[name]))
            found[name] = max(1e-3 * span, 1e-12)
    return found


def _simulated(
    plant: Plant, recording: Recording, noise: Mapping[str, float], states: np.ndarray
) -> tuple[dict[str, Rows], list[str]]:
    """Outputs by horizon, and what could not be done."""
    if not plant.model.states:
        return {PLAIN: _outputs(plant, simulate(plant, recording))}, []
    found, notes = {ONE_STEP: _one_step(plant, recording, noise)}, []
    try:
        length_s = window_length_s(plant, [recording])
        found[WINDOW] = _windows(cut_windows(plant, [recording], noise, length_s))
    except ValueError as error:
        notes.append(f"no windows: {error}")
    try:
        found[FREE_RUN] = _free_run(plant, recording, states)
    except ArithmeticError as error:
        notes.append(f"no free run: {error}")
    return found, notes


def _outputs(plant: Plant, recording: Recording) -> Rows:
    return {name: recording[name] for name in plant.measured}


def _one_step(plant: Plant, recording: Recording, noise: Mapping[str, float]) -> Rows:
    """Measured minus innovation: the outputs foretold one sample before."""
    process = dict(zip(plant.model.states, PROCESS_SHARE * plant.scale, strict=True))
    known = recording_filter(plant, recording, measurement_noise=noise, process_noise=process)
    found = filter_pass(known, recording)
    rows = zip(found.measured, found.innovations, strict=True)
    return {name: recording[name] - innovation for name, innovation in rows}


def _windows(windows: Windows) -> Rows:
    """Outputs of each window from its own start, (n,) with NaN outside of windows."""
    fit = refit_starts(windows)
    simulated = windows.measured - fit.residual * windows.scale[:, :, None]
    recording, firsts = windows.recordings[0], windows.firsts[0]
    rows = np.full((len(simulated), len(recording)), np.nan)
    for k, first in enumerate(firsts):
        rows[:, first : first + windows.length] = simulated[:, k]
    return dict(zip(windows.plant.measured, rows, strict=True))


def _free_run(plant: Plant, recording: Recording, states: np.ndarray) -> Rows:
    """Outputs from the first sample of each piece to its end."""
    pieces = [
        _outputs(plant, simulate(plant, piece, states[:, first]))
        for first, piece in zip(recording.starts, recording.pieces, strict=True)
    ]
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in plant.measured}


def _squared(measured: Rows, simulated: Rows) -> np.ndarray:
    """Squared error with the same weight for every output, (n,); NaN where nothing is.

    In units of the noise a fine position sensor would outweigh every pressure.
    """
    rows = np.array([(measured[name] - simulated[name]) ** 2 for name in measured])
    seen = np.isfinite(rows)
    total = np.nansum(rows, axis=1, keepdims=True)
    weighted = np.where(seen, rows, 0.0) / np.maximum(total, 1e-300)
    return np.where(seen.any(axis=0), weighted.sum(axis=0), np.nan)


def _worst(squared: np.ndarray, sample_time_s: float, window_s: float) -> tuple[Span, ...]:
    """The stretches as long as a window with the largest error."""
    length = max(round(window_s / sample_time_s), 1)
    total = float(np.nansum(squared))
    firsts = range(0, max(len(squared) - length + 1, 1), length)
    sums = [(float(np.nansum(squared[k : k + length])), k) for k in firsts]
    return tuple(
        Span(k * sample_time_s, min(k + length, len(squared)) * sample_time_s, found / total)
        for found, k in sorted(sums, reverse=True)[:WORST]
        if found > 0
    )
