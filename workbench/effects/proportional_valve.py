"""A proportional valve with underlap, whose ports never close: one hole to each chamber."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi

import casadi as ca

from workbench.air import GAS_CONSTANT_J_KG_K, NozzleLaw, Path
from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Effect,
    Expression,
    MassFlow,
    form,
    strength,
)
from workbench.effects.spool_causes import (
    DISCHARGE_ASYMMETRY,
    EXHAUST_RESTRICTION,
    SUPPLY_RESTRICTION,
)
from workbench.port import port

STEEPEST_V = 0.02  # half width of the transition where the underlap is absent: a slope at the null
EDGE = 1e-9  # of the radius: the segment's angle has no slope at the very edge of the hole


def segment_area_m2(height_m: Expression, radius_m: Expression) -> Expression:
    """Area of a circle's segment, the height within [0, 2 R].

    A_seg(h) = R^2 acos((R-h)/R) - (R-h) sqrt(2 R h - h^2)

    Source: paper 000 Eq. 10; R is the hole's radius here, not the gas constant (erratum E000-6).
    """
    bounded = ca.fmin(ca.fmax(height_m / radius_m, EDGE), 2.0 - EDGE)
    return radius_m**2 * (
        ca.acos(1.0 - bounded) - (1.0 - bounded) * ca.sqrt(2.0 * bounded - bounded**2)
    )


@dataclass(frozen=True)
class InputPressure:
    """One hole to each chamber, from an input pressure between exhaust and supply.

    P_in = (P_S + P_E)/2 + (P_S - P_E)/2 tanh(pi du / w),    mdot = A_eq(du) Psi(P_in -> P)

    Without underlap, w = 0, this is hard switching between the fixed pressures P_S and P_E.  Of
    the gas, the share (P_in - P_E) / (P_S - P_E) comes from the supply (chosen).

    Source: paper 000 Eq. 9, method 4.
    """

    def __call__(
        self, valve: ProportionalValve, chamber: str, offset_v: Expression, now: Conditions
    ) -> Iterator[MassFlow]:
        gas, supply, outside = now[chamber], now["supply"], now["atmosphere"]
        share = self.supply_share(valve, offset_v)
        inlet_pa = outside.pressure_pa + share * (supply.pressure_pa - outside.pressure_pa)
        ends = (inlet_pa, supply.temperature_k, gas.pressure_pa, gas.temperature_k)
        path = Path(*ends, valve.gas_constant_j_kg_k)
        hole_m2 = valve.equivalent_area_m2(offset_v)
        into_kg_s = gas.line_share * path.flow_kg_s(hole_m2, NozzleLaw())
        yield MassFlow(chamber, into_kg_s, path.temperature_k, NozzleLaw()(path.ratio))
        yield MassFlow("supply", -share * into_kg_s, path.temperature_k)

    @staticmethod
    def supply_share(valve: ProportionalValve, offset_v: Expression) -> Expression:
        """(P_in - P_E) / (P_S - P_E): 0 where the chamber is exhausted, 1 where it is charged."""
        return 0.5 + 0.5 * ca.tanh(pi * offset_v / valve.transition_v)


@dataclass(frozen=True)
class TwoFlows:
    """A hole to the supply and one to the exhaust, both open around the centre.

    A_s = g_c (du + w)+,   A_e = g_d (w - du)+,   g (span + w) = c_d pi R^2: full at du = span

    At the centre the chamber rests where g_c psi(P / P_S) = g_d P / P_S: at 0.80746 of the supply
    pressure where charging and discharging coefficient are equal, at 0.8425 with the 0.62 and 0.55
    of paper 000's rig.  The shape of the hole and its clearance do not enter.

    Source: paper 000, method 3, which it rejects; scaled to the same full opening (chosen).
    """

    def __call__(
        self, valve: ProportionalValve, chamber: str, offset_v: Expression, now: Conditions
    ) -> Iterator[MassFlow]:
        supplied_m2 = valve.charging_coefficient * self._opened_m2(valve, offset_v)
        vented_m2 = valve.discharging_coefficient * self._opened_m2(valve, -offset_v)
        yield from valve.through(chamber, supplied_m2, vented_m2, now)

    @staticmethod
    def _opened_m2(valve: ProportionalValve, offset_v: Expression) -> Expression:
        opening = (offset_v + valve.underlap_v) / (valve.span_v + valve.underlap_v)
        return pi * valve.radius_m**2 * ca.fmin(ca.fmax(opening, 0.0), 1.0)


@dataclass(frozen=True, kw_only=True)
class ProportionalValve(Effect):
    """Above the centre ``first`` is charged and ``second`` exhausted; below, the reverse.

    du    = u - u_0 at ``first``,  u_0 - u at ``second``
    h     = c_2 + (2 R - c_2) |du| / span,   at most 2 R
    A_eq  = c_d [(1 - s) pi R h / 2 + s A_seg(h) + Y]
    c_d   = c (1 + e) (1 - supply share) for du >= 0,  c (1 - e) (1 - exhaust share) for du < 0

    ``area_shape_share`` s turns a linear area (0) into the segment of a circle (1).  With
    ``underlap_v`` = 0, s = 0 and c_2 = 0 this is the plain model that paper 000 compares with:
    linear area and fixed pressures.  ``underlap`` says how the ports overlap near the centre.
    Flow direction follows the pressures (erratum E000-4).  A worn spool leaks from the supply to
    each chamber and from there to the exhaust, whatever the command.

    Source: paper 000 Eqs. 8 to 10, values of physics.md 2.1; sizes of the hole, span and discharge
    coefficients are chosen there.  Paper 001 prints a coefficient of 0.016, which is none (E001-2).
    """

    causes = (
        Cause(
            name="valve_underlap",
            strength="underlap_v",
            balance=Balance.VALVE,
            drivers=("command near centre",),
            kinked=True,
            shown_by="piston held, voltage staircase around the centre",
            source="paper 000 Eq. 9; physics.md section 6 (underlap_tanh)",
        ),
        Cause(
            name="area_shape",
            strength="area_shape_share",
            balance=Balance.FLOW,
            drivers=("opening",),
            shown_by="fills and vents at several openings",
            source="paper 000 Eq. 10; physics.md section 6 (area_shape)",
        ),
        DISCHARGE_ASYMMETRY,
        EXHAUST_RESTRICTION,
        SUPPLY_RESTRICTION,
        Cause(
            name="spool_leak",
            strength="leak_area_m2",
            balance=Balance.MASS,
            drivers=("pressures while the valve is at its centre",),
            shown_by="piston held at the centre, from two different pressures",
            source="physics.md section 6 (spool_leak)",
        ),
    )

    first: str
    second: str
    underlap: InputPressure | TwoFlows = InputPressure()
    gas_constant_j_kg_k: float = GAS_CONSTANT_J_KG_K

    underlap_v: Expression = strength(typical=0.75, upper=1.5, deviation=0.02)
    area_shape_share: Expression = strength(typical=1.0, upper=1.5)
    discharge_asymmetry: Expression = strength(typical=0.15, lower=-0.5, upper=0.5, deviation=0.02)
    exhaust_restriction_share: Expression = strength(typical=0.5, upper=0.9)
    supply_restriction_share: Expression = strength(typical=0.5, upper=0.9)
    leak_area_m2: Expression = strength(typical=5e-8, upper=1e-6)

    discharge_coefficient: Expression = form(0.6, lower=0.05, upper=1.2, relative_deviation=0.05)
    radius_m: Expression = form(1e-3, lower=1e-5, upper=1e-2)
    clearance_m: Expression = form(1e-4, lower=0.0, upper=1e-3, relative_deviation=0.05)
    offset_area_m2: Expression = form(0.0, lower=0.0, upper=1e-5)
    centre_v: Expression = form(5.0, lower=0.1, upper=9.9)
    span_v: Expression = form(4.75, lower=0.1, upper=24.0)

    @property
    def absent(self) -> bool:
        """Never: with all its flaws at null it is still the valve."""
        return False

    @property
    def transition_v(self) -> Expression:
        """Half width of the transition between exhaust and supply: the underlap, never zero."""
        return self.underlap_v + STEEPEST_V * ca.exp(-self.underlap_v / STEEPEST_V)

    @property
    def charging_coefficient(self) -> Expression:
        """Discharge coefficient of the flow into a chamber."""
        open_share = 1.0 - self.supply_restriction_share
        return self.discharge_coefficient * (1.0 + self.discharge_asymmetry) * open_share

    @property
    def discharging_coefficient(self) -> Expression:
        """Discharge coefficient of the flow out of a chamber."""
        open_share = 1.0 - self.exhaust_restriction_share
        return self.discharge_coefficient * (1.0 - self.discharge_asymmetry) * open_share

    def equivalent_area_m2(self, offset_v: Expression) -> Expression:
        """A_eq(du): the one hole between a chamber and its input pressure."""
        share = ca.fmin(ca.fabs(offset_v) / self.span_v, 1.0)
        height_m = self.clearance_m + (2.0 * self.radius_m - self.clearance_m) * share
        linear_m2 = pi * self.radius_m * height_m / 2.0
        bent_m2 = segment_area_m2(height_m, self.radius_m) - linear_m2
        hole_m2 = linear_m2 + self.area_shape_share * bent_m2 + self.offset_area_m2
        charging, discharging = self.charging_coefficient, self.discharging_coefficient
        return ca.if_else(offset_v >= 0, charging, discharging) * hole_m2

    def terms(self, now: Conditions) -> Iterator[MassFlow]:
        offset_v = now[self.name].command_v - self.centre_v
        yield from self.underlap(self, self.first, offset_v, now)
        yield from self.underlap(self, self.second, -offset_v, now)
        for chamber in (self.first, self.second):
            yield from self.through(chamber, self.leak_area_m2, self.leak_area_m2, now)

    def through(
        self, chamber: str, supplied_m2: Expression, vented_m2: Expression, now: Conditions
    ) -> Iterator[MassFlow]:
        """Flows through a hole to the supply and one to the exhaust."""
        law, paths = NozzleLaw(), port(now, chamber, self.gas_constant_j_kg_k)
        into_kg_s = paths.charge.flow_kg_s(supplied_m2, law)
        out_kg_s = paths.vent.flow_kg_s(vented_m2, law)
        yield from paths.flows(into_kg_s, out_kg_s, law, law)
