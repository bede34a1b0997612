"""Empirical terms: what is left when no effect of the catalogue explains a misfit.

They are not physical effects and stand in no catalogue.  Each is one simple function of one or two
driving variables in one balance, with one coefficient, and a law is a sum of at most three.  A rig
file takes them like effects: ``add = ["law[v|v|]@slide"]``.  Here are those of a body; what fills a
chamber stands in :mod:`workbench.effects.empirical_fillings`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf
from typing import ClassVar

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
from workbench.effects.law_features import (
    Feature,
    Here,
    counted_in,
    product,
    size_of,
    written,
)

SOURCE = "diagnosis.md 1.9: sparse law of one balance"
CONSTANT = "constant"  # the driver of what nothing drives
ROUND_M, ROUND_M_S = 1e-6, 1e-6  # where |x| and |v| turn smoothly


def cause_of(driver: str, coefficient: str, balance: Balance) -> tuple[Cause, ...]:
    """The one cause that a term is, by what drives it."""
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

    formula: ClassVar[str] = ""  # as it is told, with a for the coefficient
    counted_in: ClassVar[tuple[str, ...]] = ()  # forms in whose size its factors count

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

    causes = cause_of("v|v|", "quadratic_n_s2_m2", Balance.MOMENTUM)
    formula = "F = -a v |v|"
    quadratic_n_s2_m2: Expression = strength(typical=300.0, lower=-30.0, upper=1e5)

    def force_n(self, velocity_m_s: Expression, position_m: Expression) -> Expression:
        return -self.quadratic_n_s2_m2 * velocity_m_s * size_of(velocity_m_s, ROUND_M_S)


@dataclass(frozen=True, kw_only=True)
class CubicDrag(EmpiricalForce):
    """F = -a v^3."""

    causes = cause_of("v^3", "cubic_n_s3_m3", Balance.MOMENTUM)
    formula = "F = -a v^3"
    cubic_n_s3_m3: Expression = strength(typical=500.0, lower=-15.0, upper=1e5)

    def force_n(self, velocity_m_s: Expression, position_m: Expression) -> Expression:
        return -self.cubic_n_s3_m3 * velocity_m_s**3


@dataclass(frozen=True, kw_only=True)
class PlacedDrag(EmpiricalForce):
    """F = -a v |x - x_m|, with x_m the middle of the recorded stroke."""

    causes = cause_of("v|x - mid|", "placed_viscous_n_s_m2", Balance.MOMENTUM)
    formula = "F = -a v |x - mid|"
    counted_in = ("middle_m",)
    placed_viscous_n_s_m2: Expression = strength(typical=500.0, lower=-1e5, upper=1e5)
    middle_m: Expression = form(0.0, lower=-inf)

    def force_n(self, velocity_m_s: Expression, position_m: Expression) -> Expression:
        away_m = size_of(position_m - self.middle_m, ROUND_M)
        return -self.placed_viscous_n_s_m2 * velocity_m_s * away_m


@dataclass(frozen=True, kw_only=True)
class CurvedForce(EmpiricalForce):
    """F = a (x - x_m)^2, with x_m the middle of the recorded stroke."""

    causes = cause_of("(x - mid)^2", "curved_n_m2", Balance.MOMENTUM)
    formula = "F = a (x - mid)^2"
    counted_in = ("middle_m",)
    curved_n_m2: Expression = strength(typical=2000.0, lower=-1e6, upper=1e6)
    middle_m: Expression = form(0.0, lower=-inf)

    def force_n(self, velocity_m_s: Expression, position_m: Expression) -> Expression:
        return self.curved_n_m2 * (position_m - self.middle_m) ** 2


class Scaled:
    """What is counted in sizes of the recordings, by the factors of its feature.

    ``coefficient`` is its strength, in ``balance``; ``told`` is how its formula begins.
    """

    coefficient: ClassVar[str]
    balance: ClassVar[Balance]
    told: ClassVar[str]

    feature: Feature

    @property
    def causes(self) -> tuple[Cause, ...]:
        """The one cause that it is."""
        return cause_of(written(self.feature), self.coefficient, self.balance)

    @property
    def formula(self) -> str:
        """As it is told, everything in its sizes."""
        return f"{self.told} {written(self.feature)}"

    @property
    def counted_in(self) -> tuple[str, ...]:
        """Forms in whose size its factors count."""
        return counted_in(self.feature)


@dataclass(frozen=True, kw_only=True)
class ScaledForce(Scaled, EmpiricalForce):
    """F = a g(v / v_0, 2 (x - x_m) / L, (p_1 - p_2) / p_0), in sizes of the recordings.

    ``chambers`` are two whose pressures push the body, each against the other, or one and what is
    outside.

    Source: diagnosis.md 1.9.
    """

    coefficient = "size_n"
    balance = Balance.MOMENTUM
    told = "F = a"
    direction: ClassVar[float] = 1.0

    feature: Feature
    chambers: tuple[str, ...] = ()
    size_n: Expression = strength(typical=20.0, lower=-500.0, upper=500.0)
    speed_m_s: Expression = form(1.0, lower=1e-6)
    middle_m: Expression = form(0.0, lower=-inf)
    stroke_m: Expression = form(0.1, lower=1e-6)
    pressure_pa: Expression = form(1e5, lower=1.0)

    def terms(self, now: Conditions) -> Iterator[Force]:
        moved, across_pa = now[self.body], 0.0
        if self.chambers:
            first, second = self.chambers
            across_pa = now[first].pressure_pa - now[second].pressure_pa
        here = Here(
            speed=moved.velocity_m_s / self.speed_m_s,
            place=2.0 * (moved.position_m - self.middle_m) / self.stroke_m,
            pressure=across_pa / self.pressure_pa,
        )
        yield Force(self.body, self.direction * self.size_n * product(self.feature, here))


@dataclass(frozen=True, kw_only=True)
class ScaledDrag(ScaledForce):
    """The same against the movement, F = -a g: with it, the body would run away.

    Source: diagnosis.md 1.9.
    """

    told = "F = -a"
    direction = -1.0
    size_n: Expression = strength(typical=20.0, lower=-2.0, upper=500.0)


FORCES: tuple[type[EmpiricalForce], ...] = (SquareDrag, CubicDrag, PlacedDrag, CurvedForce)
