"""Forces on a body besides friction and chambers: constant, rod end, spring, cushion, end stops."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import casadi as ca

from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Effect,
    Expression,
    Force,
    form,
    strength,
)

LONGEST_CUSHION = 0.4  # of the stroke at either end, chosen


def push_n(
    depth_m: Expression,
    depth_rate_m_s: Expression,
    stiffness_n_m: Expression,
    damping_n_s_m: Expression,
) -> Expression:
    """Contact force, never pulling: max(0, s depth + d rate) for depth > 0, else 0.

    Without stiffness there is no damping either.

    Source: physics.md 1.4; paper 003 Eqs. 9 and 11, which may pull while separating (E003-6).
    """
    present = ca.fmin(stiffness_n_m, 1.0)
    force_n = stiffness_n_m * depth_m + present * damping_n_s_m * depth_rate_m_s
    return ca.if_else(depth_m > 0, ca.fmax(force_n, 0.0), 0.0)


@dataclass(frozen=True, kw_only=True)
class ConstantForce(Effect):
    """Gravity along an inclined axis, a preload, a hanging load: F = F_0, signed.

    Source: physics.md section 6 (gravity / incline).
    """

    causes = (
        Cause(
            name="constant_force",
            strength="force_n",
            balance=Balance.MOMENTUM,
            drivers=("nothing: it is constant",),
            shown_by="hold at rest, both chambers vented, in two orientations",
            source="physics.md section 6 (gravity / incline)",
        ),
    )

    body: str
    force_n: Expression = strength(typical=22.0, lower=-500.0, upper=500.0)

    def terms(self, now: Conditions) -> Iterator[Force]:
        yield Force(self.body, self.force_n)


@dataclass(frozen=True, kw_only=True)
class Weight(Effect):
    """The weight of a body that moves vertically upwards: F = -M g, with what is added to it.

    Source: physics.md 2.7, ``vertical_cylinder``.
    """

    body: str
    gravity_m_s2: Expression = form(9.81, lower=0.0)

    def terms(self, now: Conditions) -> Iterator[Force]:
        yield Force(self.body, -now[self.body].moving_mass_kg * self.gravity_m_s2)


@dataclass(frozen=True, kw_only=True)
class RodEnd(Effect):
    """The atmosphere on the end of a rod that leaves the cylinder: F = -P_E A_rod.

    Source: papers 000 and 001 (force balance); physics.md 2.1.
    """

    body: str
    area_m2: Expression = form(5e-5, lower=0.0)

    def terms(self, now: Conditions) -> Iterator[Force]:
        yield Force(self.body, -self.area_m2 * now["atmosphere"].pressure_pa)


@dataclass(frozen=True, kw_only=True)
class SpringForce(Effect):
    """A spring towards x_0: F = -k (x - x_0).

    Source: interface.md section 6 (spring_force).
    """

    causes = (
        Cause(
            name="spring_force",
            strength="stiffness_n_m",
            balance=Balance.MOMENTUM,
            drivers=("position",),
            shown_by="hold at three positions",
            source="interface.md section 6",
        ),
    )

    body: str
    stiffness_n_m: Expression = strength(typical=120.0, upper=1e3)
    rest_m: Expression = form(0.1, lower=-10.0, upper=10.0)

    def terms(self, now: Conditions) -> Iterator[Force]:
        yield Force(self.body, -self.stiffness_n_m * (now[self.body].position_m - self.rest_m))


@dataclass(frozen=True, kw_only=True)
class EndCushion(Effect):
    """Extra damping within a length of each end: F = -c v there, zero elsewhere.

    The edge is a straight ramp over a tenth of the length, so that the force has a slope.

    The stroke begins at ``lower_m``.

    Source: physics.md section 6 (stops / cushioning); interface.md section 6.
    """

    causes = (
        Cause(
            name="end_cushion",
            strength="damping_n_s_m",
            balance=Balance.MOMENTUM,
            drivers=("position near the ends", "velocity"),
            shapes={"length_m": (0.008, 0.015, 0.03)},
            shown_by="strokes into both ends at several speeds",
            source="physics.md section 6 (stops / cushioning)",
        ),
    )

    body: str
    damping_n_s_m: Expression = strength(typical=150.0, upper=500.0)
    length_m: Expression = form(0.015, lower=0.005, upper=0.04)
    stroke_m: Expression = form(0.1, lower=1e-6)
    lower_m: Expression = form(0.0, lower=-10.0, upper=10.0)

    def shapes_of(self, cause: Cause) -> Mapping[str, tuple[float, ...]]:
        """Lengths that leave a middle without: two that meet are viscous friction.

        In a stroke too short for any of them the plant's own length stays.
        """
        most = LONGEST_CUSHION * self.stroke_m
        fitting = {"length_m": tuple(x for x in cause.shapes.get("length_m", ()) if x <= most)}
        return {name: grid for name, grid in {**cause.shapes, **fitting}.items() if grid}

    def terms(self, now: Conditions) -> Iterator[Force]:
        body = now[self.body]
        travelled_m = body.position_m - self.lower_m
        to_end_m = ca.fmin(travelled_m, self.stroke_m - travelled_m)
        within = (self.length_m - to_end_m) / (0.1 * self.length_m)
        share = ca.fmin(ca.fmax(within, 0.0), 1.0)
        yield Force(self.body, -self.damping_n_s_m * share * body.velocity_m_s)


@dataclass(frozen=True, kw_only=True)
class EndStops(Effect):
    """A spring and damper that act only beyond the stroke, and only push.

    F = max(0, s (lo - x) - d v)  for x < lo,   F = -max(0, s (x - hi) + d v)  for x > hi

    Source: physics.md 1.4; paper 003 Eqs. 9 and 11, which may pull while separating (E003-6).
    """

    body: str
    stiffness_n_m: Expression = strength(typical=2e6, relative_deviation=0.0)
    damping_n_s_m: Expression = form(2e3)
    lower_m: Expression = form(0.0, lower=-10.0, upper=10.0)
    upper_m: Expression = form(0.1, lower=-10.0, upper=10.0)

    def terms(self, now: Conditions) -> Iterator[Force]:
        body = now[self.body]
        low_m, high_m = self.lower_m - body.position_m, body.position_m - self.upper_m
        wall = (self.stiffness_n_m, self.damping_n_s_m)
        yield Force(self.body, push_n(low_m, -body.velocity_m_s, *wall))
        yield Force(self.body, -push_n(high_m, body.velocity_m_s, *wall))
