"""The axes of the plants: their names, and where their ranges are cut.

Speeds, openings and places are *chosen*: sliding is several Stribeck velocities, so that dry
friction is Coulomb's alone; resting is below the speed of its peak.

Source: physics.md 2.1 to 2.4 (valves, strokes, ranges of the joints) and 4.3.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linearize.axis import Axis
from linearize.reduction import closed_command
from workbench.effects.forces import EndStops
from workbench.linkage import Joint, JointRod
from workbench.plant import Plant

SWEPT = 20001  # angles at which a rod's place is known

DRIVE = Axis(
    position="slide.position_m",
    velocity="slide.velocity_m_s",
    pressures=("chamber_a.pressure_pa", "chamber_b.pressure_pa"),
    command="valve.command_v",
    centre=4.95,
    middle=0.01,  # behind the dead zone
    opening=0.2,
    resting=1e-3,
    sliding=0.1,  # four Stribeck velocities
    ends=(0.0, 0.29),
    valves=("charge b", "closed", "charge a"),
    places=("near a", "middle", "near b"),
    shut=True,
)

RIG = Axis(
    position="rod.position_m",
    velocity="rod.velocity_m_s",
    pressures=("cap.pressure_pa", "rod_side.pressure_pa"),
    command="valve.command_v",
    centre=5.25,
    middle=0.2,  # the input pressure has not left its middle by a third of the way to either end
    opening=0.5,
    resting=1e-3,  # the peak of friction lies at 1.4 mm/s (physics.md 2.1)
    sliding=0.1,
    ends=(0.0, 0.1524),
    valves=("charge rod side", "centred", "charge cap"),
    places=("near cap end", "middle", "near rod end"),
)

JOINT = replace(
    RIG,
    position="joint.angle_rad",
    velocity="joint.velocity_rad_s",
    resting=0.02,  # 0.8 mm/s at the rod
    sliding=0.5,
    ends=(0.3, 1.65),
    places=("low", "mid", "high"),
)


def stroke_m(plant: Plant) -> float:
    """Where the slide meets its far end stop.

    Raises
    ------
    ValueError
        If nothing ends the stroke.
    """
    return _ends_m(plant)[1]


def drive_axis(plant: Plant) -> Axis:
    """The slide of the servo drive."""
    return _of(plant, DRIVE, _ends_m(plant))


def rig_axis(plant: Plant) -> Axis:
    """The rod of the rescue robot's rig."""
    return _of(plant, RIG, _ends_m(plant))


def travel_axis(plant: Plant) -> Axis:
    """The one axis of a plant: its slide, its rod or its joint.

    Raises
    ------
    ValueError
        If it has no single one.
    """
    if plant.measured[0] == DRIVE.position:
        return drive_axis(plant)
    if plant.measured[0] == RIG.position:
        return rig_axis(plant)
    (axis,) = joint_axes(plant)
    return axis


def joint_axes(plant: Plant) -> tuple[Axis, ...]:
    """Every joint that a cylinder turns; of several the labels begin with a number."""
    joints = [part for part in plant.parts if isinstance(part, Joint)]
    return tuple(_joint_axis(plant, joint) for joint in joints)


def _joint_axis(plant: Plant, joint: Joint) -> Axis:
    (rod,) = (p for p in plant.parts if isinstance(p, JointRod) and p.name == joint.rod)
    suffix = joint.name.removeprefix("joint")
    start = -float(rod.datum_rad)  # where the rod is shortest; half a turn on it is longest
    angles_rad = np.linspace(start, start + np.pi, SWEPT)
    places_m = np.array([float(rod.position_m(angle)) for angle in angles_rad])
    low_rad, high_rad = np.interp(_ends_m(plant, rod.name), places_m, angles_rad)
    named = replace(
        JOINT,
        position=f"{joint.name}.angle_rad",
        velocity=f"{joint.name}.velocity_rad_s",
        pressures=(f"cap{suffix}.pressure_pa", f"rod_side{suffix}.pressure_pa"),
        command=f"valve{suffix}.command_v",
        prefix=f"{suffix.removeprefix('_')} " if suffix else "",
    )
    return _of(plant, named, (float(low_rad), float(high_rad)))


def _of(plant: Plant, axis: Axis, ends: tuple[float, float]) -> Axis:
    """The axis with the valve's centre and the ends of its range as this plant has them."""
    return replace(axis, ends=ends, centre=closed_command(plant, axis.command))


def _ends_m(plant: Plant, body: str = "") -> tuple[float, float]:
    stops = [e for e in plant.effects if isinstance(e, EndStops) and body in ("", e.body)]
    if not stops:
        raise ValueError(f"{plant.name} has no end stops; expected end_stops among its effects")
    return float(stops[0].lower_m), float(stops[0].upper_m)
