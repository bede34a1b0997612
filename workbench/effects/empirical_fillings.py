"""Empirical terms that fill a chamber: flows in kg/s, and rates of a pressure without gas in Pa/s.

See :mod:`workbench.effects.empirical`.  What a model without a balance of gas knows of air is a
rate, so a law of it is one too, and goes by the same quantities as a flow.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from workbench.effect import (
    Balance,
    Conditions,
    Effect,
    Expression,
    MassFlow,
    form,
    strength,
)
from workbench.effects.empirical import CONSTANT, ROUND_M_S, Scaled, cause_of
from workbench.effects.law_features import Feature, Here, product, size_of
from workbench.vessel import PressureRate

TYPICAL_PA_S, MOST_PA_S = 1e5, 1e7  # chosen, beside the 9e6 of an open valve in physics.md 2.6


@dataclass(frozen=True, kw_only=True)
class EmpiricalFilling(Effect):
    """A plain term that fills a chamber.

    Source: diagnosis.md 1.9.
    """

    formula: ClassVar[str] = ""
    counted_in: ClassVar[tuple[str, ...]] = ()

    chamber: str


@dataclass(frozen=True, kw_only=True)
class EmpiricalFlow(EmpiricalFilling):
    """A plain flow into a chamber in kg/s, with the temperature of the chamber.

    Source: diagnosis.md 1.9.
    """

    def flow_kg_s(self, now: Conditions) -> Expression:
        """The flow under these conditions; a subclass says it."""
        raise NotImplementedError

    def terms(self, now: Conditions) -> Iterator[MassFlow]:
        yield MassFlow(self.chamber, self.flow_kg_s(now), now[self.chamber].temperature_k)


@dataclass(frozen=True, kw_only=True)
class ConstantFlow(EmpiricalFlow):
    """mdot = a."""

    causes = cause_of(CONSTANT, "constant_kg_s", Balance.MASS)
    formula = "mdot = a"
    constant_kg_s: Expression = strength(typical=1e-4, lower=-1e-2, upper=1e-2)

    def flow_kg_s(self, now: Conditions) -> Expression:
        return self.constant_kg_s


@dataclass(frozen=True, kw_only=True)
class PressureFlow(EmpiricalFlow):
    """mdot = a p / p_s, with the pressure of the supply."""

    causes = cause_of("p/p_s", "pressure_kg_s", Balance.MASS)
    formula = "mdot = a p/p_s"
    supply: str = "supply"
    pressure_kg_s: Expression = strength(typical=1e-4, lower=-1e-2, upper=1e-2)

    def flow_kg_s(self, now: Conditions) -> Expression:
        return self.pressure_kg_s * now[self.chamber].pressure_pa / now[self.supply].pressure_pa


@dataclass(frozen=True, kw_only=True)
class SpeedFlow(EmpiricalFlow):
    """mdot = a |v| with the speed of the body that closes the chamber."""

    causes = cause_of("|v|", "speed_kg_m", Balance.MASS)
    formula = "mdot = a |v|"
    body: str
    speed_kg_m: Expression = strength(typical=5e-4, lower=-1e-1, upper=1e-1)

    def flow_kg_s(self, now: Conditions) -> Expression:
        return self.speed_kg_m * size_of(now[self.body].velocity_m_s, ROUND_M_S)


@dataclass(frozen=True, kw_only=True)
class ScaledFilling(Scaled, EmpiricalFilling):
    """g(v / v_0, (p - p_amb) / p_0, (u - u_0) / U), in sizes of the recordings.

    The command is what reaches the valve; ``rest`` and ``span`` are its u_0 and U in its own unit.
    ``outside`` is the part with p_amb.

    Source: diagnosis.md 1.9.
    """

    balance = Balance.MASS

    feature: Feature
    outside: str
    body: str | None = None
    command: str | None = None
    rest: float = 0.0
    span: float = 1.0
    speed_m_s: Expression = form(1.0, lower=1e-6)
    pressure_pa: Expression = form(1e5, lower=1.0)

    def share(self, now: Conditions) -> Expression:
        """The value of the feature under these conditions."""
        gauge_pa = now[self.chamber].pressure_pa - now[self.outside].pressure_pa
        here = Here(
            speed=now[self.body].velocity_m_s / self.speed_m_s if self.body else 0.0,
            pressure=gauge_pa / self.pressure_pa,
            command=(now.read(self.command) - self.rest) / self.span if self.command else 0.0,
        )
        return product(self.feature, here)


@dataclass(frozen=True, kw_only=True)
class ScaledFlow(ScaledFilling, EmpiricalFlow):
    """mdot = a g: a flow in the sizes of the recordings.

    Source: diagnosis.md 1.9.
    """

    coefficient = "size_kg_s"
    told = "mdot = a"
    size_kg_s: Expression = strength(typical=1e-4, lower=-1e-2, upper=1e-2)

    def flow_kg_s(self, now: Conditions) -> Expression:
        return self.size_kg_s * self.share(now)


@dataclass(frozen=True, kw_only=True)
class ConstantRate(EmpiricalFilling):
    """dp/dt = a.

    Source: diagnosis.md 1.9.
    """

    causes = cause_of(CONSTANT, "constant_pa_s", Balance.MASS)
    formula = "dp/dt = a"
    constant_pa_s: Expression = strength(typical=TYPICAL_PA_S, lower=-MOST_PA_S, upper=MOST_PA_S)

    def terms(self, now: Conditions) -> Iterator[PressureRate]:
        yield PressureRate(self.chamber, self.constant_pa_s)


@dataclass(frozen=True, kw_only=True)
class ScaledRate(ScaledFilling):
    """dp/dt = a g: a rate in the sizes of the recordings.

    Source: diagnosis.md 1.9.
    """

    coefficient = "size_pa_s"
    told = "dp/dt = a"
    size_pa_s: Expression = strength(typical=TYPICAL_PA_S, lower=-MOST_PA_S, upper=MOST_PA_S)

    def terms(self, now: Conditions) -> Iterator[PressureRate]:
        yield PressureRate(self.chamber, self.size_pa_s * self.share(now))
