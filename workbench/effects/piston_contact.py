"""Two bodies of which one pushes the other along."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

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
from workbench.effects.forces import push_n


@dataclass(frozen=True, kw_only=True)
class PistonContact(Effect):
    """The body pushes the other one ahead of it, and is held back by it; they never pull.

    F = max(0, s (x - x_2) + d (v - v_2))  for x > x_2, else 0;   -F on the body, +F on the other

    Source: paper 003 Eqs. 8 to 11; errata E003-6 (contact may not pull) and E003-7 (opposite signs
    on the two pistons).
    """

    causes = (
        Cause(
            name="piston_contact",
            strength="stiffness_n_m",
            balance=Balance.MOMENTUM,
            drivers=("position beyond Neutral",),
            kinked=True,
            sizes=(1e-4, 1e-2, 1.0),
            shown_by="shifts from both ends into Neutral",
            source="paper 003 Eqs. 8 to 11",
        ),
    )

    body: str
    other: str
    stiffness_n_m: Expression = strength(typical=2e7, upper=1e9, relative_deviation=0.0)
    damping_n_s_m: Expression = form(4e3)

    def terms(self, now: Conditions) -> Iterator[Force]:
        behind, ahead = now[self.body], now[self.other]
        depth_m = behind.position_m - ahead.position_m
        rate_m_s = behind.velocity_m_s - ahead.velocity_m_s
        force_n = push_n(depth_m, rate_m_s, self.stiffness_n_m, self.damping_n_s_m)
        yield Force(self.body, -force_n)
        yield Force(self.other, force_n)
