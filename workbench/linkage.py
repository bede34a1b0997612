"""Joints that cylinders turn: where a rod stands, how its force becomes a torque, what moves.

A joint has an angle and an angular velocity.  Its cylinder's rod has no state of its own: position,
velocity and lever follow from the angle, so chambers, friction and stops act on the rod as on any
other body, and the joint takes what the rod receives as a torque.  A linkage knows the masses and
turns torques into accelerations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.balances import BalanceEquation
from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Expression,
    Force,
    Part,
    Received,
    State,
    Torque,
    form,
    strength,
)
from workbench.parts import total

TURNING = BalanceEquation(
    balance=Balance.MOMENTUM,
    kind=Torque,
    term="torque_n_m",
    state="velocity_rad_s",
    rates=(20.0, 100.0),
)
SHORTEST_M = 1e-3  # a cylinder of no length has no direction; geometry never comes near


@dataclass(frozen=True, kw_only=True)
class Joint(Part):
    """One degree of freedom: it collects torques, its own and those of its rod.

    tau = sum of torques + r(theta) sum of forces on the rod

    Source: papers 000 and 001 (the actuator's force becomes a torque by the instantaneous
    geometry); physics.md 2.2.
    """

    balances = (TURNING,)

    rod: str
    linkage: str
    initial_angle_rad: float = 0.0

    def states(self) -> Iterator[State]:
        yield State("angle_rad", self.initial_angle_rad, scale=1.0, tolerance=5e-7)
        yield State("velocity_rad_s", initial=0.0, scale=1.0, tolerance=1e-2)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        angle_rad = seen.get(f"{self.name}.angle_rad")
        if angle_rad is None:
            return {}
        found = {"angle_rad": (angle_rad, 1e-3)}
        velocity_rad_s = seen.get(f"{self.name}.velocity_rad_s")
        return (
            found if velocity_rad_s is None else found | {"velocity_rad_s": (velocity_rad_s, 0.1)}
        )

    def close(self, now: Conditions, received: Received) -> dict[str, Expression]:
        own = total(received(self.name), Torque)
        return {"torque_n_m": own + now[self.rod].lever_m * total(received(self.rod), Force)}

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        return {
            "angle_rad": now[self.name].velocity_rad_s,
            "velocity_rad_s": now.read(f"{self.linkage}.{self.name}_acceleration_rad_s2"),
        }


@dataclass(frozen=True, kw_only=True)
class HeldJoint(Joint):
    """A joint whose motion another computer integrates: angle and velocity are measured inputs.

    What it collects is the torque to be sent there, without the inertia of the link (E001-5).

    Source: paper 001 Eq. 4 and its co-simulation; physics.md 2.2.
    """

    linkage: str = ""

    def states(self) -> Iterator[State]:
        return iter(())

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        return {}


@dataclass(frozen=True, kw_only=True)
class TorqueSource(Part):
    """A torque on a joint that is a measured input, for example from another computer.

    Source: paper 001, co-simulation.
    """

    joint: str

    def terms(self, now: Conditions) -> Iterator[Torque]:
        yield Torque(self.joint, now[self.name].torque_n_m)


@dataclass(frozen=True, kw_only=True)
class JointRod(Part):
    """The rod of a cylinder between two links, at a and b from the joint.

    L = sqrt(a^2 + b^2 - 2 a b cos(theta + phi_0)),   x = L - L_min
    r = dL/dtheta = a b sin(theta + phi_0) / L,       v = r omega

    Source: physics.md 2.2; the papers show this geometry in a figure only, so it is chosen.
    """

    joint: str
    base_m: Expression = form(0.17, lower=1e-3)
    arm_m: Expression = form(0.045, lower=1e-3)
    datum_rad: Expression = form(0.5, lower=-7.0, upper=7.0)
    shortest_m: Expression = form(0.14, lower=1e-3)

    def length_m(self, angle_rad: Expression) -> Expression:
        """L at an angle of the joint."""
        a, b = self.base_m, self.arm_m
        squared = a**2 + b**2 - 2.0 * a * b * ca.cos(angle_rad + self.datum_rad)
        return ca.sqrt(ca.fmax(squared, SHORTEST_M**2))

    def position_m(self, angle_rad: Expression) -> Expression:
        """X at an angle of the joint."""
        return self.length_m(angle_rad) - self.shortest_m

    def lever_m(self, angle_rad: Expression) -> Expression:
        """R at an angle of the joint."""
        turned = ca.sin(angle_rad + self.datum_rad)
        return self.base_m * self.arm_m * turned / self.length_m(angle_rad)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        """Its motion, for the members whose guess needs it: it has no state of its own."""
        angle_rad = seen.get(f"{self.joint}.angle_rad")
        speed_rad_s = seen.get(f"{self.joint}.velocity_rad_s")
        if angle_rad is None or speed_rad_s is None:
            return {}
        position_m, lever_m = (
            ca.DM(each(angle_rad)).full().ravel() for each in (self.position_m, self.lever_m)
        )
        return {"position_m": (position_m, 2e-5), "velocity_m_s": (lever_m * speed_rad_s, 1e-2)}

    def derive(self, now: Conditions) -> dict[str, Expression]:
        joint = now[self.joint]
        lever_m = self.lever_m(joint.angle_rad)
        return {
            "lever_m": lever_m,
            "position_m": self.position_m(joint.angle_rad),
            "velocity_m_s": lever_m * joint.velocity_rad_s,
        }


@dataclass(frozen=True, kw_only=True)
class Link(Part):
    """One link that turns about one joint, with a payload at its end.

    J = m L^2/3 + J_0 + dm L^2,    omega' = tau / J

    The angle counts from the horizontal.  ``along`` is how far the weights lie out sideways, mass
    times distance, and ``across`` how far up: what gravity needs to know.  A payload is an effect
    and no shift of the mass m: it counts with L^2 where that counts with L^2/3.

    Source: physics.md 2.2 (masses chosen: a light tube; J_0 for what sits at the joint).
    """

    causes = (
        Cause(
            name="added_mass",
            strength="added_mass_kg",
            balance=Balance.MOMENTUM,
            drivers=("acceleration", "angle"),
            shown_by="slow sweep of the joint, and fast steps",
            source="physics.md section 6 (payload)",
        ),
    )

    joint: str
    mass_kg: Expression = form(0.5, lower=1e-3, relative_deviation=0.05)
    length_m: Expression = form(0.3048, lower=1e-3)
    hub_inertia_kg_m2: Expression = form(0.003, relative_deviation=0.05)
    added_mass_kg: Expression = strength(typical=0.3, upper=3.0)

    @property
    def inertia_kg_m2(self) -> Expression:
        """J about the joint."""
        tip_kg_m2 = self.added_mass_kg * self.length_m**2
        return self.mass_kg * self.length_m**2 / 3.0 + self.hub_inertia_kg_m2 + tip_kg_m2

    def derive(self, now: Conditions) -> dict[str, Expression]:
        angle_rad = now[self.joint].angle_rad
        moment_kg_m = (self.mass_kg / 2.0 + self.added_mass_kg) * self.length_m
        return {
            f"{self.joint}_along_kg_m": moment_kg_m * ca.cos(angle_rad),
            f"{self.joint}_across_kg_m": moment_kg_m * ca.sin(angle_rad),
        }

    def close(self, now: Conditions, received: Received) -> dict[str, Expression]:
        acceleration = now[self.joint].torque_n_m / self.inertia_kg_m2
        return {f"{self.joint}_acceleration_rad_s2": acceleration}
