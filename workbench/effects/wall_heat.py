"""Heat exchanged between the gas of the chambers and the cylinder wall."""

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
    HeatFlow,
    form,
    strength,
)


@dataclass(frozen=True, kw_only=True)
class WallHeat(Effect):
    """Convection to a wall at supply temperature, by the Eichelberg law.

    Q = lambda_0 A_q sqrt(p T / (p_0 T_0)) (T_w - T),   A_q the chamber's own surface

    Source: paper 002 Eqs. 6 and 7, Table 4; T_w = T_s as printed there.
    """

    causes = (
        Cause(
            name="wall_heat",
            strength="coefficient_w_m2_k",
            balance=Balance.ENERGY,
            drivers=("rate of the pressure", "gas temperature"),
            shown_by="fast fill, then valve closed for 5 s",
            source="paper 002 Eqs. 6, 7, Table 4",
        ),
    )

    chambers: tuple[str, ...]

    coefficient_w_m2_k: Expression = strength(typical=50.0, upper=1e3)
    reference_pressure_pa: Expression = form(5.65e5, lower=1.0)
    reference_temperature_k: Expression = form(293.15, lower=1.0)

    def terms(self, now: Conditions) -> Iterator[HeatFlow]:
        wall_k = now["supply"].temperature_k
        for chamber in self.chambers:
            gas = now[chamber]
            load = ca.fmax(gas.pressure_pa, 0.0) * gas.temperature_k
            load /= self.reference_pressure_pa * self.reference_temperature_k
            conductance_w_k = self.coefficient_w_m2_k * gas.surface_m2 * ca.sqrt(load + 1e-12)
            yield HeatFlow(chamber, conductance_w_k * (wall_k - gas.temperature_k))
