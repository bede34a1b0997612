"""One joint of the rescue robot's leg: a link with gravity, turned by a cylinder (000, 001).

Cylinder, valve and friction are those of the rig; the rod turns the link through a lever that
varies with the angle.  Papers 000 and 001 show the geometry in a figure only: a, b, phi_0, L_min,
the link's mass and the bearing's damping are *chosen* (physics.md 2.2).  The angle counts from the
horizontal and runs from 17 to 95 degrees, between stops at the rod.

In the papers the actuator runs on one computer and the link on another: :func:`crr_arm_actuator`
and :func:`crr_arm_engine` are these halves, made of the same parts; what passes between them is the
joint's motion and the torque, which carries no inertia of the link (erratum E001-5).
"""

from __future__ import annotations

from math import radians

from workbench.effect import Effect
from workbench.effects import EndStops, JointFriction, LinkGravity, SupplyDroop
from workbench.effects.sensors import sensor_flaws
from workbench.linkage import HeldJoint, Joint, JointRod, Link, TorqueSource
from workbench.plant import Plant, Signal
from workbench.plants.crr_cylinder import SUPPLY_PA, CrrCylinder, network, surroundings

STROKE_M = 0.0635
START_RAD = radians(30.0)
RANGE_RAD = radians(17.0), radians(95.0)
ROD = JointRod(
    name="rod",
    joint="joint",
    base_m=0.170,
    arm_m=0.045,
    datum_rad=radians(30.0),
    shortest_m=0.1395,
)
CYLINDER = CrrCylinder(stroke_m=STROKE_M, start_m=float(ROD.position_m(START_RAD)))
OUTPUTS = ("joint.angle_rad", *CYLINDER.pressures)
MOTION = ("joint.angle_rad", "joint.velocity_rad_s")
NETWORK = (CYLINDER.command.name, *OUTPUTS)


def joint_stops(rod: JointRod, range_rad: tuple[float, float], name: str = "stops") -> EndStops:
    """Stops at the rod where the joint is at the ends of its range; stiffness *chosen*."""
    lower_m, upper_m = (float(rod.position_m(angle)) for angle in range_rad)
    return EndStops(name=name, body=rod.name, stiffness_n_m=2e6, lower_m=lower_m, upper_m=upper_m)


def _link_effects() -> tuple[Effect, ...]:
    return (
        LinkGravity(name="link_gravity", linkage="link", joints=("joint",), gravity_m_s2=9.81),
        JointFriction(name="joint_friction", joint="joint", damping_n_m_s_rad=0.02),
    )


def crr_arm() -> Plant:
    """The arm with its cylinder; what it may lack stands at null."""
    return Plant(
        name="crr_arm",
        parts=(
            *surroundings(),
            ROD,
            Joint(name="joint", rod="rod", linkage="link", initial_angle_rad=START_RAD),
            Link(name="link", joint="joint"),
            *CYLINDER.parts(),
        ),
        effects=(
            *CYLINDER.effects(),
            joint_stops(ROD, RANGE_RAD),
            *_link_effects(),
            SupplyDroop(name="supply_droop"),
            *network(OUTPUTS, NETWORK),
            *sensor_flaws({OUTPUTS[0]: START_RAD}),
        ),
        commands=(CYLINDER.command,),
        optional_inputs=(Signal("supply.pressure_pa", nominal=SUPPLY_PA),),
        measured=OUTPUTS,
        optional_outputs=("joint.velocity_rad_s",),
    )


def crr_arm_actuator() -> Plant:
    """The half on the real-time computer: cylinder and valve, the joint's motion as input."""
    angle, velocity = MOTION
    return Plant(
        name="crr_arm_actuator",
        parts=(
            *surroundings(),
            ROD,
            HeldJoint(name="joint", rod="rod"),
            *CYLINDER.parts(),
        ),
        effects=CYLINDER.effects(),
        commands=(CYLINDER.command,),
        measured_inputs=(Signal(angle, nominal=START_RAD), Signal(velocity, nominal=0.0)),
        measured=("joint.torque_n_m", *CYLINDER.pressures),
    )


def crr_arm_engine() -> Plant:
    """The half in the rigid-body engine: link, gravity and stops, the torque as input."""
    return Plant(
        name="crr_arm_engine",
        parts=(
            ROD,
            Joint(name="joint", rod="rod", linkage="link", initial_angle_rad=START_RAD),
            Link(name="link", joint="joint"),
            TorqueSource(name="drive", joint="joint"),
        ),
        effects=(joint_stops(ROD, RANGE_RAD), *_link_effects()),
        measured_inputs=(Signal("drive.torque_n_m", nominal=0.0),),
        measured=MOTION,
    )
