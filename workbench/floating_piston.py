"""A piston that another one pushes ahead of it, and the chambers that both of them close."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from workbench.air import NozzleLaw, path_between
from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Expression,
    Force,
    MassFlow,
    Term,
    form,
    strength,
)
from workbench.parts import Body, Chamber


@dataclass(frozen=True, kw_only=True)
class FloatingPiston(Body):
    """A body that rests at zero until another one pushes it ahead: nobody records where it is.

    Source: paper 003 (floating piston).
    """

    pushed_by: str

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        if f"{self.name}.position_m" in seen:
            return super().guess(seen)
        position_m = seen.get(f"{self.pushed_by}.position_m")
        if position_m is None:
            return {}
        velocity_m_s = np.where(position_m > 0.0, seen[f"{self.pushed_by}.velocity_m_s"], 0.0)
        return {
            "position_m": (np.maximum(position_m, 0.0), 1e-4),
            "velocity_m_s": (velocity_m_s, 0.1),
        }


@dataclass(frozen=True, kw_only=True)
class SharedChamber(Chamber):
    """A chamber that a second body closes too.

    V = V_1 + A_2 x_2  (second side +1)   or   V_1 + A_2 (L_2 - x_2)  (second side -1)

    with V_1 the volume by the first body.  The wall that heat passes through is 2 A_2 (*chosen*).

    Source: paper 003, chamber 2 and the control chamber; geometry chosen in physics.md 2.5.
    """

    second_body: str
    second_side: int
    second_area_m2: Expression = form(1e-3, lower=1e-9)
    second_stroke_m: Expression = form(0.1, lower=1e-6)
    initial_second_position_m: float = 0.0

    @property
    def bodies(self) -> tuple[str, ...]:
        return (self.body, self.second_body)

    @property
    def initial_positions_m(self) -> tuple[float, ...]:
        return (self.initial_position_m, self.initial_second_position_m)

    def volume_m3(self, position_m: Expression, second_m: Expression) -> Expression:
        """Gas volume with the bodies at these positions."""
        length_m = second_m if self.second_side > 0 else self.second_stroke_m - second_m
        return super().volume_m3(position_m) + self.second_area_m2 * length_m

    def derive(self, now: Conditions) -> dict[str, Expression]:
        second_m3_s = self.second_side * self.second_area_m2 * now[self.second_body].velocity_m_s
        derived = super().derive(now)
        first_m3_s = derived["volume_rate_m3_s"]
        wall_m2 = 2.0 * self.second_area_m2
        return derived | {"volume_rate_m3_s": first_m3_s + second_m3_s, "surface_m2": wall_m2}

    def terms(self, now: Conditions) -> Iterator[Term]:
        pressure_pa = self.acting_pressure_pa(now)
        yield Force(self.body, self.side * self.area_m2 * pressure_pa)
        yield Force(self.second_body, self.second_side * self.second_area_m2 * pressure_pa)

    def acting_pressure_pa(self, now: Conditions) -> Expression:
        """The pressure that the two bodies feel."""
        return now[self.name].pressure_pa


@dataclass(frozen=True, kw_only=True)
class ControlChamber(SharedChamber):
    """A shared chamber that breathes through a port without a valve.

    mdot = -A_port C_chk p_u/sqrt(T_u) psi(p_d/p_u),   p_acting = p_atm + share (p_c - p_atm)

    The strength is the share of its pressure that the pistons feel: at null they feel the
    atmosphere, as in the reduced model of the paper, whatever the port does.

    Source: paper 003 (nonlinear model; p_c = p_amb in its Sec. V); physics.md 2.5 and section 6.
    The port's 12 mm2 are chosen; the share form is that of architecture.md section 4.
    """

    causes = (
        *Chamber.causes,
        Cause(
            name="control_chamber",
            strength="acting_share",
            forms=("port_area_m2",),
            balance=Balance.MOMENTUM,
            drivers=("velocity", "position"),
            sizes=(0.3, 0.6, 1.0),
            shapes={"port_area_m2": (1e-6, 4e-6, 12e-6)},
            shown_by="fast shifts in both directions",
            source="paper 003; physics.md section 6 (control_chamber)",
        ),
    )

    acting_share: Expression = strength(typical=1.0, upper=1.0, relative_deviation=0.0)
    port_area_m2: Expression = form(12e-6, lower=1e-8, upper=1e-3, relative_deviation=0.05)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        """Near the atmosphere where it is not recorded."""
        name, place_m = f"{self.name}.pressure_pa", seen.get(f"{self.body}.position_m")
        if name in seen or place_m is None:
            return super().guess(seen)
        near = super().guess({**seen, name: np.full_like(place_m, self.initial_pressure_pa)})
        return near | {"pressure_pa": (self.initial_pressure_pa, 1e4)} if near else {}

    def acting_pressure_pa(self, now: Conditions) -> Expression:
        outside_pa = now["atmosphere"].pressure_pa
        return outside_pa + self.acting_share * (now[self.name].pressure_pa - outside_pa)

    def terms(self, now: Conditions) -> Iterator[Term]:
        yield from super().terms(now)
        path = path_between(now[self.name], now["atmosphere"])
        lost_kg_s = path.flow_kg_s(self.port_area_m2, NozzleLaw())
        yield MassFlow(self.name, -lost_kg_s, path.temperature_k, NozzleLaw()(path.ratio))
