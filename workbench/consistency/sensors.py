"""Sensors that say nothing, and clocks that tick unevenly.

Noise      A signal with any motion in it is smoother than white noise: the third differences of
           white noise have 20 times its variance, those of a motion next to none.
Stuck      Equal to the last bit for a while, in a channel that otherwise changes from sample to
           sample, while the plant says that it moves.
Still      The same in a coarse channel, which repeats values anyway: there the plant may rest.
Saturated  At an end of what it can show, to the last bit, again and again.
Missing    Silent for a while, many times longer than between its other samples.
Stops      No body gets through them.
Clock      A sample taken delta late reads y + delta dy/dt: noise that grows with the slope, by the
           same delta in every channel that is fine enough to show it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.consistency.explained import Probe, predicted_motion, probe, shown_noise
from workbench.consistency.findings import Finding, Weight
from workbench.effects.forces import EndStops
from workbench.fitting.noise import THIRD_DIFFERENCE_GAIN
from workbench.fitting.window_cuts import evenly
from workbench.plant import Plant
from workbench.reading.outliers import outliers
from workbench.reading.plausible import RUN, saturation_text, still_stretch, stuck_stretch
from workbench.recording import Recording
from workbench.saturation import saturated
from workbench.units import display_unit, public_name, scale

WHITE = 0.8  # of a channel's standard deviation is that of white noise
SPARSE = 0.2  # of what moves in a window moves between two samples: these are far apart
OUTSIDE = 0.2  # of the stroke: a position that far beyond a stop cannot be
LEAST_STUCK = 0.02  # of a recording
SILENT = 20  # times as long as usual without a sample, and at least so many samples
WORTH_A_WORD = 0.1  # of a recording, missing in such stretches
LOOKED_AT = 8  # windows of a stretch in which a sensor may be stuck
UNEVEN = 0.1  # of a sample: a clock that ticks as unevenly as that is worth a word
CLEARLY = 10.0  # noise deviations: a motion that a sensor cannot miss
SOLVED = 1e-6  # of a value: so far a plant at rest may drift in a solver
STEEPEST = 0.2  # share of the samples at which an uneven clock shows most
FINE = 0.05  # of a sample: the jitter that a channel must be able to show
MEDIAN_OF_NORMAL = 0.6745


def noisy(plant: Plant, recording: Recording, unexplained: np.ndarray) -> list[Finding]:
    """Outputs that are nothing but noise, although the plant says they move.

    A sensor at rest is noise too, but then nothing drives the plant.
    """
    found: list[Finding] = []
    if not _driven(plant, recording):
        return found
    for name, share in zip(plant.measured, unexplained, strict=True):
        white = _white_share(recording, name)
        if white > WHITE and share > 1.0 and not _small(plant, recording, name):
            slow = _sparse(plant, recording, name)
            each_ms = 1e3 * recording.sample_time_s
            also = f", or sampled too slowly ({each_ms:.4g} ms) for what moves here" if slow else ""
            what = f"is noise{also}: {min(white, 1.0):.0%} of it changes at random from sample to "
            what += "sample"
            remedy = f"check the wiring{', log more often' if slow else ''}, or leave the channel "
            remedy += "out of [recording.channels]"
            found.append(_finding(Weight.REFUSED, recording, name, what, remedy))
    return found


def _sparse(plant: Plant, recording: Recording, name: str) -> bool:
    """Whether the plant says that an output changes much from one sample to the next.

    Then samples are far apart for it, and what it truly does looks like noise.
    """
    where = probe(plant, recording)
    if where is None:
        return False
    lengths, k = (2, where.length), plant.measured.index(name)
    motions = (predicted_motion(plant, recording, replace(where, length=n))[k] for n in lengths)
    next_one, whole = (float(np.sqrt(np.nanmean(motion**2))) for motion in motions)
    return next_one > SPARSE * whole


def _driven(plant: Plant, recording: Recording) -> bool:
    """Whether a command changes, or a measured input by more than noise; true without any."""
    commands = [recording[s.name] for s in plant.commands]
    inputs = [s.name for s in plant.measured_inputs]
    changes = any(np.nanstd(values) > 0.0 for values in commands)
    moves = any(
        np.nanstd(recording[n]) > 0.0 and _white_share(recording, n) < WHITE for n in inputs
    )
    return changes or moves or not (commands or inputs)


def _small(plant: Plant, recording: Recording, name: str) -> bool:
    """Whether a channel moves by less than a hundredth of the plant's typical size of it."""
    states = plant.state_list
    return name in states and np.nanstd(recording[name]) < 0.01 * states[name].scale


def _white_share(recording: Recording, name: str) -> float:
    """Standard deviation of the white part of a channel over that of the whole.

    0 where no four neighbours are recorded, as of a slow sensor on a fast clock.  Samples far off
    all others are left out: one of them outweighs all the rest in both.
    """
    kept = np.where(outliers(recording[name]), np.nan, recording[name])
    recording = replace(recording, channels={name: kept})
    spread = float(np.nanstd(kept))
    third = np.concatenate([np.diff(piece[name], 3) for piece in recording.pieces])
    third = third[np.isfinite(third)]
    third_rms = np.sqrt(np.mean(third**2)) if len(third) else 0.0
    return float(third_rms / np.sqrt(THIRD_DIFFERENCE_GAIN)) / max(spread, 1e-300)


def beyond_stops(plant: Plant, recording: Recording) -> list[Finding]:
    """Positions that the stops do not allow."""
    found = []
    for stops in (effect for effect in plant.effects if isinstance(effect, EndStops)):
        name, low_m, high_m = f"{stops.body}.position_m", stops.lower_m, stops.upper_m
        if name not in plant.measured:
            continue
        least_m, most_m = np.nanmin(recording[name]), np.nanmax(recording[name])
        if max(low_m - least_m, most_m - high_m) > OUTSIDE * (high_m - low_m):
            what = f"moves from {least_m:.4g} to {most_m:.4g} m, between stops at {low_m:.4g} and "
            what += f"{high_m:.4g} m"
            remedy = "another unit, sign or zero, or other stops and chambers in [values]"
            found.append(_finding(Weight.REFUSED, recording, name, what, remedy))
    return found


def stuck(plant: Plant, recording: Recording) -> tuple[Recording, list[Finding]]:
    """The recording without the samples of outputs that stick or saturate, and the findings."""
    recording, found = _without_saturated(plant, recording)
    channels = dict(recording.channels)
    for name in plant.measured:
        stretch = stuck_stretch(recording[name])
        if stretch is None:
            found += _still(plant, recording, name)
            continue
        if not _should_move(plant, recording, name, stretch):
            continue
        first, length = stretch
        kept = recording[name].copy()
        kept[first : first + length] = np.nan
        channels[name] = kept
        what = f"stuck at {_moving_elsewhere(recording, name, stretch)}"
        remedy = "these samples are left out; check the sensor"
        found.append(_finding(Weight.DOUBT, recording, name, what, remedy))
    return replace(recording, channels=channels), found


def _still(plant: Plant, recording: Recording, name: str) -> list[Finding]:
    """A word on a coarse sensor that stands still for long while the plant says that it moves.

    It also does so where a plant rests whose model lacks what holds it, so its samples stay.
    """
    first, length = still_stretch(recording[name])
    long = length >= WORTH_A_WORD * len(recording)
    if not (long and _should_move(plant, recording, name, (first, length))):
        return []
    what = f"stands at {_moving_elsewhere(recording, name, (first, length))}"
    remedy = "if the sensor is stuck leave these samples out; they are kept"
    return [_finding(Weight.NOTICE, recording, name, what, remedy)]


def _moving_elsewhere(recording: Recording, name: str, stretch: tuple[int, int]) -> str:
    """A value and the time in which a channel keeps it although it should not."""
    first, length = stretch
    begin_s, end_s = (recording.sample_time_s * k for k in (first, first + length - 1))
    shown = scale(display_unit(name), name).from_si(recording[name][first])
    return (
        f"{shown:.5g} {display_unit(name)} from {begin_s:.4g} to {end_s:.4g} s, while the plant "
        "says it moves"
    )


def _without_saturated(plant: Plant, recording: Recording) -> tuple[Recording, list[Finding]]:
    found, channels = [], dict(recording.channels)
    for name in plant.measured:
        values = recording[name]
        at_ends = saturated(name, values)
        if at_ends.any():
            channels[name] = np.where(at_ends, np.nan, values)
            what = saturation_text(name, values, at_ends)
            remedy = "left out of errors, fits and noise; a sensor of a wider range would tell them"
            found.append(_finding(Weight.DOUBT, recording, name, what, remedy))
    return replace(recording, channels=channels) if found else recording, found


def missing(plant: Plant, recording: Recording) -> list[Finding]:
    """A word on outputs silent for a tenth of the recording, one for all that are so at once."""
    said: dict[str, list[str]] = {}
    for name in plant.measured:
        gaps = _silences(np.isfinite(recording[name]))
        share = sum(length for _, length in gaps) / len(recording)
        if share < WORTH_A_WORD:
            continue
        first, length = max(gaps, key=lambda each: each[1])
        begin_s, end_s = (recording.sample_time_s * k for k in (first, first + length))
        what = (
            f"no samples for {share:.0%} of the recording, the longest time from "
            f"{begin_s:.4g} to {end_s:.4g} s"
        )
        said.setdefault(what, []).append(public_name(name))
    remedy, where = "nothing is told of these times", recording.source or recording.name
    return [
        Finding(Weight.NOTICE, where, ", ".join(names), what, remedy)
        for what, names in said.items()
    ]


def _silences(recorded: np.ndarray) -> list[tuple[int, int]]:
    """First sample and length of the stretches in which a channel is silent for long."""
    heard = np.flatnonzero(recorded)
    if not len(heard):
        return [(0, len(recorded))]
    usual = float(np.median(np.diff(heard))) if len(heard) > 1 else 1.0
    edges = np.concatenate([[-1], heard, [len(recorded)]])
    lengths = np.diff(edges) - 1
    long = lengths >= SILENT * usual
    return list(zip((edges[:-1][long] + 1).tolist(), lengths[long].tolist(), strict=True))


def _should_move(plant: Plant, recording: Recording, name: str, stretch: tuple[int, int]) -> bool:
    first, length = stretch
    size = max(round(0.2 / recording.sample_time_s), 20)
    firsts = range(first, first + length - size + 1, size)
    if length < LEAST_STUCK * len(recording) or not firsts:
        return False
    chosen = tuple(firsts[k] for k in evenly(len(firsts), min(LOOKED_AT, len(firsts))))
    motion = predicted_motion(plant, recording, Probe(chosen, size))
    usual = shown_noise(recording, name) or SOLVED * float(np.nanmax(np.abs(recording[name])))
    return bool(np.median(motion[plant.measured.index(name)]) > CLEARLY * usual)


def uneven_clock(plant: Plant, recording: Recording) -> list[Finding]:
    """A word on samples that are not taken when the clock says, as far as channels can show it."""
    jitters = [_jitter(recording, name) for name in plant.measured]
    seen = [jitter for jitter, finest in jitters if finest < FINE]
    if not seen or not UNEVEN <= min(seen) <= 1.0:  # nothing is sampled before the sample ahead
        return []
    late_ms = 1e3 * min(seen) * recording.sample_time_s
    what = (
        f"has noise that grows with its slope: samples seem taken {min(seen):.0%} of a sample "
        f"({late_ms:.2g} ms) early or late, as a standard deviation"
    )
    names = [n for n, (_, finest) in zip(plant.measured, jitters, strict=True) if finest < FINE]
    remedy = "log the time at which each sample was taken"
    return [_finding(Weight.NOTICE, recording, name, what, remedy) for name in names[:1]]


def _jitter(recording: Recording, name: str) -> tuple[float, float]:
    """Standard deviation of the sampling instant in samples, and the finest that would show.

    Where a sensor stands still for long its noise cannot be told.
    """
    first, length = still_stretch(recording[name])
    if length >= RUN:
        values = recording[name].copy()
        values[first : first + length] = np.nan
        recording = replace(recording, channels={**recording.channels, name: values})
    noise = shown_noise(replace(recording, noise={}), name)
    if not noise:
        return 0.0, np.inf
    third, slope = [], []
    for piece in recording.pieces:
        y = piece[name]
        third.append(np.diff(y, 3))
        slope.append(np.abs(y[3:] - y[:-3]) / 3.0)
    bends, slopes = np.concatenate(third), np.concatenate(slope)
    seen = np.isfinite(bends)
    if seen.sum() < 100:
        return 0.0, np.inf
    steep = seen & (slopes >= np.quantile(slopes[seen], 1.0 - STEEPEST))
    typical = float(np.median(slopes[steep]))
    if typical <= 0.0:
        return 0.0, np.inf
    apparent = float(np.median(np.abs(bends[steep]))) / MEDIAN_OF_NORMAL
    apparent /= np.sqrt(THIRD_DIFFERENCE_GAIN)
    return np.sqrt(max(apparent**2 - noise**2, 0.0)) / typical, noise / typical


def _finding(weight: Weight, recording: Recording, name: str, what: str, remedy: str) -> Finding:
    return Finding(weight, recording.source or recording.name, public_name(name), what, remedy)
