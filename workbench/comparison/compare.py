"""A plant against its recordings: errors by horizon and regime, worst windows, maps, residuals.

The horizons are those of :mod:`workbench.comparison.horizons`.

Beside each error stands chi2/n against the measured noise, which is one where only noise is left;
one step ahead it is a little more, for what the filter does not know of the sample before.

Source: diagnosis.md 1.1; the fit percent is that of System Identification:
100 (1 - |y - yhat| / |y - mean y|).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from workbench.comparison.course import Course, course_of
from workbench.comparison.deviation import ShiftDeviation, shift_deviations
from workbench.comparison.horizons import (
    FREE_RUN,
    JUDGED,
    ONE_STEP,
    PLAIN,
    WINDOW,
    Rows,
    foretold,
)
from workbench.comparison.maps import ErrorMap, command_maps, motion_maps
from workbench.comparison.regimes import equally_weighted, regimes_of, shares
from workbench.comparison.residuals import Residual, residual_of
from workbench.comparison.shifts import begins_energised, unfinished
from workbench.consistency import Finding, warned
from workbench.fitting.errors import SignalError
from workbench.fitting.noise_source import Noise, recorded_noise
from workbench.fitting.window_length import window_length_s
from workbench.law_range import warn_beyond
from workbench.recording import Recording
from workbench.rig import Rig

__all__ = ["FREE_RUN", "ONE_STEP", "PLAIN", "WINDOW", "compare", "signal_error"]

MOST_TOLD = 6  # shifts that reached no gear
WORST = 3  # windows that are marked
LEAST_SHARE = 0.01  # of the squared error: a window with less is not marked


@dataclass(frozen=True)
class Regime:
    """One regime: its share of the squared error, and of the time that outputs were recorded."""

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
        Recorded outputs (n,) by full name, NaN where a sensor is stuck or saturated too, and what
        each horizon gives, NaN where nothing.
    noise
        By full output name, with where it is known from.
    residuals
        One-step errors by full output name; plain errors of a plant without states.
    over_motion, over_command
        Maps of the error over position and speed, and over command and pressure.
    shifts
        Gear shifts with the deviation measure of paper 003; none where there are no gears.
    notes
        What could not be done, and what of the recording does not fit the rig, in words.
    window_s
        Length of the windows, NaN where there are none.
    findings
        What of the recording does not fit the rig; other commands refuse what weighs enough.
    """

    name: str
    time_s: np.ndarray
    errors: Mapping[str, Mapping[str, SignalError]]
    by_regime: tuple[Regime, ...]
    worst: tuple[Span, ...]
    measured: Rows
    simulated: Mapping[str, Rows]
    noise: Mapping[str, Noise]
    residuals: Mapping[str, Residual]
    over_motion: tuple[ErrorMap, ...] = ()
    over_command: tuple[ErrorMap, ...] = ()
    shifts: tuple[ShiftDeviation, ...] = ()
    notes: tuple[str, ...] = ()
    window_s: float = float("nan")
    findings: tuple[Finding, ...] = ()

    @property
    def judged(self) -> str:
        """The horizon whose error regimes, worst windows and maps are of."""
        return _first_of(JUDGED, self.simulated)


@dataclass(frozen=True)
class Comparison:
    """A rig against its recordings, in the order they were given."""

    rig_name: str
    recordings: tuple[RecordingComparison, ...]


def compare(rig: Rig, recordings: Sequence[Recording]) -> Comparison:
    """How well the rig's plant tells what was recorded; see the module for the horizons.

    Warns of what of a recording does not fit the rig, and compares it all the same.  Samples of a
    sensor that is stuck or saturated are no measurement, and left out as in a fit.
    """
    for recording in recordings:
        warn_beyond(rig, recording)
    return Comparison(rig.name, tuple(_compared(rig, recording) for recording in recordings))


def _compared(rig: Rig, recording: Recording) -> RecordingComparison:
    recording, findings = warned(rig, recording)
    course = course_of(rig.fit_for(recording), recording)
    plant = course.plant
    noise = recorded_noise(recording, plant.measured)
    measured = {name: recording[name] for name in plant.measured}
    simulated, notes = foretold(course, {name: each.value for name, each in noise.items()})
    judged = simulated[_first_of(JUDGED, simulated)]
    ahead = simulated[_first_of((ONE_STEP, PLAIN), simulated)]
    errors = {name: measured[name] - judged[name] for name in measured}
    shifts, more = _shifts(course)
    squared = equally_weighted(np.array([*errors.values()]))
    length_s = window_length_s(plant, [recording])
    return RecordingComparison(
        name=recording.name,
        time_s=recording.time_s,
        errors={
            horizon: {n: signal_error(measured[n], rows[n], noise[n].value) for n in rows}
            for horizon, rows in simulated.items()
        },
        by_regime=_by_regime(course, squared),
        worst=_worst(squared, recording, length_s),
        measured=measured,
        simulated=simulated,
        noise=noise,
        residuals={
            name: residual_of(recording, measured[name] - ahead[name], noise[name].value)
            for name in measured
        },
        over_motion=motion_maps(course, errors),
        over_command=command_maps(course, errors),
        shifts=shifts,
        notes=(
            *_pieces_in_words(recording),
            *_begin_in_words(recording),
            *notes,
            *more,
            *filter(None, (each.sentence for each in noise.values())),
            *map(str, findings),
        ),
        window_s=length_s if WINDOW in simulated else float("nan"),
        findings=findings,
    )


def signal_error(measured: np.ndarray, simulated: np.ndarray, noise: float) -> SignalError:
    """RMSE, fit percent and noise over the samples that both have; NaN where there is none."""
    both = np.isfinite(measured) & np.isfinite(simulated)
    left_out = int(np.sum(np.isfinite(measured) & ~both))
    if not both.any():
        return SignalError(np.nan, np.nan, noise, left_out)
    y, error = measured[both], (measured - simulated)[both]
    spread = float(np.linalg.norm(y - y.mean()))
    fit = 100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread > 0 else np.nan
    return SignalError(float(np.sqrt(np.mean(error**2))), fit, noise, left_out)


def _first_of(wanted: Sequence[str], simulated: Mapping[str, Rows]) -> str:
    return next(horizon for horizon in wanted if horizon in simulated)


def _by_regime(course: Course, squared: np.ndarray) -> tuple[Regime, ...]:
    chosen = regimes_of(course)
    seen = np.isfinite(course.recording.rows(course.plant.measured)).any(axis=0)
    return tuple(
        Regime(name, share, float(np.mean(chosen[name][seen])))
        for name, share in shares(chosen, squared).items()
    )


def _shifts(course: Course) -> tuple[tuple[ShiftDeviation, ...], list[str]]:
    early = "a shift began before the recording, or a piece of it, did: its deviation is not known"
    notes = [early] if begins_energised(course) else []
    notes += _unfinished_in_words(course)
    try:
        return shift_deviations(course), notes
    except ArithmeticError as error:
        return (), [*notes, f"no deviation of the shifts: {error}"]


def _unfinished_in_words(course: Course) -> list[str]:
    """Shifts that reached no gear: the table of deviations has none of them."""
    begun = unfinished(course)
    if not begun:
        return []
    dt = course.recording.sample_time_s
    told = ", ".join(f"{dt * first:.3f} s" for first in begun[:MOST_TOLD])
    more = f" and {len(begun) - MOST_TOLD} more" if len(begun) > MOST_TOLD else ""
    return [f"reached no other gear, and have no deviation: the shifts from {told}{more}"]


def _pieces_in_words(recording: Recording) -> tuple[str, ...]:
    """Where the pieces of a split recording begin: no time that is told counts its gaps."""
    if len(recording.starts) < 2:
        return ()
    begins = ", ".join(f"{recording.sample_time_s * first:.4g}" for first in recording.starts)
    told = f"{len(recording.starts)} pieces stand one behind the other"
    return (f"{told}, from {begins} s on: times leave the gaps out",)


def _begin_in_words(recording: Recording) -> tuple[str, ...]:
    """When a recording begins, where its file does not count from zero or its first step."""
    if abs(recording.begins_s) < 1.5 * recording.sample_time_s:
        return ()
    return (f"times count from the first sample, at {recording.begins_s:.10g} s in its file",)


def _worst(squared: np.ndarray, recording: Recording, window_s: float) -> tuple[Span, ...]:
    """The stretches with the largest error, as long as a window or to the end of their piece.

    One that holds next to none of the error is none of the worst, however few there are.
    """
    dt = recording.sample_time_s
    length = max(round(window_s / dt), 1)
    total = float(np.nansum(squared))
    spans = [
        (first, min(first + length, end))
        for start, end in pairwise((*recording.starts, len(squared)))
        for first in range(start, end, length)
    ]
    sums = [(float(np.nansum(squared[first:last])), first, last) for first, last in spans]
    return tuple(
        Span(first * dt, last * dt, found / total)
        for found, first, last in sorted(sums, reverse=True)[:WORST]
        if found > LEAST_SHARE * total
    )
