"""Chambers with less than the full balance: the gas temperature follows from the pressure.

For comparing with the papers' simplifications (physics.md 1.2, levels 2 and 3) and for design
models of fewer states; the full balance of :class:`workbench.parts.Chamber` stays the default.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from types import SimpleNamespace

import casadi as ca
import numpy as np

from workbench.air import HEAT_CAPACITY_RATIO, LOWEST_PRESSURE_PA
from workbench.effect import Conditions, Expression, Received, State, form
from workbench.parts import Chamber
from workbench.plant import Plant


@dataclass(frozen=True, kw_only=True)
class PolytropicChamber(Chamber):
    """A chamber whose gas mass is no state.

    T = T_0 (p/p_0)^((n-1)/n)
    V dp/dt = k R sum(mdot T) - k p dV/dt + (kappa - 1) sum(Q)

    n = 1.35 and k = kappa is paper 002's simplification (level 2); n = 1 keeps the temperature
    constant: with k = kappa the adiabatic model of papers 003 and 004 (level 3), with k = 1 the
    isothermal one.  It does not conserve mass, and with heat it has no rest but p_0 (E002-7).

    Source: paper 002 Eq. 8; physics.md 1.2.
    """

    polytropic_index: Expression = form(1.35, lower=1.0, upper=1.4, deviation=0.05)
    balance_exponent: Expression = form(HEAT_CAPACITY_RATIO, lower=1.0, upper=1.4)
    reference_pressure_pa: Expression = form(5.65e5, lower=1.0)

    def states(self) -> Iterator[State]:
        return (state for state in super().states() if state.quantity == "pressure_pa")

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        found = super().guess(seen)
        return {key: value for key, value in found.items() if key == "pressure_pa"}

    def temperature_k(self, own: SimpleNamespace, volume_m3: Expression) -> Expression:
        share = (self.polytropic_index - 1.0) / self.polytropic_index
        relative = ca.fmax(own.pressure_pa, LOWEST_PRESSURE_PA) / self.reference_pressure_pa
        return self.initial_temperature_k * ca.exp(share * ca.log(relative))

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        return {"pressure_pa": super().rates(now, received)["pressure_pa"]}


def with_polytropic_gas(plant: Plant, **law: float) -> Plant:
    """The plant with all its chambers polytropic; ``law`` names fields of the law above."""

    def simplified(chamber: Chamber) -> PolytropicChamber:
        known = {field.name: getattr(chamber, field.name) for field in fields(Chamber)}
        return PolytropicChamber(**known, **law)

    parts = (simplified(p) if type(p) is Chamber else p for p in plant.parts)
    return replace(plant, parts=tuple(parts))
