"""A leg of the rescue robot: three joints, each with its cylinder and valve (paper 001).

The cylinders, valves and friction are those of the rig, the leg is :class:`workbench.leg.Leg`.
Lengths are those of paper 001's DH table (erratum E001-6); masses, radii, cylinder geometry and
ranges are *chosen* (physics.md 2.3): no body is modelled, the base stands still, its axis upright.
The bearings have no friction of their own, so that a leg without cylinders keeps its energy.

Joint 3 is the arm's.  For joints 1 and 2 physics.md 2.3 gives no shortest length of the cylinder:
it is chosen so that, as there, 3.6 mm are left at the lower end of the range.
"""

from __future__ import annotations

from math import radians

from workbench.effects import JointFriction, LinkGravity, SupplyDroop
from workbench.effects.sensors import sensor_flaws
from workbench.leg import Leg
from workbench.linkage import Joint, JointRod
from workbench.plant import Plant, Signal
from workbench.plants.crr_arm import STROKE_M, joint_stops
from workbench.plants.crr_cylinder import SUPPLY_PA, CrrCylinder, network, surroundings

NUMBERS = (1, 2, 3)
JOINTS = ("joint_1", "joint_2", "joint_3")
BASES_M = 0.14, 0.15, 0.17
SHORTEST_M = 0.1127, 0.1155, 0.1395
DATUMS_RAD = radians(90.0), radians(65.0), radians(30.0)
RANGES_RAD = tuple(
    (radians(low), radians(high)) for low, high in ((-40.0, 40.0), (-25.0, 55.0), (17.0, 95.0))
)
START_RAD = radians(0.0), radians(20.0), radians(60.0)


RODS = tuple(
    JointRod(
        name=f"rod_{number}",
        joint=f"joint_{number}",
        base_m=base_m,
        arm_m=0.045,
        datum_rad=datum_rad,
        shortest_m=shortest_m,
    )
    for number, base_m, datum_rad, shortest_m in zip(
        NUMBERS, BASES_M, DATUMS_RAD, SHORTEST_M, strict=True
    )
)
CYLINDERS = tuple(
    CrrCylinder(
        stroke_m=STROKE_M, start_m=float(rod.position_m(angle)), suffix=rod.name.removeprefix("rod")
    )
    for rod, angle in zip(RODS, START_RAD, strict=True)
)
ANGLES = tuple(f"{joint}.angle_rad" for joint in JOINTS)
OUTPUTS = (*ANGLES, *(signal for cylinder in CYLINDERS for signal in cylinder.pressures))
NETWORK = (*(cylinder.command.name for cylinder in CYLINDERS), *OUTPUTS)


def crr_leg() -> Plant:
    """The leg with its three cylinders; what it may lack stands at null."""
    joints = tuple(
        Joint(name=joint, rod=rod.name, linkage="leg", initial_angle_rad=angle)
        for joint, rod, angle in zip(JOINTS, RODS, START_RAD, strict=True)
    )
    return Plant(
        name="crr_leg",
        parts=(
            *surroundings(),
            *RODS,
            *joints,
            Leg(name="leg", joints=JOINTS),
            *(chamber for cylinder in CYLINDERS for chamber in cylinder.parts()),
        ),
        effects=(
            *(effect for cylinder in CYLINDERS for effect in cylinder.effects()),
            *(
                joint_stops(rod, range_rad, name=f"stops@{rod.name}")
                for rod, range_rad in zip(RODS, RANGES_RAD, strict=True)
            ),
            LinkGravity(name="link_gravity", linkage="leg", joints=JOINTS[1:], gravity_m_s2=9.81),
            *(JointFriction(name=f"joint_friction@{joint}", joint=joint) for joint in JOINTS),
            SupplyDroop(name="supply_droop"),
            *network(OUTPUTS, NETWORK),
            *sensor_flaws(dict(zip(ANGLES, START_RAD, strict=True))),
        ),
        commands=tuple(cylinder.command for cylinder in CYLINDERS),
        optional_inputs=(Signal("supply.pressure_pa", nominal=SUPPLY_PA),),
        measured=OUTPUTS,
        optional_outputs=tuple(f"{joint}.velocity_rad_s" for joint in JOINTS),
    )
