"""Empirical terms: what is left when no effect of the catalogue explains a misfit.

They are not physical effects and stand in no catalogue.  Each is one simple function of one or two
driving variables in one balance, with one coefficient, and a law is a sum of at most three.  A rig
file takes them like effects: ``add = ["law[v|v|]@slide"]``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf

from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Effect,
    Expression,
    Force,
    MassFlow,
    form,
    strength,
)

SOURCE = "diagnosis.md 1.9: sparse law of one balance"
ROUND_M, ROUND_M_S = 1e-6, 1e-6  # where |x| and |v| turn smoothly


def _cause(driver: str, coefficient: str, balance: Balance) -> tuple[Cause, ...]:
    cause = Cause(
        name=f"law[{driver}]",
        strength=coefficient,
        balance=balance,
        drivers=(driver,),
        shown_by="the recording at hand",
        source=SOURCE,
        sizes=(0.1, 0.3, 1.0),
    )
    return (cause,)


@dataclass(frozen=True, kw_only=True)
class EmpiricalForce(Effect):
    """A plain term on a body, F(v, x) in N.

    What grows with a power of the speed may drive the body only a little: it would run away.

    Source: diagnosis.md 1.9.
    """

    body: str

    def force_n(self, velocity_m_s: Expression, position_m: Expression) -> Expression:
        """The force at a speed and a place; a subclass says it."""
        raise NotImplementedError

    def terms(self, now: Conditions) -> Iterator[Force]:
        here = now[self.body]
        yield Force(self.body, self.force_n(here.velocity_m_s, here.position_m))


@dataclass(frozen=True, kw_only=True)
class SquareDrag(EmpiricalForce):
    """F = -a v |v|."""

    causes = _cause("v|v|", "quadratic_n_s2_m2", Balance.MOMENTUM)
    quadratic_n_s2_m2: Expression = strength(typical=300.0, lower=-30.0, upper=1e5)

    def force_n(self, velocity_m_s: Expression, position_m: Expression) -> Expression:
        return -self.quadratic_n_s2_m2 * velocity_m_s * _size(velocity_m_s, ROUND_M_S)


@dataclass(frozen=True, kw_only=True)
class CubicDrag(EmpiricalForce):
    """F = -b v^3."""

    causes = _cause("v^3", "cubic_n_s3_m3", Balance.MOMENTUM)
    cubic_n_s3_m3: Expression = strength(typical=500.0, lower=-15.0, upper=1e5)

    def force_n(self, velocity_m_s: Expression, position_m: Expression) -> Expression:
        return -self.cubic_n_s3_m3 * velocity_m_s**3


@dataclass(frozen=True, kw_only=True)
class PlacedDrag(EmpiricalForce):
    """F = -c v |x - x_m|, with x_m the middle of the recorded stroke."""

    causes = _cause("v|x - mid|", "placed_viscous_n_s_m2", Balance.MOMENTUM)
    placed_viscous_n_s_m2: Expression = strength(typical=500.0, lower=-1e5, upper=1e5)
    middle_m: Expression = form(0.0, lower=-inf)

    def force_n(self, velocity_m_s: Expression, position_m: Expression) -> Expression:
        away_m = _size(position_m - self.middle_m, ROUND_M)
        return -self.placed_viscous_n_s_m2 * velocity_m_s * away_m


@dataclass(frozen=True, kw_only=True)
class CurvedForce(EmpiricalForce):
    """F = e (x - x_m)^2, with x_m the middle of the recorded stroke."""

    causes = _cause("(x - mid)^2", "curved_n_m2", Balance.MOMENTUM)
    curved_n_m2: Expression = strength(typical=2000.0, lower=-1e6, upper=1e6)
    middle_m: Expression = form(0.0, lower=-inf)

    def force_n(self, velocity_m_s: Expression, position_m: Expression) -> Expression:
        return self.curved_n_m2 * (position_m - self.middle_m) ** 2


@dataclass(frozen=True, kw_only=True)
class EmpiricalFlow(Effect):
    """A plain flow into a chamber in kg/s, with the temperature of the chamber.

    Source: diagnosis.md 1.9.
    """

    chamber: str

    def flow_kg_s(self, now: Conditions) -> Expression:
        """The flow under these conditions; a subclass says it."""
        raise NotImplementedError

    def terms(self, now: Conditions) -> Iterator[MassFlow]:
        yield MassFlow(self.chamber, self.flow_kg_s(now), now[self.chamber].temperature_k)


@dataclass(frozen=True, kw_only=True)
class ConstantFlow(EmpiricalFlow):
    """mdot = w."""

    causes = _cause("constant", "constant_kg_s", Balance.MASS)
    constant_kg_s: Expression = strength(typical=1e-4, lower=-1e-2, upper=1e-2)

    def flow_kg_s(self, now: Conditions) -> Expression:
        return self.constant_kg_s


@dataclass(frozen=True, kw_only=True)
class PressureFlow(EmpiricalFlow):
    """mdot = w p / p_s, with the pressure of the supply."""

    causes = _cause("p/p_s", "pressure_kg_s", Balance.MASS)
    supply: str = "supply"
    pressure_kg_s: Expression = strength(typical=1e-4, lower=-1e-2, upper=1e-2)

    def flow_kg_s(self, now: Conditions) -> Expression:
        return self.pressure_kg_s * now[self.chamber].pressure_pa / now[self.supply].pressure_pa


@dataclass(frozen=True, kw_only=True)
class SpeedFlow(EmpiricalFlow):
    """mdot = w |v| with the speed of the body that closes the chamber."""

    causes = _cause("|v|", "speed_kg_m", Balance.MASS)
    body: str
    speed_kg_m: Expression = strength(typical=5e-4, lower=-1e-1, upper=1e-1)

    def flow_kg_s(self, now: Conditions) -> Expression:
        return self.speed_kg_m * _size(now[self.body].velocity_m_s, ROUND_M_S)


FORCES: tuple[type[EmpiricalForce], ...] = (SquareDrag, CubicDrag, PlacedDrag, CurvedForce)


def _size(value: Expression, rounding: float) -> Expression:
    """|value|, with a derivative everywhere."""
    return (value**2 + rounding**2) ** 0.5
