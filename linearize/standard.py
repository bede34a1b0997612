"""The standard modes of each plant: where its signals are cut, and where the points lie."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf

from linearize.equilibrium import OperatingPoint, operating_point
from linearize.modes import HybridModel, Interval, hybrid_modes
from linearize.reduction import DesignModel, closed_command
from linearize.shift_modes import gearbox_modes
from workbench.effects.forces import EndStops
from workbench.errors import UnknownNameError
from workbench.plant import Plant

POSITION, VELOCITY = "slide.position_m", "slide.velocity_m_s"
PRESSURES = ("chamber_a.pressure_pa", "chamber_b.pressure_pa")
COMMAND = "valve.command_v"

SUPPLY = "supply.pressure_pa"

SLIDING_M_S = 0.1  # four Stribeck velocities: dry friction is Coulomb's alone
RESTING_M_S = 1e-3
CLOSED_V, OPEN_V = 0.01, 0.2  # from the valve's centre, behind the dead zone


def stroke_m(plant: Plant) -> float:
    """Where the slide meets its far end stop.

    Raises
    ------
    ValueError
        If nothing ends the stroke.
    """
    ends = [float(e.upper_m) for e in plant.effects if isinstance(e, EndStops)]
    if not ends:
        raise ValueError(f"{plant.name} has no end stops; expected end_stops among its effects")
    return ends[0]


def servo_drive_cuts(plant: Plant) -> dict[str, tuple[Interval, ...]]:
    """Valve x friction x thirds of the stroke: 27 modes.

    Source: physics.md 4.3 (valve and friction); thirds because stiffness goes with 1 / volume.
    """
    centre_v = closed_command(plant)
    third_m = stroke_m(plant) / 3.0
    low_v, high_v = centre_v - CLOSED_V, centre_v + CLOSED_V
    return {
        COMMAND: (
            Interval("charge b", -inf, low_v, centre_v - OPEN_V),
            Interval("closed", low_v, high_v, centre_v),
            Interval("charge a", high_v, inf, centre_v + OPEN_V),
        ),
        VELOCITY: (
            Interval("slide -", -inf, -RESTING_M_S, -SLIDING_M_S),
            Interval("stick", -RESTING_M_S, RESTING_M_S, 0.0, holds=(POSITION, VELOCITY)),
            Interval("slide +", RESTING_M_S, inf, SLIDING_M_S),
        ),
        POSITION: (
            Interval("near a", -inf, third_m, 0.5 * third_m),
            Interval("middle", third_m, 2.0 * third_m, 1.5 * third_m),
            Interval("near b", 2.0 * third_m, inf, 2.5 * third_m),
        ),
    }


def servo_drive_point(model: DesignModel, box: Mapping[str, Interval]) -> OperatingPoint:
    """Steady sliding in the direction of the box; at rest the pressures of the closed valve.

    Where the valve drives against the motion there is no steady state: the pressures are those of
    the steady slide, the command is the interval's, and the drift says how fast it brakes.
    """
    points = {name: interval.point for name, interval in box.items()}
    if points[VELOCITY] == 0.0:
        closed = {**points, COMMAND: closed_command(model.plant)}
        found = operating_point(model, closed, PRESSURES, PRESSURES)
    else:
        sliding = {name: points[name] for name in (POSITION, VELOCITY)}
        vanish = (VELOCITY, *PRESSURES)
        found = operating_point(model, sliding, (COMMAND, *PRESSURES), vanish)
        if box[COMMAND].lower <= found.command[0] < box[COMMAND].upper:
            return found
    at = dict(zip(model.states, found.state, strict=True))
    return operating_point(model, {**at, COMMAND: points[COMMAND]})


def _servo_drive(plant: Plant) -> HybridModel:
    return hybrid_modes(plant, servo_drive_cuts(plant), servo_drive_point)


SLIDE_MODES: dict[str, Callable[[Plant], HybridModel]] = {"servo_drive": _servo_drive}
"""Plants with a slide behind a proportional valve, which the controllers are designed on."""

STANDARD_MODES: dict[str, Callable[[Plant], HybridModel]] = SLIDE_MODES | {"gearbox": gearbox_modes}


def standard_modes(plant: Plant) -> HybridModel:
    """The standard modes of a plant.

    Raises
    ------
    UnknownNameError
        If its kind has none.
    """
    return _among(STANDARD_MODES, plant, "no standard modes for")


def slide_modes(plant: Plant) -> HybridModel:
    """The standard modes of a plant whose slide a controller is to position.

    Raises
    ------
    UnknownNameError
        If it has no such slide.
    """
    return _among(SLIDE_MODES, plant, "no modes to position a slide with for")


def _among(
    known: dict[str, Callable[[Plant], HybridModel]], plant: Plant, none: str
) -> HybridModel:
    if plant.name not in known:
        names = ", ".join(known)
        raise UnknownNameError(f"{none} {plant.name}; there are some for {names}")
    return known[plant.name](plant)
