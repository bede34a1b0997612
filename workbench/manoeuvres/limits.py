"""What a rig may do in a new recording: ranges of commands, travel, speed and pressure.

Commands keep their own ranges.  A position stays where the rig has been recorded, give or take a
little, and between its stops, which it meets gently; speeds and pressures stay below what was
recorded, or the supply.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import inf, isfinite

import numpy as np

from workbench.effects.forces import EndStops
from workbench.fitting.window_length import moves
from workbench.plant import Plant, Signal
from workbench.recording import Recording
from workbench.units import public_name

DURATION_S = 10.0
MOST_SAMPLES = 20_000
ROOM = 0.05  # of the recorded range of a position, beyond it
FASTER = 1.3  # times the fastest recorded speed
GENTLE = 0.4  # times the same, where a manoeuvre reaches the stops
HIGHER = 1.05  # times the highest pressure recorded or supplied
DEEP_M = 1e-3  # that a stop may give way
POSITIONS = ("position_m", "angle_rad")
SPEED_SAMPLES = 10  # over which a recorded speed is taken


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
    """

    output: str
    start: float
    low: float
    high: float
    speed: float
    stops: tuple[float, float]


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
        for axis in self.axes:
            values = predicted[axis.output]
            name, room = public_name(axis.output), ROOM * (axis.high - axis.low)
            low, high = max(axis.stops[0], axis.low - room), min(axis.stops[1], axis.high + room)
            if ends and isfinite(axis.stops[1] - axis.stops[0]):
                low, high = axis.stops[0] - DEEP_M, axis.stops[1] + DEEP_M
            if not (low <= values.min() and values.max() <= high):
                return f"{name} leaves {low:.3g} to {high:.3g}"
            fastest = (GENTLE if ends else FASTER) * axis.speed
            if not _fastest(values, self.sample_time_s) <= fastest:
                return f"{name} is faster than {fastest:.3g} per second"
        return ""


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
    low, high = _range(signal.name, recordings)
    lower, upper = signal.lower, signal.upper
    return replace(
        signal,
        lower=lower if isfinite(lower) else low,
        upper=upper if isfinite(upper) else high,
    )


def _range(name: str, recordings: Sequence[Recording]) -> tuple[float, float]:
    values = np.concatenate([recording[name] for recording in recordings])
    return float(np.nanmin(values)), float(np.nanmax(values))


def _axis(plant: Plant, output: str, recordings: Sequence[Recording]) -> Axis:
    low, high = _range(output, recordings)
    speed = max(_fastest(piece[output], r.sample_time_s) for r in recordings for piece in r.pieces)
    start = _begun(plant, recordings[0]).get(output, (low + high) / 2)
    return Axis(output, start, low, high, speed, stops_of(plant, output))


def stops_of(plant: Plant, output: str) -> tuple[float, float]:
    """Ends of the stroke of a measured position, infinite where its body has no stops; in SI."""
    body, _, quantity = output.rpartition(".")
    ends = [e for e in plant.effects if isinstance(e, EndStops) and e.body == body]
    there = ends and quantity in POSITIONS
    return (float(ends[0].lower_m), float(ends[0].upper_m)) if there else (-inf, inf)


def _fastest(values: np.ndarray, sample_time_s: float) -> float:
    """Largest speed over some samples, 0 where there are not so many."""
    moved = np.abs(values[SPEED_SAMPLES:] - values[:-SPEED_SAMPLES])
    moved = moved[np.isfinite(moved)]
    return float(moved.max()) / (SPEED_SAMPLES * sample_time_s) if len(moved) else 0.0


def _highest_pa(plant: Plant, recordings: Sequence[Recording]) -> float:
    names = {n for r in recordings for n in r.channels if n.endswith("pressure_pa")}
    recorded = [_range(name, [r for r in recordings if name in r.channels])[1] for name in names]
    supplied = plant.values.get("supply.pressure_pa", 0.0)
    return HIGHER * max([*recorded, supplied]) if recorded or supplied else inf
