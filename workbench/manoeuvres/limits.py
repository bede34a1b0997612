"""What a rig may do in a new recording: ranges of commands, travel, speed and pressure.

Commands keep their own ranges.  A position stays where the rig has been recorded, give or take a
little, and between its stops, which it meets gently; speeds and pressures stay below what was
recorded, or the supply.  A single glitch of a sensor is no place and no pressure where a rig was.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import ceil, inf, isfinite

import numpy as np

from workbench.fitting.starts import bridged, slope
from workbench.fitting.window_length import moves
from workbench.manoeuvres.stops import Ends, reach_of, stops_of
from workbench.plant import Plant, Signal
from workbench.recording import Recording
from workbench.units import public_name

DURATION_S = 10.0
MOST_SAMPLES = 20_000
ROOM = 0.05  # of the recorded range of a position, beyond it
FASTER = 1.3  # times the fastest recorded speed
GENTLE = 0.4  # times the same, at a stop and where a manoeuvre is meant to reach both
HIGHER = 1.05  # times the highest pressure recorded or supplied
DEEP_M = 1e-3  # that a stop may give way, at what meets it
POSITIONS = ("position_m", "angle_rad")
SPEED_S = 20e-3  # at least, that a speed lasts (chosen): noise over a few samples is none
GLITCH_SAMPLES = 5  # of a running median: one bad sample, or two that resampling makes of it
GLITCH = 1.25  # times what the median moves in as many samples: closer to it is motion


class Drive(Enum):
    """How commands move a plant, which decides what can be played."""

    POSITION = "each command moves a position or an angle, which integrates it"
    PRESSURE = "commands fill and vent volumes"
    SWITCHED = "commands are on or off"
    UNSEEN = "commands move what is not recorded: no limit of it can be kept, so nothing is played"


@dataclass(frozen=True)
class Axis:
    """A position or angle that one command moves; all in SI.

    start       where its first recording begins: a manoeuvre begins there too
    low, high   where recordings have been
    speed       fastest recorded
    stops       ends of the stroke, infinite where the plant has none
    deep        the same where they give way as far as they may
    """

    output: str
    start: float
    low: float
    high: float
    speed: float
    stops: Ends
    deep: Ends

    def broken_by(self, values: np.ndarray, sample_time_s: float, ends: bool) -> str:
        """What a predicted course of it, (n,), breaks; see :meth:`Limits.broken_by`."""
        name = public_name(self.output)
        both = ends and isfinite(self.stops[1] - self.stops[0])
        room = ROOM * (self.high - self.low)
        recorded = self.low, self.high
        low, high = self.deep if both else reach_of(recorded, room, self.stops, self.deep)
        if not (low <= values.min() and values.max() <= high):
            return f"{name} leaves {low:.3g} to {high:.3g}"
        speeds = _speeds(values, sample_time_s)
        fastest = (GENTLE if ends else FASTER) * self.speed
        if not _largest(speeds) <= fastest:
            return f"{name} is faster than {fastest:.3g} per second"
        gentle = GENTLE * self.speed
        if not _largest(speeds[self._at_stops(values, sample_time_s)]) <= gentle:
            return f"{name} meets a stop faster than {gentle:.3g} per second"
        return ""

    def _at_stops(self, values: np.ndarray, sample_time_s: float) -> np.ndarray:
        """True beyond a stop and so long before and behind that a speed lasts, (n,).

        At the stop itself it is a mean of the speeds of before and behind.
        """
        from scipy.ndimage import maximum_filter1d

        beyond = (values < self.stops[0]) | (values > self.stops[1])
        return maximum_filter1d(beyond, _speed_samples(sample_time_s))


@dataclass(frozen=True)
class Limits:
    """What a rig may do; see the module.

    Attributes
    ----------
    commands
        With finite ranges.
    axes
        One per command where commands move positions, else empty.
    highest_pa
        Of the measured pressures.
    begun
        Where the first recording begins, of each measured quantity but speeds; empty where commands
        are switched: what is not recorded of such a plant, as a gear, would not fit to it.
    """

    drive: Drive
    commands: tuple[Signal, ...]
    axes: tuple[Axis, ...]
    highest_pa: float
    begun: Mapping[str, float]
    sample_time_s: float
    samples: int

    @property
    def time_s(self) -> np.ndarray:
        """Sample times from zero, shape (n,)."""
        return self.sample_time_s * np.arange(self.samples)

    def broken_by(self, predicted: Recording, ends: bool) -> str:
        """What a prediction breaks, in words; empty where it keeps all limits.

        ``ends`` where the manoeuvre is meant to reach the stops.
        """
        pressures = [v for name, v in predicted.channels.items() if name.endswith("pressure_pa")]
        # What could not be simulated (NaN) keeps no limit.
        if not all(values.max() <= self.highest_pa for values in pressures):
            return f"a pressure above {1e-5 * self.highest_pa:.1f} bar"
        broken = (
            axis.broken_by(predicted[axis.output], self.sample_time_s, ends) for axis in self.axes
        )
        return next(filter(None, broken), "")


def limits_of(plant: Plant, recordings: Sequence[Recording]) -> Limits:
    """What a plant may do that was recorded like this.

    The k-th command is taken to move the k-th measured position.
    """
    dt = recordings[0].sample_time_s
    commands = tuple(_bounded(signal, recordings) for signal in plant.commands)
    outputs = [name for name in plant.measured if name.endswith(POSITIONS)]
    switched = any(signal.levels for signal in commands)
    seen = not switched and len(outputs) == len(commands)
    begun = {} if switched else _begun(plant, recordings[0])
    axes = tuple(_axis(plant, name, recordings) for name in outputs) if seen else ()
    if switched:
        drive = Drive.SWITCHED
    elif axes:
        drive = Drive.POSITION
    else:
        drive = Drive.UNSEEN if moves(plant) else Drive.PRESSURE
    samples = min(round(DURATION_S / dt), MOST_SAMPLES)
    return Limits(drive, commands, axes, _highest_pa(plant, recordings), begun, dt, samples)


def _begun(plant: Plant, recording: Recording) -> dict[str, float]:
    """The first value of what is measured: a manoeuvre begins from rest, so of no speed."""
    names = [name for name in plant.measured if name.endswith((*POSITIONS, "pressure_pa"))]
    rows = ((name, recording[name][np.isfinite(recording[name])]) for name in names)
    return {name: float(values[0]) for name, values in rows if len(values)}


def _bounded(signal: Signal, recordings: Sequence[Recording]) -> Signal:
    """The signal with the recorded range where it has none of its own."""
    values = np.concatenate([recording[signal.name] for recording in recordings])
    lower, upper = signal.lower, signal.upper
    return replace(
        signal,
        lower=lower if isfinite(lower) else float(np.nanmin(values)),
        upper=upper if isfinite(upper) else float(np.nanmax(values)),
    )


def _range(name: str, recordings: Sequence[Recording]) -> Ends:
    """Extremes of an output."""
    pieces = [piece[name] for recording in recordings for piece in recording.pieces]
    values = np.concatenate([_without_glitches(each) for each in pieces])
    return float(np.nanmin(values)), float(np.nanmax(values))


def _axis(plant: Plant, output: str, recordings: Sequence[Recording]) -> Axis:
    low, high = _range(output, recordings)
    pieces = [(piece[output], r.sample_time_s) for r in recordings for piece in r.pieces]
    speed = max(_largest(_speeds(_without_glitches(values), dt)) for values, dt in pieces)
    start = _begun(plant, recordings[0]).get(output, (low + high) / 2)
    stops, deep = stops_of(plant, output), stops_of(plant, output, DEEP_M)
    return Axis(output, start, low, high, speed, stops, deep)


def _without_glitches(values: np.ndarray) -> np.ndarray:
    """Recorded values, (n,), missing where they are too far from their running median.

    The median itself would cut off turns, and the ends of what was recorded in motion.
    """
    from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d

    found, seen = values.copy(), np.isfinite(values)
    if seen.any():
        own, n = values[seen], GLITCH_SAMPLES
        usual = median_filter(own, n)
        moved = maximum_filter1d(usual, n) - minimum_filter1d(usual, n)
        found[seen] = np.where(np.abs(own - usual) > GLITCH * moved, np.nan, own)
    return found


def _speeds(values: np.ndarray, sample_time_s: float) -> np.ndarray:
    """Size of the speed at each sample, by a moving parabola, (n,); NaN at either end.

    There a parabola has four times the noise that it has in its middle.
    """
    samples = _speed_samples(sample_time_s)
    speeds = np.abs(slope(bridged(values, (0,)), sample_time_s, (0,), samples))
    speeds[: samples // 2] = speeds[max(len(speeds) - samples // 2, 0) :] = np.nan
    return speeds


def _speed_samples(sample_time_s: float) -> int:
    """Odd number of samples over which a speed is taken."""
    return 2 * ceil(SPEED_S / (2.0 * sample_time_s)) + 1


def _largest(speeds: np.ndarray) -> float:
    """The largest that is known, 0 where none is."""
    return float(np.nanmax(speeds, initial=0.0))


def _highest_pa(plant: Plant, recordings: Sequence[Recording]) -> float:
    names = {n for r in recordings for n in r.channels if n.endswith("pressure_pa")}
    recorded = [_range(name, [r for r in recordings if name in r.channels])[1] for name in names]
    supplied = plant.values.get("supply.pressure_pa", 0.0)
    return HIGHER * max([*recorded, supplied]) if recorded or supplied else inf
