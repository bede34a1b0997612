"""What acts on joints besides their cylinders: the weight of the links, friction of the bearing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca

from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Effect,
    Expression,
    Torque,
    form,
    strength,
)


@dataclass(frozen=True, kw_only=True)
class LinkGravity(Effect):
    """The weight of a linkage on its joints.

    tau = -g sum(m l cos(theta + delta)) = -g (cos(delta) along - sin(delta) across)

    with ``along`` and ``across`` of the linkage, and delta the error of the angles' datum.

    Source: papers 000 and 001 (arm); physics.md 2.2, 2.3; the datum is chosen, 001 gives none.
    """

    causes = (
        Cause(
            name="link_gravity",
            strength="gravity_m_s2",
            forms=("datum_rad",),
            balance=Balance.MOMENTUM,
            drivers=("angle",),
            shown_by="slow sweep of the joint over its whole range",
            source="physics.md 2.2, 2.3 and section 6 (gravity)",
        ),
    )

    linkage: str
    joints: tuple[str, ...]

    gravity_m_s2: Expression = strength(typical=9.81, upper=20.0, relative_deviation=0.0)
    datum_rad: Expression = form(0.0, lower=-3.2, upper=3.2, deviation=0.1)

    def terms(self, now: Conditions) -> Iterator[Torque]:
        for joint in self.joints:
            along = now.read(f"{self.linkage}.{joint}_along_kg_m")
            across = now.read(f"{self.linkage}.{joint}_across_kg_m")
            out_kg_m = ca.cos(self.datum_rad) * along - ca.sin(self.datum_rad) * across
            yield Torque(joint, -self.gravity_m_s2 * out_kg_m)


@dataclass(frozen=True, kw_only=True)
class JointFriction(Effect):
    """Viscous friction of a bearing: tau = -b omega.

    No cause of its own (interface.md section 6).

    Source: physics.md 2.2 (b_j, chosen) and section 6 (joint_friction, in the engine of paper 001).
    """

    joint: str
    damping_n_m_s_rad: Expression = strength(typical=0.02, upper=10.0)

    def terms(self, now: Conditions) -> Iterator[Torque]:
        yield Torque(self.joint, -self.damping_n_m_s_rad * now[self.joint].velocity_rad_s)
