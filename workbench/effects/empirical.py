"""Empirical terms: what is left when no effect of the catalogue explains a misfit.

They are not physical effects and stand in no catalogue.  Each is one simple function of one or two
driving variables in one balance, and a law is a sum of at most three.
"""

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
    MassFlow,
    strength,
)

SOURCE = "diagnosis.md 1.9: sparse law of one balance"


def _term(name: str, balance: Balance, driver: str) -> Cause:
    return Cause(
        name=f"law[{name}]",
        strength=name,
        balance=balance,
        drivers=(driver,),
        shown_by="the recording at hand",
        source=SOURCE,
        sizes=(0.1, 0.3, 1.0),
    )


@dataclass(frozen=True, kw_only=True)
class EmpiricalForce(Effect):
    """A sum of plain terms on a body.

    F = -a v |v| - b v^3 - c v |x - x_m| + e (x - x_m)^2

    What grows with a power of the speed may drive the body only a little: it would run away.

    Source: diagnosis.md 1.9.
    """

    causes = (
        _term("quadratic_n_s2_m2", Balance.MOMENTUM, "v|v|"),
        _term("cubic_n_s3_m3", Balance.MOMENTUM, "v^3"),
        _term("placed_viscous_n_s_m2", Balance.MOMENTUM, "v|x - mid|"),
        _term("curved_n_m2", Balance.MOMENTUM, "(x - mid)^2"),
    )

    body: str
    middle_m: float = 0.0
    quadratic_n_s2_m2: Expression = strength(typical=300.0, lower=-30.0, upper=1e5)
    cubic_n_s3_m3: Expression = strength(typical=500.0, lower=-15.0, upper=1e5)
    placed_viscous_n_s_m2: Expression = strength(typical=500.0, lower=-1e5, upper=1e5)
    curved_n_m2: Expression = strength(typical=2000.0, lower=-1e6, upper=1e6)

    def terms(self, now: Conditions) -> Iterator[Force]:
        v, x = now[self.body].velocity_m_s, now[self.body].position_m - self.middle_m
        speed = (v**2 + 1e-12) ** 0.5
        distance = (x**2 + 1e-12) ** 0.5
        force_n = -self.quadratic_n_s2_m2 * v * speed - self.cubic_n_s3_m3 * v**3
        force_n += -self.placed_viscous_n_s_m2 * v * distance + self.curved_n_m2 * x**2
        yield Force(self.body, force_n)


@dataclass(frozen=True, kw_only=True)
class EmpiricalFlow(Effect):
    """mdot = w0 + w1 (p / p_s) + w2 |v| into a chamber, with the temperature of the chamber.

    Source: diagnosis.md 1.9.
    """

    causes = (
        _term("constant_kg_s", Balance.MASS, "constant"),
        _term("pressure_kg_s", Balance.MASS, "p/p_s"),
        _term("speed_kg_m", Balance.MASS, "|v|"),
    )

    chamber: str
    body: str
    constant_kg_s: Expression = strength(typical=1e-4, lower=-1e-2, upper=1e-2)
    pressure_kg_s: Expression = strength(typical=1e-4, lower=-1e-2, upper=1e-2)
    speed_kg_m: Expression = strength(typical=5e-4, lower=-1e-1, upper=1e-1)

    def terms(self, now: Conditions) -> Iterator[MassFlow]:
        gas, supply = now[self.chamber], now["supply"]
        v = now[self.body].velocity_m_s
        flow = self.constant_kg_s + self.speed_kg_m * (v**2 + 1e-12) ** 0.5
        flow += self.pressure_kg_s * gas.pressure_pa / supply.pressure_pa
        yield MassFlow(self.chamber, flow, gas.temperature_k)
