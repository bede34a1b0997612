"""Heat exchanged between the gas of the chambers and the cylinder wall."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace

import casadi as ca

from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Effect,
    Expression,
    HeatFlow,
    Received,
    State,
    form,
    strength,
)


@dataclass(frozen=True, kw_only=True)
class ConstantWallHeat(Effect):
    """Convection with a constant coefficient to a wall at the temperature of ``wall``.

    Q = lambda A_q (T_w - T)

    with A_q the wall area of the chamber, 2 S + pi d l where one piston of area S closes it.

    Source: paper 003 Eqs. 5 and 6, T_w = T_amb.  Its Eq. 7 lacks the factor kappa - 1 in front of
    the heat (erratum E003-1); the chamber's balance has it.
    """

    causes = (
        Cause(
            name="wall_heat",
            strength="coefficient_w_m2_k",
            balance=Balance.ENERGY,
            drivers=("rate of the pressure", "gas temperature"),
            shown_by="fast fill, then valve closed for 5 s",
            source="papers 002 Eqs. 6, 7, Table 4; 003 Eqs. 5 to 7",
        ),
    )

    chambers: tuple[str, ...]
    wall: str = "atmosphere"

    coefficient_w_m2_k: Expression = strength(typical=50.0, upper=1e3)

    def terms(self, now: Conditions) -> Iterator[HeatFlow]:
        wall_k = self.wall_temperature_k(now)
        for chamber in self.chambers:
            gas = now[chamber]
            conductance_w_k = self.coefficient_w_m2_k * gas.surface_m2 * self.relative(gas)
            yield HeatFlow(chamber, conductance_w_k * (wall_k - gas.temperature_k))

    def wall_temperature_k(self, now: Conditions) -> Expression:
        """What the gas gives its heat to."""
        return now[self.wall].temperature_k

    def relative(self, gas: SimpleNamespace) -> Expression:
        """The coefficient at this state of the gas, relative to the parameter."""
        return 1.0


@dataclass(frozen=True, kw_only=True)
class WallHeat(ConstantWallHeat):
    """Convection to a wall at supply temperature, by the Eichelberg law.

    Q = lambda_0 A_q sqrt(p T / (p_0 T_0)) (T_w - T)

    Source: paper 002 Eqs. 6 and 7, Table 4; T_w = T_s as printed there.
    """

    wall: str = "supply"

    reference_pressure_pa: Expression = form(5.65e5, lower=1.0)
    reference_temperature_k: Expression = form(293.15, lower=1.0)

    def relative(self, gas: SimpleNamespace) -> Expression:
        load = ca.fmax(gas.pressure_pa, 0.0) * gas.temperature_k
        load /= self.reference_pressure_pa * self.reference_temperature_k
        return ca.sqrt(load + 1e-12)


@dataclass(frozen=True, kw_only=True)
class HeatedWall(WallHeat):
    """The same with a wall that the gas warms up or cools down.

    C_w dT_w/dt = -Q + h (T_amb - T_w)   as   T_w = T_amb + E/C_w,   dE/dt = -Q - E/tau

    E is the heat stored in the wall and tau = C_w/h its time constant towards ambient.  The
    strength is 1/C_w: at zero the wall keeps its temperature whatever it takes up.

    Source: physics.md section 6 (wall_temperature), written with E so that the null is regular.
    """

    causes = (
        *WallHeat.causes,
        Cause(
            name="wall_temperature",
            strength="heating_k_j",
            forms=("wall_time_s",),
            shapes={"wall_time_s": (30.0, 200.0)},
            needs="coefficient_w_m2_k",
            balance=Balance.ENERGY,
            drivers=("heat given off so far",),
            shown_by="fill, close the valve, log the pressure for minutes",
            source="physics.md section 6 (wall_temperature)",
        ),
    )

    heating_k_j: Expression = strength(typical=0.02, upper=2.0)
    wall_time_s: Expression = form(100.0, lower=2.0, upper=1e4)

    def states(self) -> Iterator[State]:
        yield State("stored_j", initial=0.0, scale=10.0)

    def wall_temperature_k(self, now: Conditions) -> Expression:
        return now[self.wall].temperature_k + self.heating_k_j * now[self.name].stored_j

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        given_w = sum(term.value for term in self.terms(now))
        return {"stored_j": -given_w - now[self.name].stored_j / self.wall_time_s}


@dataclass(frozen=True, kw_only=True)
class StillWall(HeatedWall):
    """The same around gas at rest, which gives its heat to the wall by natural convection alone.

    Typical is 5 W/(m^2 K), of the 2 to 25 that gases have.

    Source: Incropera, "Fundamentals of heat and mass transfer", table 1.1.
    """

    coefficient_w_m2_k: Expression = strength(typical=5.0, upper=1e3)
