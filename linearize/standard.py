"""The standard modes of each plant: where its signals are cut, and where the points lie.

Source: physics.md 4.2 (gearbox) and 4.3 (all others).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from linearize.axes import DRIVE, drive_axis, joint_axes, rig_axis, travel_axis
from linearize.cylinder_modes import place_modes
from linearize.cylinder_modes import regime_modes as modes_by_regime
from linearize.equilibrium import NoOperatingPointError, OperatingPoint
from linearize.leg_modes import joint_modes, leg_modes, leg_regimes
from linearize.modes import HybridModel, Interval, hybrid_modes
from linearize.reduction import DesignModel, design_model
from linearize.shift_modes import gearbox_modes
from linearize.vessel_modes import bellows, filling_modes, reservoir
from workbench.errors import InputError, Message, UnknownNameError
from workbench.plant import Plant
from workbench.plant_files import as_it_came
from workbench.units import public_name

POSITION, VELOCITY = DRIVE.position, DRIVE.velocity
PRESSURES = DRIVE.pressures
COMMAND = DRIVE.command

SUPPLY = "supply.pressure_pa"


def servo_drive_cuts(plant: Plant) -> dict[str, tuple[Interval, ...]]:
    """Valve x friction x thirds of the stroke: 27 modes.

    Source: physics.md 4.3 (valve and friction); thirds because stiffness goes with 1 / volume.
    """
    axis = drive_axis(plant)
    return {
        COMMAND: axis.valve_cut(),
        VELOCITY: axis.friction_cut(),
        POSITION: axis.place_cut(),
    }


def servo_drive_point(model: DesignModel, box: Mapping[str, Interval]) -> OperatingPoint:
    """See :meth:`linearize.axis.Axis.point`."""
    return drive_axis(model.plant).point(model, box)


def _servo_drive(plant: Plant) -> HybridModel:
    return hybrid_modes(plant, servo_drive_cuts(plant), servo_drive_point)


def _servo_drive_regimes(plant: Plant) -> HybridModel:
    return modes_by_regime(plant, drive_axis(plant), design_model(plant))


def _crr_rig(plant: Plant) -> HybridModel:
    return modes_by_regime(plant, rig_axis(plant), design_model(plant))


def _crr_arm(plant: Plant) -> HybridModel:
    return place_modes(plant, travel_axis(plant), design_model(plant))


def _crr_leg(plant: Plant) -> HybridModel:
    return leg_modes(plant, joint_axes(plant))


def _crr_leg_regimes(plant: Plant) -> HybridModel:
    return leg_regimes(plant, joint_axes(plant))


def _soft_joint(plant: Plant) -> HybridModel:
    return filling_modes(plant, bellows(plant))


def _servo_reservoir(plant: Plant) -> HybridModel:
    return filling_modes(plant, reservoir(plant))


SLIDE_MODES: dict[str, Callable[[Plant], HybridModel]] = {"servo_drive": _servo_drive}
"""Plants with a slide behind a proportional valve, which the controllers are designed on."""


def _travel(plant: Plant) -> HybridModel:
    """Friction x place, the axis sliding steadily or resting at each point."""
    axis = travel_axis(plant)
    cuts = {axis.velocity: axis.friction_cut(), axis.position: axis.place_cut()}
    return hybrid_modes(plant, cuts, axis.point)


def _joints(plant: Plant) -> HybridModel:
    return joint_modes(plant, joint_axes(plant))


AXIS_MODES: dict[str, Callable[[Plant], HybridModel]] = {
    **SLIDE_MODES,
    "crr_rig": _travel,
    "crr_arm": _travel,
}
"""Plants with one axis between two chambers, whatever its units."""

JOINT_MODES: dict[str, Callable[[Plant], HybridModel]] = {"crr_leg": _joints}
"""Plants with several joints, each with its own cylinder."""

VESSEL_MODES: dict[str, Callable[[Plant], HybridModel]] = {"soft_joint": _soft_joint}
"""Plants whose pressure is controlled."""

SHIFT_MODES: dict[str, Callable[[Plant], HybridModel]] = {"gearbox": gearbox_modes}
"""Plants that switching valves shift from one dedicated position to another."""

STANDARD_MODES: dict[str, Callable[[Plant], HybridModel]] = {
    **SLIDE_MODES,
    **SHIFT_MODES,
    "crr_rig": _crr_rig,
    "crr_arm": _crr_arm,
    "crr_leg": _crr_leg,
    "soft_joint": _soft_joint,
    "soft_joint_parametric": _soft_joint,
    "servo_reservoir": _servo_reservoir,
}

REGIME_MODES: dict[str, Callable[[Plant], HybridModel]] = {
    "servo_drive": _servo_drive_regimes,
    "crr_rig": _crr_rig,
    "crr_leg": _crr_leg_regimes,
}
"""Valve x flow regimes x friction x stops, for plants whose standard modes may be fewer."""


def standard_modes(plant: Plant) -> HybridModel:
    """The standard modes of a plant.

    Raises
    ------
    UnknownNameError
        If its kind has none.
    """
    return _among(STANDARD_MODES, plant, "no standard modes for")


def regime_modes(plant: Plant) -> HybridModel:
    """Valve x flow regimes x friction x {free, stops}: more modes than the standard ones.

    Raises
    ------
    UnknownNameError
        If its kind has none.
    """
    return _among(REGIME_MODES, plant, "no modes by flow regimes for")


def slide_modes(plant: Plant) -> HybridModel:
    """The standard modes of a plant whose slide a controller is to position.

    Raises
    ------
    UnknownNameError
        If it has no such slide.
    """
    return _among(SLIDE_MODES, plant, "no modes to position a slide with for")


def axis_modes(plant: Plant) -> HybridModel:
    """Modes by direction of sliding and place of a plant with one axis, and its standard modes.

    Raises
    ------
    UnknownNameError
        If it has no such axis.
    """
    return _among(AXIS_MODES, plant, "no modes to control one axis with for")


def leg_joint_modes(plant: Plant) -> HybridModel:
    """Modes of each joint of a plant with several, the others at rest.

    Raises
    ------
    UnknownNameError
        If it has no such joints.
    """
    return _among(JOINT_MODES, plant, "no modes to control several joints with for")


def vessel_modes(plant: Plant) -> HybridModel:
    """The standard modes of a plant whose pressure is controlled.

    Raises
    ------
    UnknownNameError
        If it has none.
    """
    return _among(VESSEL_MODES, plant, "no modes to control a pressure with for")


def shift_modes(plant: Plant) -> HybridModel:
    """The standard modes of a plant that switching valves shift.

    Raises
    ------
    UnknownNameError
        If it has no such valves.
    """
    return _among(SHIFT_MODES, plant, "no modes to shift gears with for")


def _among(
    known: dict[str, Callable[[Plant], HybridModel]], plant: Plant, none: str
) -> HybridModel:
    """The modes of a plant; where one has no point, and more supply would do, that is said."""
    if plant.name not in known:
        names = ", ".join(known)
        raise UnknownNameError(f"{none} {plant.name}; there are some for {names}")
    try:
        return known[plant.name](plant)
    except NoOperatingPointError as error:
        enough_pa = _enough_pa(known[plant.name], plant)
        if enough_pa is None:
            raise
        said = str(error.args[0]).splitlines()[0]
        what = f"{plant.values[SUPPLY] / 1e5:.4g} bar is too low to move: {said}"
        expected = f"more, as {enough_pa / 1e5:.4g} bar"
        raise InputError(Message(what, public_name(SUPPLY), expected)) from error


def _enough_pa(modes: Callable[[Plant], HybridModel], plant: Plant) -> float | None:
    """The supply that the plant comes with, where it is higher and alone makes its modes."""
    usual_pa = as_it_came(plant).values.get(SUPPLY, 0.0)
    if plant.values.get(SUPPLY, usual_pa) >= usual_pa:
        return None
    try:
        modes(plant.with_values({SUPPLY: usual_pa}))
    except NoOperatingPointError:
        return None
    return usual_pa
