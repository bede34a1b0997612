"""A 5/3 proportional directional control valve feeding two chambers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca

from workbench.air import GAS_CONSTANT_J_KG_K, IsoLaw
from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Effect,
    Expression,
    Kind,
    MassFlow,
    form,
    strength,
)
from workbench.effects.spool_causes import (
    DISCHARGE_ASYMMETRY,
    EXHAUST_RESTRICTION,
    SPOOL_LEAK,
    SUPPLY_RESTRICTION,
)
from workbench.port import port, spool_flow_kg_s
from workbench.spool import area_share


@dataclass(frozen=True, kw_only=True)
class FivePortValve(Effect):
    """Spool above centre: ``first`` is charged and ``second`` exhausted; below, the reverse.

    Without a ``second`` chamber that port is blocked.

    s        = (u - u_c) / (10 V - u_c)  above,   (u_c - u) / u_c  below the centre
    A_path   = A_max f [1 - (1 - s)^e],  f = f_supply, or f_exhaust (1 - share)
    mdot     = C_d A_path C_chk p_u / sqrt(T_u) psi(p_d / p_u)  +  leak

    e is ``area_exponent`` plus its change, and both critical ratios shift together.  C_d counts
    times 1 + a where gas enters a chamber and 1 - a where it leaves, a ``discharge_asymmetry``.

    The dead zone alters the command before it comes here; ``underlap_v`` opens every path that
    much earlier, so that near the centre all four are open at once.  The closed-centre leak is one
    constant effective area on each of the four paths with the nozzle law, which rests at 0.80746
    of the supply pressure (physics.md 1.1 d; paper 002's P_0 is this value).

    Source: paper 002 Eqs. 1 to 3 and Fig. 4, arguments by errata E002-1 to E002-4.  The area law,
    its exponent 1.6, the fractions and b, a, m are chosen: the paper's look-up tables are not
    printed.
    """

    causes = (
        EXHAUST_RESTRICTION,
        SPOOL_LEAK,
        Cause(
            name="valve_underlap",
            strength="underlap_v",
            balance=Balance.VALVE,
            drivers=("command near centre",),
            kinked=True,
            shown_by="slow voltage ramp through the centre",
            source="paper 000, method 3; physics.md 2.1 two-flow underlap",
        ),
        SUPPLY_RESTRICTION,
        DISCHARGE_ASYMMETRY,
        Cause(
            name="area_shape",
            strength="area_exponent_change",
            balance=Balance.FLOW,
            drivers=("command at mid opening",),
            kind=Kind.PARAMETER,
            held="area_exponent",
            shown_by="steps to several openings",
            source="papers 000, 002; physics.md section 6 (area_shape)",
        ),
        Cause(
            name="flow_shape",
            strength="critical_ratio_change",
            balance=Balance.FLOW,
            drivers=("pressure ratio",),
            kind=Kind.PARAMETER,
            shown_by="the subsonic ends of charging and exhausting curves",
            source="paper 002 Eq. 3; physics.md section 6 (flow_b)",
        ),
    )

    first: str
    second: str | None = None
    gas_constant_j_kg_k: float = GAS_CONSTANT_J_KG_K

    flow_area_m2: Expression = form(1e-5, lower=1e-9, upper=1e-3, relative_deviation=0.05)
    exhaust_restriction_share: Expression = strength(typical=0.5, upper=0.9)
    leak_area_m2: Expression = strength(typical=2e-7, upper=5e-6)
    underlap_v: Expression = strength(typical=0.3, upper=1.5, deviation=0.02)
    supply_restriction_share: Expression = strength(typical=0.5, upper=0.9)
    discharge_asymmetry: Expression = strength(typical=0.15, lower=-0.5, upper=0.5)
    area_exponent_change: Expression = strength(typical=0.6, lower=-0.9, upper=1.5)
    critical_ratio_change: Expression = strength(typical=-0.15, lower=-0.3, upper=0.15)

    discharge_coefficient: Expression = form(0.5513, lower=0.1, upper=1.0)
    supply_fraction: Expression = form(0.80, lower=0.05, upper=1.5)
    exhaust_fraction: Expression = form(0.65, lower=0.05, upper=1.5)
    area_exponent: Expression = form(1.6, lower=1.0, upper=3.0, deviation=0.1)  # chosen
    centre_v: Expression = form(5.0, lower=0.1, upper=9.9)
    full_v: Expression = form(10.0, lower=1.0, upper=24.0)
    supply_critical_ratio: Expression = form(0.35, lower=0.05, upper=0.6)
    exhaust_critical_ratio: Expression = form(0.30, lower=0.05, upper=0.6)
    cracking_ratio: Expression = form(0.995, lower=0.8, upper=1.0)
    subsonic_index: Expression = form(0.52, lower=0.3, upper=0.9)

    @property
    def absent(self) -> bool:
        """Never: with all its flaws at null it is still the valve."""
        return False

    def terms(self, now: Conditions) -> Iterator[MassFlow]:
        offset_v = now[self.name].command_v - self.centre_v
        forward = self._area_m2(offset_v, self.full_v - self.centre_v)
        reverse = self._area_m2(-offset_v, self.centre_v)
        yield from self._port(self.first, forward, reverse, now)
        if self.second is not None:
            yield from self._port(self.second, reverse, forward, now)

    def _area_m2(self, offset_v: Expression, range_v: Expression) -> Expression:
        """Effective area of a path, without its fraction, at an offset towards its own side."""
        opening = ca.fmax(offset_v + self.underlap_v, 0.0) / (range_v + self.underlap_v)
        share = area_share(opening, self.area_exponent + self.area_exponent_change)
        return self.discharge_coefficient * self.flow_area_m2 * share

    def _port(
        self, chamber: str, charging_m2: Expression, exhausting_m2: Expression, now: Conditions
    ) -> Iterator[MassFlow]:
        paths = port(now, chamber, self.gas_constant_j_kg_k)
        inlet, outlet = (
            IsoLaw(b + self.critical_ratio_change, self.cracking_ratio, self.subsonic_index)
            for b in (self.supply_critical_ratio, self.exhaust_critical_ratio)
        )
        charging_m2 *= self.supply_fraction * (1.0 - self.supply_restriction_share)
        exhausting_m2 *= self.exhaust_fraction * (1.0 - self.exhaust_restriction_share)
        leak_m2, asymmetry = self.leak_area_m2, self.discharge_asymmetry
        into_kg_s = spool_flow_kg_s(paths.charge, charging_m2, inlet, leak_m2, asymmetry)
        out_kg_s = spool_flow_kg_s(paths.vent, exhausting_m2, outlet, leak_m2, -asymmetry)
        yield from paths.flows(into_kg_s, out_kg_s, inlet, outlet)
