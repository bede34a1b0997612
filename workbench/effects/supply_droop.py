"""A supply that gives way when air is drawn from it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Effect,
    Expression,
    MassFlow,
    Received,
    State,
    form,
    strength,
)


@dataclass(frozen=True, kw_only=True)
class SupplyDroop(Effect):
    """A small tank behind a regulator: the supply pressure falls with the flow drawn, with a lag.

    tau dq/dt = mdot_drawn - q,   p_s = p_set - R q

    This is V_t dP_s/dt = kappa R_air T (G_r (P_set - P_s) - mdot) with R = 1/G_r and
    tau = V_t R / (kappa R_air T).  The state is the flow q that the regulator delivers, so that at
    R = 0 nothing of it is left.

    Source: physics.md section 6 (supply_droop); a tank reduces it in paper 002, measured in 003.
    """

    causes = (
        Cause(
            name="supply_droop",
            strength="resistance_pa_s_kg",
            forms=("refill_time_s",),
            balance=Balance.SUPPLY,
            drivers=("flow drawn",),
            shapes={"refill_time_s": (0.05, 0.3)},
            shown_by="large fast strokes with the supply pressure recorded",
            source="physics.md section 6 (supply_droop)",
        ),
    )
    produces: ClassVar[str] = "supply.pressure_pa"

    resistance_pa_s_kg: Expression = strength(typical=5e7, upper=1e9)
    refill_time_s: Expression = form(0.1, lower=5e-3, upper=10.0)

    def states(self) -> Iterator[State]:
        yield State("delivered_kg_s", initial=0.0, scale=1e-3)

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        if signal != self.produces:
            return value
        return value - self.resistance_pa_s_kg * now[self.name].delivered_kg_s

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        drawn_kg_s = -sum(t.value for t in received("supply") if isinstance(t, MassFlow))
        return {"delivered_kg_s": (drawn_kg_s - now[self.name].delivered_kg_s) / self.refill_time_s}
