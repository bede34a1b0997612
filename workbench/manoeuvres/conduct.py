"""How a manoeuvre is played, as a person at the rig has to know it.

Where it starts, since a prediction begins at the plant's own initial state and not where recordings
began; how fast it comes to the stops; and the position loop that it was rehearsed with
(:mod:`workbench.manoeuvres.rehearse`).  Commands of a loop alone, played open loop, drift away from
their reference: a position integrates them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from workbench.manoeuvres.limits import Limits
from workbench.manoeuvres.rehearse import SpeedMap, bandwidth_rad_s, rest_within, update_s
from workbench.manoeuvres.stops import near_stop, stops_of
from workbench.plant import Plant
from workbench.recording import Recording

APPROACH_S = 10e-3  # before a stop, over which a speed is taken: predictions have no noise


@dataclass(frozen=True)
class Start:
    """Where an output has to be at the start, and where it was at that of each recording; in SI."""

    at: float
    recorded: tuple[float, ...]


@dataclass(frozen=True)
class Contact:
    """A stop that an output comes to, to within ``within``, and the fastest that any rival does.

    ``at`` is the stop; all in SI.
    """

    output: str
    at: float
    within: float
    speed: float


@dataclass(frozen=True)
class Loop:
    """The position loop: v = dr/dt + w (r - y), and the command that gives this speed.

    Without a reference it is off, and the command rests.

    Attributes
    ----------
    bandwidth_rad_s
        w.
    update_s
        From one command to the next.
    maps
        The speed maps, here and below by output of the axis.
    fastest
        What v is limited to either way, in m/s or rad/s.
    rest_within
        How near to a resting reference the resting command is given, in m or rad.
    """

    bandwidth_rad_s: float
    update_s: float
    maps: Mapping[str, SpeedMap]
    fastest: Mapping[str, float]
    rest_within: Mapping[str, float]


@dataclass(frozen=True)
class Conduct:
    """How a manoeuvre is played; see the module.

    Attributes
    ----------
    starts
        By output: the axes, or all outputs where commands move no positions.
    contacts
        With the stops that any rival comes to.
    loop
        None where commands are played as they are.
    """

    starts: Mapping[str, Start]
    contacts: tuple[Contact, ...] = ()
    loop: Loop | None = None


def conduct(
    limits: Limits,
    plant: Plant,
    predicted: Sequence[Recording],
    recorded: Sequence[Recording],
    maps: Sequence[SpeedMap] = (),
) -> Conduct:
    """How what was predicted is played, after what was recorded.

    ``predicted`` are the rivals' recordings, the likeliest first; ``maps`` those of the axes where
    a loop acts, in their order.
    """
    first = predicted[0]
    names = [axis.output for axis in limits.axes] or plant.measured
    return Conduct(
        starts={n: Start(float(first[n][0]), tuple(_first(r[n]) for r in recorded)) for n in names},
        contacts=tuple(c for n in plant.measured for c in _contacts(n, plant, predicted)),
        loop=_loop(limits, maps) if maps else None,
    )


def _loop(limits: Limits, maps: Sequence[SpeedMap]) -> Loop:
    """The loop as it was rehearsed."""
    return Loop(
        bandwidth_rad_s(limits),
        update_s(limits),
        maps={axis.output: speeds for axis, speeds in zip(limits.axes, maps, strict=True)},
        fastest={axis.output: axis.speed for axis in limits.axes},
        rest_within={axis.output: rest_within(axis) for axis in limits.axes},
    )


def _first(values: np.ndarray) -> float:
    """The first value that was recorded, NaN without any."""
    seen = values[np.isfinite(values)]
    return float(seen[0]) if len(seen) else float("nan")


def _contacts(output: str, plant: Plant, predicted: Sequence[Recording]) -> list[Contact]:
    """The stops that an output comes to."""
    stops = stops_of(plant, output)
    near = near_stop(stops)
    if not isfinite(near):
        return []
    found = []
    for stop, side in zip(stops, (1.0, -1.0), strict=True):
        rooms = [side * (each[output] - stop) for each in predicted]
        dt = predicted[0].sample_time_s
        speeds = [speed for room in rooms for speed in _approaches(room, near, dt)]
        if speeds:
            found.append(Contact(output, stop, near, float(np.fmax.reduce(speeds))))
    return found


def _approaches(room: np.ndarray, near: float, sample_time_s: float) -> list[float]:
    """Speeds at which ``room``, what is left to a stop at each sample, falls below ``near``."""
    close = room < near
    met = np.flatnonzero(close[1:] & ~close[:-1]) + 1
    before = np.maximum(met - max(round(APPROACH_S / sample_time_s), 1), 0)
    return [float(v) for v in np.abs(room[met] - room[before]) / ((met - before) * sample_time_s)]
