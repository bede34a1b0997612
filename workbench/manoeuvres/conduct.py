"""How a manoeuvre is played, as a person at the rig has to know it.

Where it starts, since a prediction begins at the plant's own initial state and not where recordings
began; how hard it meets the stops; and the position loop that it was rehearsed with
(:mod:`workbench.manoeuvres.rehearse`).  Commands of a loop alone, played open loop, drift away from
their reference: a position integrates them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from workbench.manoeuvres.limits import SPEED_SAMPLES, Axis, Limits
from workbench.manoeuvres.rehearse import SpeedMap, bandwidth_rad_s
from workbench.recording import Recording

NEAR = 3e-3  # of the stroke: closer to a stop a body is taken to meet it


@dataclass(frozen=True)
class Start:
    """Where an output has to be at the start, and where it was at that of each recording; in SI."""

    at: float
    recorded: tuple[float, ...]


@dataclass(frozen=True)
class Contact:
    """A stop of an axis that is met, at ``at``, and the fastest approach of any rival; in SI."""

    output: str
    at: float
    speed: float


@dataclass(frozen=True)
class Loop:
    """The position loop: v = dr/dt + w (r - y), and the command that gives this speed.

    ``maps`` are the speed maps by output of the axis; w is in rad/s.
    """

    bandwidth_rad_s: float
    maps: Mapping[str, SpeedMap]


@dataclass(frozen=True)
class Conduct:
    """How a manoeuvre is played; see the module.

    Attributes
    ----------
    starts
        By output: the axes, or all outputs where commands move no positions.
    contacts
        Of the stops that any rival meets.
    loop
        None where commands are played as they are.
    """

    starts: Mapping[str, Start]
    contacts: tuple[Contact, ...] = ()
    loop: Loop | None = None


def conduct(
    limits: Limits,
    outputs: Sequence[str],
    predicted: Sequence[Recording],
    recorded: Sequence[Recording],
    maps: Sequence[SpeedMap] = (),
) -> Conduct:
    """How what was predicted is played, after what was recorded.

    ``outputs`` are the measured ones, by full name; ``predicted`` are the rivals' recordings, the
    likeliest first; ``maps`` those of the axes where a loop acts, in their order.
    """
    axes = [axis.output for axis in limits.axes]
    first = predicted[0]
    names = axes or outputs
    return Conduct(
        starts={n: Start(float(first[n][0]), tuple(_first(r[n]) for r in recorded)) for n in names},
        contacts=tuple(c for axis in limits.axes for c in _contacts(axis, predicted)),
        loop=Loop(bandwidth_rad_s(limits), dict(zip(axes, maps, strict=True))) if maps else None,
    )


def _first(values: np.ndarray) -> float:
    """The first value that was recorded, NaN without any."""
    seen = values[np.isfinite(values)]
    return float(seen[0]) if len(seen) else float("nan")


def _contacts(axis: Axis, predicted: Sequence[Recording]) -> list[Contact]:
    """The stops of an axis that are met."""
    stroke = axis.stops[1] - axis.stops[0]
    if not isfinite(stroke):
        return []
    found = []
    for stop, side in zip(axis.stops, (1.0, -1.0), strict=True):
        speeds = [s for each in predicted for s in _approaches(each, axis, stop, side)]
        if speeds:
            found.append(Contact(axis.output, stop, max(speeds)))
    return found


def _approaches(predicted: Recording, axis: Axis, stop: float, side: float) -> list[float]:
    """Speeds at which a stop is met in one prediction; ``side`` is 1 for the lower one, else -1."""
    room = side * (predicted[axis.output] - stop)
    near = room < NEAR * (axis.stops[1] - axis.stops[0])
    met = np.flatnonzero(near[1:] & ~near[:-1]) + 1
    before = np.maximum(met - SPEED_SAMPLES, 0)
    lasted_s = (met - before) * predicted.sample_time_s
    return [float(v) for v in np.abs(room[met] - room[before]) / lasted_s]
