"""Volumes of gas without a moving body: a tank, a bellows, a closed chamber; and a lumped one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.air import HEAT_CAPACITY_RATIO
from workbench.balances import BalanceEquation
from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Expression,
    Kind,
    Part,
    Received,
    State,
    Term,
    form,
    strength,
)
from workbench.gas_volume import PRESSURE_RATES, GasVolume, total


@dataclass(frozen=True, kw_only=True)
class Vessel(GasVolume):
    """A rigid volume: a tank, a closed chamber.

    Source: paper 002 (identification by a reservoir); physics.md 2.4 and 2.7.
    """

    volume_m3: Expression = form(5e-4, lower=1e-9, relative_deviation=0.05)
    surface_m2: Expression = form(3e-2, lower=1e-6, upper=10.0)

    def initial_volume_m3(self) -> Expression:
        return self.volume_m3

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        pressure_pa = seen.get(f"{self.name}.pressure_pa")
        if pressure_pa is None:
            return {}
        return self.guessed(pressure_pa, np.full_like(pressure_pa, self.initial_volume_m3()))

    def derive(self, now: Conditions) -> dict[str, Expression]:
        return self.gas(now, self.initial_volume_m3()) | {
            "volume_rate_m3_s": 0.0,
            "surface_m2": self.surface_m2,
        }


@dataclass(frozen=True, kw_only=True)
class Bellows(Vessel):
    """A volume that gives way under its pressure: V = V_0 + V_line + C_b (p - p_atm).

    kappa is a parameter here, because paper 004 fits it; the valve reads it, too.

    Source: paper 004 Eq. 1 and its future work (expansion); physics.md section 6
    (volume_expansion, line_volume).
    """

    causes = (
        Cause(
            name="volume_expansion",
            strength="expansion_m3_pa",
            balance=Balance.MASS,
            drivers=("pressure",),
            shown_by="filling by equal commands from several start pressures",
            source="paper 004 (future work); physics.md section 6",
        ),
        Cause(
            name="line_volume",
            strength="line_volume_m3",
            balance=Balance.MASS,
            drivers=("rate of the pressure",),
            kind=Kind.PARAMETER,
            held="volume_m3",
            shown_by="steps with two lengths of tube",
            source="physics.md section 6 (line_volume)",
        ),
    )

    heat_capacity_ratio: Expression = form(HEAT_CAPACITY_RATIO, lower=1.05, upper=1.67)
    expansion_m3_pa: Expression = strength(typical=2.5e-10, upper=5e-9)
    line_volume_m3: Expression = strength(typical=2e-5, upper=1e-3)

    @property
    def balance_exponent(self) -> Expression:
        return self.heat_capacity_ratio

    def initial_volume_m3(self) -> Expression:
        return self.volume_m3 + self.line_volume_m3

    def derive(self, now: Conditions) -> dict[str, Expression]:
        gauge_pa = now[self.name].pressure_pa - now["atmosphere"].pressure_pa
        grown_m3 = self.initial_volume_m3() + self.expansion_m3_pa * gauge_pa
        return super().derive(now) | {
            "heat_capacity_ratio": self.heat_capacity_ratio,
            "volume_m3": ca.fmax(grown_m3, 0.1 * self.volume_m3),
            "compliance_m3_pa": self.expansion_m3_pa,
        }


class PressureRate(Term):
    """What a model without a balance of gas adds to the rate of a pressure, in Pa/s."""


@dataclass(frozen=True, kw_only=True)
class LumpedPressure(Part):
    """A pressure that follows a valve with one time constant, without a balance of gas.

    Source: paper 004 Eqs. 5 and 6 (erratum E004-4: P and p are one pressure).
    """

    balances = (
        BalanceEquation(
            balance=Balance.MASS,
            kind=PressureRate,
            term="pressure_rate_pa_s",
            state="pressure_pa",
            rates=PRESSURE_RATES,
        ),
    )

    initial_pressure_pa: float = 1.013e5

    def states(self) -> Iterator[State]:
        yield State("pressure_pa", self.initial_pressure_pa, scale=1e5, tolerance=20.0)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        pressure_pa = seen.get(f"{self.name}.pressure_pa")
        return {} if pressure_pa is None else {"pressure_pa": (pressure_pa, 2e3)}

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        return {"pressure_pa": total(received(self.name), PressureRate)}
