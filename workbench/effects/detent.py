"""A spring-loaded ball in the notches of a lever: it keeps the gear that is in."""

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
class Detent(Effect):
    """A ball pressed onto a waved track on a lever, with a notch every ``pitch_m`` of its tip.

    torque = -tan(alpha) F_de r_de,    tan(alpha) = t_max sin(2 pi x_tip / pitch)

    Source: paper 003 (shift finger); the shape of the track is chosen, physics.md 2.5.
    """

    causes = (
        Cause(
            name="detent",
            strength="force_n",
            balance=Balance.MOMENTUM,
            drivers=("position",),
            shown_by="shifts N to H and L to N at two supply pressures",
            source="paper 003; physics.md section 6 (detent)",
        ),
    )

    lever: str
    force_n: Expression = strength(typical=300.0, upper=3e3)
    arm_m: Expression = form(0.05, lower=1e-3)
    steepest_slope: Expression = form(0.6, lower=0.01, upper=5.0)
    pitch_m: Expression = form(0.012, lower=1e-4)

    def terms(self, now: Conditions) -> Iterator[Torque]:
        angle = 2.0 * ca.pi * now[self.lever].tip_m / self.pitch_m
        slope = self.steepest_slope * ca.sin(angle)
        yield Torque(self.lever, -slope * self.force_n * self.arm_m)
