"""How each plant's modes are shown: two signals across a map, and a step to run beside the plant.

Openings, speeds and durations are *chosen* so that the plant passes several modes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from linearize.axes import drive_axis, joint_axes, rig_axis
from linearize.axis import Axis
from linearize.leg_modes import leg_placing
from linearize.modes import HybridModel
from linearize.reduction import design_model
from linearize.shifting import FLOWS, POSITION, PRESSURES, VELOCITY
from linearize.stopped import stopped_signals
from linearize.vessel_modes import Filling, bellows, reservoir
from workbench.effects import DeadZone
from workbench.plant import Plant
from workbench.plants.gearbox import COMMANDS, STROKE_M
from workbench.units import display_unit

BEYOND = 0.04  # of a range, to either side
Span = tuple[float, Mapping[str, float]]  # seconds, and what is sent for so long


@dataclass(frozen=True)
class View:
    """Two signals of a map, the values of the others in each panel, and the commands of a step.

    ranges     lower and upper end of the two signals, the one across first
    panels     values of other signals by title
    spans      commands as they are sent, one after the other
    start      state of the plant, with all of its own, where it is not the initial one; (n_x,)
    shown      so many states are drawn
    """

    ranges: Mapping[str, tuple[float, float]]
    panels: Mapping[str, Mapping[str, float]]
    spans: tuple[Span, ...]
    sample_time_s: float = 1e-3
    start: np.ndarray | None = None
    shown: int = 4


def view_of(hybrid: HybridModel) -> View:
    """The view of a plant; its map goes a little beyond the stops where they are modes."""
    view, ranges = VIEWS[hybrid.plant.name](hybrid.plant), {}
    for name, (low, high) in view.ranges.items():
        more = BEYOND * (high - low) if name in stopped_signals(hybrid) else 0.0
        ranges[name] = (low - more, high + more)
    return replace(view, ranges=ranges)


def _band(plant: Plant, command: str) -> float:
    """Half-width of the dead zone that a command has to cross."""
    zones = (e for e in plant.effects if isinstance(e, DeadZone) and e.signal == command)
    return sum(float(zone.half_width_v) for zone in zones)


def _axis_view(plant: Plant, axis: Axis, fast: float, opening: float, open_s: float) -> View:
    """Position and velocity with the valve to either side and centred; a stroke and a stop."""
    below, at, above = axis.centre - opening, axis.centre, axis.centre + opening
    titles = zip(axis.valves, (below, at, above), strict=True)
    unit = display_unit(axis.command)
    sent = above + _band(plant, axis.command)
    return View(
        ranges={axis.position: axis.ends, axis.velocity: (-fast, fast)},
        panels={f"{name}, {value:.2f} {unit}": {axis.command: value} for name, value in titles},
        spans=(
            (0.05, {axis.command: at}),
            (open_s, {axis.command: sent}),
            (0.3, {axis.command: at}),
        ),
    )


def _drive(plant: Plant) -> View:
    return _axis_view(plant, drive_axis(plant), 1.0, 0.35, 0.2)


def _rig(plant: Plant) -> View:
    return _axis_view(plant, rig_axis(plant), 0.5, 0.5, 0.2)


def _arm(plant: Plant) -> View:
    return _axis_view(plant, *joint_axes(plant), 3.0, 0.4, 0.3)


def _leg(plant: Plant) -> View:
    """Angles of the joints in the leg's plane, the first one still; each joint slides in turn.

    All begins at rest, where the pressures carry the leg.
    """
    axes, model = joint_axes(plant), design_model(plant)
    _, second, third = axes
    rest = leg_placing(axes)(model, {})
    values = dict(zip((*model.states, *model.commands), (*rest.state, *rest.command), strict=True))
    speeds = {"joint 2 down": -0.5, "at rest": 0.0, "joint 2 up": 0.5}
    still = {axis.command: values[axis.command] for axis in axes}
    moves = (still | {name: value + 0.3} for name, value in still.items())
    return View(
        ranges={second.position: second.ends, third.position: third.ends},
        panels={title: values | {second.velocity: speed} for title, speed in speeds.items()},
        spans=((0.05, still), *((0.15, sent) for sent in moves), (0.15, still)),
        start=model.full_under(rest.state, rest.command).full().ravel(),
        shown=6,
    )


def _gearbox(plant: Plant) -> View:
    """Position and speed of the main piston; from Neutral to High and back.

    A map's pressures are those after some milliseconds of charging and venting.
    """
    flow_kg_s, pressure_pa = 1e-2, {1: 7e5, -1: 2e5}
    pairs = {
        "1 charges, 2 vents": (1, -1),
        "both charge": (1, 1),
        "1 vents, 2 charges": (-1, 1),
    }
    panels = {
        title: dict(zip(FLOWS, (flow_kg_s * sign for sign in signs), strict=True))
        | dict(zip(PRESSURES, (pressure_pa[sign] for sign in signs), strict=True))
        for title, signs in pairs.items()
    }
    sent = [dict(zip(COMMANDS, values, strict=True)) for values in ((0, 0), (1, 0), (1, 1))]
    return View(
        ranges={POSITION: (-STROKE_M, STROKE_M), VELOCITY: (-2.0, 2.0)},
        panels=panels,
        spans=((0.002, sent[0]), (0.01, sent[1]), (0.01, sent[2])),
        sample_time_s=1e-4,
        shown=6,
    )


def _vessel_view(plant: Plant, filling: Filling, fill_s: float, high_pa: float) -> View:
    low, at, high = (filling.centre + side * filling.opening for side in (-1, 0, 1))
    band = _band(plant, filling.command)
    ranges = {filling.command: (low, high), filling.pressure: (1e5, high_pa)}
    fill, shut, vent = ({filling.command: value} for value in (high + band, at, low - band))
    spans = ((0.1 * fill_s, shut), (fill_s, fill), (0.3 * fill_s, shut), (fill_s, vent))
    return View(ranges, {"": {}}, spans)


def _bellows(plant: Plant) -> View:
    return _vessel_view(plant, bellows(plant), 0.3, 5.5e5)


def _reservoir(plant: Plant) -> View:
    return _vessel_view(plant, reservoir(plant), 1.0, 7e5)


VIEWS: Mapping[str, Callable[[Plant], View]] = {
    "servo_drive": _drive,
    "crr_rig": _rig,
    "crr_arm": _arm,
    "crr_leg": _leg,
    "gearbox": _gearbox,
    "soft_joint": _bellows,
    "soft_joint_parametric": _bellows,
    "servo_reservoir": _reservoir,
}


def sent_commands(view: View, plant: Plant) -> dict[str, np.ndarray]:
    """The commands of the step at samples, by name; each of shape (n,)."""
    counts = [round(length_s / view.sample_time_s) for length_s, _ in view.spans]
    return {
        signal.name: np.repeat(
            [sent.get(signal.name, signal.nominal) for _, sent in view.spans], counts
        ).astype(float)
        for signal in plant.commands
    }
