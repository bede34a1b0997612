"""The balance of a gas volume, at one of three levels of detail."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Protocol

import casadi as ca
import numpy as np

from workbench.air import (
    GAS_CONSTANT_J_KG_K,
    HEAT_CAPACITY_RATIO,
    LOWEST_PRESSURE_PA,
    LOWEST_TEMPERATURE_K,
)
from workbench.balances import BalanceEquation
from workbench.effect import (
    Balance,
    Conditions,
    Expression,
    HeatFlow,
    MassFlow,
    Part,
    Received,
    State,
    Term,
)

LOWEST_MASS_KG = 1e-9
PRESSURE_RATES = (1e5, 1e6)
GAS = BalanceEquation(
    balance=Balance.MASS,
    kind=MassFlow,
    term="mass_flow_kg_s",
    state="pressure_pa",
    rates=PRESSURE_RATES,
)
HEAT = BalanceEquation(
    balance=Balance.ENERGY,
    kind=HeatFlow,
    term="heat_flow_w",
    state="pressure_pa",
    rates=PRESSURE_RATES,
)


class ThermalLevel(Protocol):
    """How the temperature of the gas is known; physics.md 1.2 has three levels of it."""

    @property
    def counts_mass(self) -> bool:
        """True where the mass of gas is a state."""

    @property
    def balance_exponent(self) -> float:
        """What stands before enthalpy and work: kappa; 1 where the gas keeps its temperature."""

    def temperature_k(
        self, pressure_pa: Expression, volume_m3: Expression, content_j_k: Expression | None
    ) -> Expression:
        """Gas temperature; ``content_j_k`` is m R where mass is counted."""


@dataclass(frozen=True)
class FullLevel:
    """Level 1: pressure and mass are states, T = p V / (m R); conserves mass by construction."""

    counts_mass = True
    balance_exponent = HEAT_CAPACITY_RATIO

    def temperature_k(
        self, pressure_pa: Expression, volume_m3: Expression, content_j_k: Expression | None
    ) -> Expression:
        return ca.fmax(pressure_pa * volume_m3 / content_j_k, LOWEST_TEMPERATURE_K)


@dataclass(frozen=True)
class PolytropicLevel:
    """Level 2: T = T_0 (p/p_0)^((n-1)/n).

    Good near p_0 with the valve active only: a closed chamber with heat flow never rests, and mass
    is not conserved (erratum E002-7).  n = 1 keeps the temperature constant: with an exponent of
    the balance of kappa it is level 3, with 1 isothermal.

    Source: paper 002 Eq. 8, n = 1.35.
    """

    reference_pressure_pa: float = 5.65e5
    reference_temperature_k: float = 293.15
    polytropic_index: float = 1.35
    balance_exponent: float = HEAT_CAPACITY_RATIO
    counts_mass = False

    def temperature_k(
        self, pressure_pa: Expression, volume_m3: Expression, content_j_k: Expression | None
    ) -> Expression:
        exponent = (self.polytropic_index - 1.0) / self.polytropic_index
        relative = ca.fmax(pressure_pa, LOWEST_PRESSURE_PA) / self.reference_pressure_pa
        return self.reference_temperature_k * relative**exponent


@dataclass(frozen=True)
class ConstantTemperatureLevel:
    """Level 3: the pressure follows the adiabatic balance, the flow sees one temperature.

    Source: papers 003 (reduced model) and 004 Eq. 1.
    """

    constant_temperature_k: float = 293.15
    counts_mass = False
    balance_exponent = HEAT_CAPACITY_RATIO

    def temperature_k(
        self, pressure_pa: Expression, volume_m3: Expression, content_j_k: Expression | None
    ) -> Expression:
        return self.constant_temperature_k


def total(terms: list[Term], kind: type[Term]) -> Expression:
    """Sum of the values of one kind of term."""
    return sum(term.value for term in terms if isinstance(term, kind))


@dataclass(frozen=True, kw_only=True)
class GasVolume(Part):
    """A volume of gas with its pressure and, at the full level, its mass as states.

    (V + k p C) dp/dt = k R sum(mdot T) - k p V' + (kappa - 1) sum(Q)
    dm/dt = sum(mdot)

    k is kappa unless a level without mass says otherwise.  V' is the growth of the volume that does
    not follow from the pressure, C = dV/dp what does.  Whoever extends it gives V, V', C and the
    surface of the wall in :meth:`derive`.

    Source: paper 002 Eqs. 4 and 5, 004 Eq. 1, in the (p, m) form of physics.md 1.2 level 1.
    """

    gas_constant_j_kg_k: float = GAS_CONSTANT_J_KG_K
    level: ThermalLevel = FullLevel()
    initial_pressure_pa: float = 1e5
    initial_temperature_k: float = 293.15

    @property
    def balances(self) -> tuple[BalanceEquation, ...]:
        """Gas, and heat where the mass tells the two apart."""
        return (GAS, HEAT) if self.level.counts_mass else (GAS,)

    def initial_volume_m3(self) -> Expression:
        """Gas volume at the start."""
        raise NotImplementedError

    def states(self) -> Iterator[State]:
        yield State("pressure_pa", self.initial_pressure_pa, scale=1e5, tolerance=20.0)
        if self.level.counts_mass:
            filled_kg = self.mass_at(self.initial_pressure_pa, self.initial_volume_m3())
            yield State("mass_kg", filled_kg, scale=1e-4, tolerance=1e-8)

    def mass_at(self, pressure_pa: Expression, volume_m3: Expression) -> Expression:
        """Mass of gas at a pressure, in a volume, at the initial temperature."""
        return pressure_pa * volume_m3 / (self.gas_constant_j_kg_k * self.initial_temperature_k)

    def guessed(
        self, pressure_pa: np.ndarray, volume_m3: np.ndarray
    ) -> dict[str, tuple[np.ndarray | float, float]]:
        """Own states from a recorded pressure, and their standard deviations."""
        guess = {"pressure_pa": (pressure_pa, 2e3)}
        if self.level.counts_mass:
            filled_kg = self.mass_at(pressure_pa, volume_m3)
            guess["mass_kg"] = filled_kg, 0.05 * float(np.median(filled_kg))
        return guess

    def temperature_k(self, own: SimpleNamespace, volume_m3: Expression) -> Expression:
        """Gas temperature from the volume's own states."""
        pressure_pa = ca.fmax(own.pressure_pa, LOWEST_PRESSURE_PA)
        content_j_k = None
        if self.level.counts_mass:
            content_j_k = ca.fmax(own.mass_kg, LOWEST_MASS_KG) * self.gas_constant_j_kg_k
        return self.level.temperature_k(pressure_pa, volume_m3, content_j_k)

    @property
    def balance_exponent(self) -> Expression:
        """The exponent k of the balance."""
        return self.level.balance_exponent

    def gas(self, now: Conditions, volume_m3: Expression) -> dict[str, Expression]:
        """What every gas volume derives from its states and its volume."""
        own = now[self.name]
        return {
            "volume_m3": volume_m3,
            "temperature_k": self.temperature_k(own, volume_m3),
            "gas_constant_j_kg_k": self.gas_constant_j_kg_k,
            "compliance_m3_pa": 0.0,
            "line_share": 1.0,
        }

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        own, got, k = now[self.name], received(self.name), self.balance_exponent
        carried = sum(t.value * t.temperature_k for t in got if isinstance(t, MassFlow))
        energy_w = (
            k * self.gas_constant_j_kg_k * carried
            - k * own.pressure_pa * own.volume_rate_m3_s
            + (HEAT_CAPACITY_RATIO - 1.0) * total(got, HeatFlow)
        )
        given_m3 = k * ca.fmax(own.pressure_pa, 0.0) * own.compliance_m3_pa
        rates = {"pressure_pa": energy_w / (own.volume_m3 + given_m3)}
        return rates | {"mass_kg": total(got, MassFlow)} if self.level.counts_mass else rates
