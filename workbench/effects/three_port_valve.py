"""A 3/2 proportional spool valve on one chamber: how it opens, and two models of what follows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import casadi as ca

from workbench.air import IsoLaw, NozzleLaw, choked_constant
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
from workbench.effects.leaks import CHAMBER_LEAK
from workbench.effects.spool_causes import (
    DISCHARGE_ASYMMETRY,
    EXHAUST_RESTRICTION,
    SPOOL_LEAK,
    SUPPLY_RESTRICTION,
)
from workbench.port import ChokedShare, port, spool_flow_kg_s
from workbench.spool import OpeningLaw, SmoothOpening, area_share, shut_while_stuck
from workbench.vessel import PressureRate


@dataclass(frozen=True, kw_only=True)
class SpoolOpening(Effect):
    """Openings of the fill and of the vent path by a command c from 0 to 1.

    s_fill = s((c - c_0) - w, 1 - c_f),   s_vent = s(-(c - c_0) - w, c_v)
    c_f = n + w,  c_v = n - w,  n the neutral command,  c_0 = n + offset
    A / A_max = 1 - (1 - s)^(1 + e), times 1 minus the restriction of that path

    s is the opening law, w the overlap on either side.  With a stuck spool the vent stays shut
    while c > c_v - band.

    Source: paper 004 (smax, Fig. 5), errata E004-3 and E004-6; c_f = 0.52, c_v = 0.48 and the
    corner of 0.01 are chosen in physics.md 2.6.
    """

    causes = (
        Cause(
            name="valve_offset",
            strength="offset_share",
            balance=Balance.VALVE,
            drivers=("command",),
            shown_by="constant commands near the centre",
            source="papers 000, 002; physics.md section 6 (offset)",
        ),
        Cause(
            name="valve_dead_zone",
            strength="overlap_share",
            balance=Balance.VALVE,
            drivers=("command near centre",),
            shown_by="slow command ramp through the centre",
            source="paper 004 Fig. 5; physics.md 2.6",
        ),
        Cause(
            name="valve_stuck_band",
            strength="stuck_band_share",
            balance=Balance.VALVE,
            drivers=("command just below centre",),
            kinked=True,
            shown_by="small negative commands from a high pressure",
            source="paper 004, Fig. 8 near 250 s; physics.md sections 6 and 7",
        ),
        Cause(
            name="area_shape",
            strength="area_exponent_change",
            balance=Balance.FLOW,
            drivers=("command at mid opening",),
            shown_by="steps to several openings",
            source="papers 000, 002; physics.md section 6 (area_shape)",
        ),
        DISCHARGE_ASYMMETRY,
    )

    chamber: str
    opening: OpeningLaw = SmoothOpening()
    neutral: float = 0.5

    offset_share: Expression = strength(typical=0.02, lower=-0.2, upper=0.2, deviation=2e-3)
    overlap_share: Expression = strength(typical=0.03, upper=0.2, deviation=2e-3)
    stuck_band_share: Expression = strength(typical=0.03, upper=0.3)
    area_exponent_change: Expression = strength(typical=0.6, lower=-0.5, upper=2.0)
    discharge_asymmetry: Expression = strength(typical=0.15, lower=-0.5, upper=0.5)
    corner_share: Expression = form(0.01, lower=1e-4, upper=0.1)

    @property
    def absent(self) -> bool:
        """Never: with all its flaws at null it is still the valve."""
        return False

    def shares(self, now: Conditions) -> tuple[Expression, Expression]:
        """Open shares of the full area, of the fill path and of the vent path."""
        travel = now[self.name].pwm - self.neutral - self.offset_share
        fill = self._share(travel, 1.0 - self.neutral)
        vent = self._share(-travel, self.neutral)
        stuck = shut_while_stuck(-travel - self.overlap_share, self.stuck_band_share)
        return fill, vent * (1.0 - stuck)

    def _share(self, travel: Expression, span: Expression) -> Expression:
        free, left = travel - self.overlap_share, span - self.overlap_share
        opening = self.opening(free, left, self.corner_share)
        return area_share(opening, 1.0 + self.area_exponent_change)


@dataclass(frozen=True, kw_only=True)
class ThreePortValve(SpoolOpening):
    """First principles: nozzles from the supply to the chamber and from there to the atmosphere.

    mdot = a_f phi(p_src, p) - a_v phi(p, p_atm),   phi by the nozzle law, direction by pressures
    a    = C (1 +- e) A_max A/A_max,   + where gas enters the chamber, - where it leaves

    kappa is the chamber's; alpha and beta of the paper are C times C_sub and C_chk with Z R/M as
    gas constant.  Its theta compares p_u/p_d, the inverse of the other papers' ratio (erratum
    E004-5).  The slope at equal pressures is infinite as printed; the straight line of physics.md
    1.1 c repairs it (E004-2).

    Source: paper 004 Eqs. 1 to 4; C may differ for filling and venting there.
    """

    causes = (
        *SpoolOpening.causes,
        EXHAUST_RESTRICTION,
        SUPPLY_RESTRICTION,
        SPOOL_LEAK,
        Cause(
            name="flow_shape",
            strength="iso_share",
            forms=("critical_ratio",),
            shapes={"critical_ratio": (0.2, 0.35)},
            balance=Balance.FLOW,
            drivers=("pressure ratio",),
            kind=Kind.PARAMETER,
            shown_by="the subsonic ends of filling and venting curves",
            source="paper 002 Eq. 3; physics.md section 6 (flow_b)",
        ),
    )

    flow_area_m2: Expression = form(25e-6, lower=1e-9, upper=1e-3, relative_deviation=0.05)
    discharge_coefficient: Expression = form(0.72, lower=0.1, upper=1.0)
    exhaust_restriction_share: Expression = strength(typical=0.4, upper=0.9)
    supply_restriction_share: Expression = strength(typical=0.4, upper=0.9)
    leak_area_m2: Expression = strength(typical=1e-7, upper=5e-6)
    iso_share: Expression = strength(typical=1.0, upper=1.0)
    critical_ratio: Expression = form(0.3, lower=0.05, upper=0.6)

    def terms(self, now: Conditions) -> Iterator[MassFlow]:
        paths, (fill, vent) = port(now, self.chamber), self.shares(now)
        kappa = now[self.chamber].heat_capacity_ratio
        full_m2 = self.discharge_coefficient * self.flow_area_m2
        full_m2 *= choked_constant(1.0, kappa) / choked_constant(1.0)
        filling_m2 = full_m2 * fill * (1.0 - self.supply_restriction_share)
        venting_m2 = full_m2 * vent * (1.0 - self.exhaust_restriction_share)
        law, leak_m2, asymmetry = self._law(kappa), self.leak_area_m2, self.discharge_asymmetry
        into_kg_s = spool_flow_kg_s(paths.charge, filling_m2, law, leak_m2, asymmetry)
        out_kg_s = spool_flow_kg_s(paths.vent, venting_m2, law, leak_m2, -asymmetry)
        yield from paths.flows(into_kg_s, out_kg_s, law, law)

    def _law(self, kappa: Expression) -> ChokedShare:
        """Flow over the choked flow: between the nozzle's and that of ISO 6358."""
        hole, iso = NozzleLaw(kappa), IsoLaw(self.critical_ratio)

        def law(ratio: Expression) -> Expression:
            nozzle = hole(ratio)
            return nozzle + self.iso_share * (iso(ratio) - nozzle)

        return law


@dataclass(frozen=True, kw_only=True)
class ParametricValve(SpoolOpening):
    """One time constant instead of flows: tau dp/dt = a f.

    f = p_src - p where a >= 0,   p - p_atm where a < 0;   a = s_fill - s_vent from -1 to 1

    With the smooth opening law a is the area map (a_f - a_v)/A_max; with :class:`SharpOpening` and
    no overlap it is the linear map 2 c - 1.  K A = 1.  a counts times 1 + e for filling and 1 - e
    for venting.

    A hole in the bellows, and a spool that seals neither path, are open all the time by a share of
    the full opening.  What is typical and most of them is that of :class:`ThreePortValve` and of
    :class:`ChamberLeak`, over its full area.

    Source: paper 004 Eqs. 5 and 6; tau 0.05 s (area map) and 0.075 s (linear map) are fitted to
    the first-principles model in physics.md 2.6; leaks by physics.md section 6 in terms of f.
    """

    causes = (
        *SpoolOpening.causes,
        replace(SPOOL_LEAK, strength="spool_leak_share"),
        replace(CHAMBER_LEAK, strength="chamber_leak_share"),
    )

    time_constant_s: Expression = form(0.05, lower=1e-3, upper=5.0, relative_deviation=0.05)
    spool_leak_share: Expression = strength(typical=0.004, upper=0.2)
    chamber_leak_share: Expression = strength(typical=0.012, upper=0.4)

    def terms(self, now: Conditions) -> Iterator[PressureRate]:
        own_pa = now[self.chamber].pressure_pa
        fill, vent = self.shares(now)
        net = fill - vent
        filling = (1.0 + self.discharge_asymmetry) * ca.fmax(net, 0.0)
        venting = (1.0 - self.discharge_asymmetry) * ca.fmin(net, 0.0)
        filling += self.spool_leak_share
        venting -= self.spool_leak_share + self.chamber_leak_share
        driven_pa = filling * (now["supply"].pressure_pa - own_pa)
        driven_pa += venting * (own_pa - now["atmosphere"].pressure_pa)
        yield PressureRate(self.chamber, driven_pa / self.time_constant_s)
