"""The joint through which a body moves a lever: it gives way, and it may have play."""

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
    Force,
    Term,
    Torque,
    form,
    strength,
)


@dataclass(frozen=True, kw_only=True)
class LeverLink(Effect):
    """A spring and damper between a body and the tip of a lever, with play of ``backlash_m``.

    F_c = s D(e) + d de/dt outside the dead band, 0 inside;   e = x - r theta
    D(e) = e - b/2 for e > b/2,  e + b/2 for e < -b/2,  0 between
    -F_c on the body,  F_c r on the lever

    Source: paper 003 (shift finger, linear spring and damper); physics.md 2.5 and section 6
    (backlash).
    """

    causes = (
        Cause(
            name="backlash",
            strength="backlash_m",
            balance=Balance.MOMENTUM,
            drivers=("sign of the velocity", "position within the play"),
            kinked=True,
            shown_by="shifts to and fro between all positions",
            source="physics.md section 6 (lever_inertia, backlash)",
        ),
    )

    body: str
    lever: str
    backlash_m: Expression = strength(typical=0.3e-3, upper=2e-3)
    stiffness_n_m: Expression = form(5e6, lower=1e3)
    damping_n_s_m: Expression = form(1.5e3)

    @property
    def absent(self) -> bool:
        """Never: without play it still is the joint."""
        return False

    def terms(self, now: Conditions) -> Iterator[Term]:
        body, lever = now[self.body], now[self.lever]
        gap_m, half_m = body.position_m - lever.tip_m, 0.5 * self.backlash_m
        beyond_m = gap_m - ca.fmax(ca.fmin(gap_m, half_m), -half_m)
        rate_m_s = body.velocity_m_s - lever.tip_velocity_m_s
        damped_n = ca.if_else(ca.fabs(gap_m) >= half_m, self.damping_n_s_m * rate_m_s, 0.0)
        force_n = self.stiffness_n_m * beyond_m + damped_n
        yield Force(self.body, -force_n)
        yield Torque(self.lever, force_n * lever.arm_m)
