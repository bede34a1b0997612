"""Gas that leaves a chamber past a seal: to the atmosphere, or to the chamber next door."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from workbench.air import NozzleLaw, path_between
from workbench.effect import Balance, Cause, Conditions, Effect, Expression, MassFlow, strength

CHAMBER_LEAK = Cause(
    name="chamber_leak",
    strength="area_m2",
    balance=Balance.MASS,
    drivers=("chamber pressure",),
    shown_by="fill slowly (gas at room temperature), close, log the pressure for minutes",
    source="papers 002 Fig. 15, 004; physics.md section 6 (leak_ambient)",
)


@dataclass(frozen=True, kw_only=True)
class ChamberLeak(Effect):
    """A small fixed hole from a chamber to the atmosphere.

    mdot = -A C_chk p/sqrt(T) psi(p_atm/p), nozzle law

    Source: observed in paper 002 (Fig. 15) and presumed in 004; physics.md section 6
    (leak_ambient).
    """

    causes = (CHAMBER_LEAK,)

    chamber: str
    area_m2: Expression = strength(typical=3e-7, upper=1e-5)

    def terms(self, now: Conditions) -> Iterator[MassFlow]:
        gas, outside = now[self.chamber], now["atmosphere"]
        path = path_between(gas, outside)
        lost_kg_s = path.flow_kg_s(self.area_m2, NozzleLaw())
        yield MassFlow(self.chamber, -lost_kg_s, path.temperature_k, NozzleLaw()(path.ratio))


@dataclass(frozen=True, kw_only=True)
class HairlineLeak(ChamberLeak):
    """The same where a chamber holds its gas for hours: what a decay of minutes is to show.

    A typical area takes 0.3 % of 8 bar from a tenth of a litre in a minute (*chosen*, as the volume
    of such a chamber is: only their ratio shows).

    Source: that of :class:`ChamberLeak`.
    """

    area_m2: Expression = strength(typical=3e-11, upper=1e-5)


@dataclass(frozen=True, kw_only=True)
class PistonLeak(Effect):
    """A small fixed hole through the piston, from the chamber of higher pressure to the other.

    Source: physics.md section 6 (leak_cross), after Richer and Hurmuzlu 2000.
    """

    causes = (
        Cause(
            name="piston_leak",
            strength="area_m2",
            balance=Balance.MASS,
            drivers=("pressure difference",),
            shown_by="load the piston against a stop, close the valve, log both pressures",
            source="physics.md section 6 (leak_cross)",
        ),
    )

    first: str
    second: str
    area_m2: Expression = strength(typical=5e-7, upper=1e-5)

    def terms(self, now: Conditions) -> Iterator[MassFlow]:
        path = path_between(now[self.first], now[self.second])
        crossing_kg_s = path.flow_kg_s(self.area_m2, NozzleLaw())
        yield MassFlow(self.first, -crossing_kg_s, path.temperature_k, NozzleLaw()(path.ratio))
        yield MassFlow(self.second, crossing_kg_s, path.temperature_k)
