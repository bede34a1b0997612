"""The parts that own a balance: a body its momentum, a chamber its gas, a supply its pressure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import pi

import casadi as ca
import numpy as np

from workbench.balances import BalanceEquation
from workbench.effect import (
    AddedMass,
    Balance,
    Cause,
    Conditions,
    Expression,
    Force,
    Kind,
    Part,
    Received,
    State,
    Term,
    form,
    strength,
)
from workbench.gas_volume import GasVolume, total


@dataclass(frozen=True, kw_only=True)
class Supply(Part):
    """The compressed-air supply seen by the valve; a recorded pressure takes its place.

    Source: paper 002 table of constants; 2 % and 2 K are physics.md's uncertainties (chosen).
    """

    pressure_pa: Expression = form(7e5, lower=1.0, upper=2e6, relative_deviation=0.02)
    temperature_k: Expression = form(293.15, lower=200.0, upper=400.0, deviation=2.0)

    def derive(self, now: Conditions) -> dict[str, Expression]:
        return {"pressure_pa": self.pressure_pa, "temperature_k": self.temperature_k}


@dataclass(frozen=True, kw_only=True)
class Atmosphere(Part):
    """What surrounds the actuator.  Source: physics.md section 0."""

    pressure_pa: Expression = form(1.013e5, lower=1.0, upper=2e5, relative_deviation=1e-3)
    temperature_k: Expression = form(293.15, lower=200.0, upper=400.0)

    def derive(self, now: Conditions) -> dict[str, Expression]:
        return {"pressure_pa": self.pressure_pa, "temperature_k": self.temperature_k}


@dataclass(frozen=True, kw_only=True)
class Body(Part):
    """A body moving along one line.

    (m + dm + sum of added masses) dv/dt = sum of forces

    For the solvers: ``travel_m`` is a typical distance, ``step_error_m`` what one step may err.

    Source: paper 002 Eq. 9 and the like in 000, 001, 003.
    """

    causes = (
        Cause(
            name="added_mass",
            strength="added_mass_kg",
            balance=Balance.MOMENTUM,
            drivers=("acceleration",),
            kind=Kind.PARAMETER,
            held="mass_kg",
            shown_by="fast steps with and without a known mass added",
            source="physics.md section 6 (payload)",
        ),
    )
    balances = (
        BalanceEquation(
            balance=Balance.MOMENTUM,
            kind=Force,
            term="force_n",
            state="velocity_m_s",
            rates=(1.0, 5.0),
        ),
    )

    mass_kg: Expression = form(1.0, lower=1e-3, relative_deviation=0.05)
    added_mass_kg: Expression = strength(typical=1.0, lower=-1.0, upper=5.0)

    initial_position_m: float = 0.0
    travel_m: float = 0.1
    step_error_m: float = 2e-8

    def states(self) -> Iterator[State]:
        yield State("position_m", self.initial_position_m, self.travel_m, self.step_error_m)
        yield State("velocity_m_s", initial=0.0, scale=1.0, tolerance=2e-3)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        position_m = seen.get(f"{self.name}.position_m")
        if position_m is None:
            return {}
        velocity_m_s = seen[f"{self.name}.velocity_m_s"]
        return {"position_m": (position_m, 2e-5), "velocity_m_s": (velocity_m_s, 1e-2)}

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        got = received(self.name)
        mass_kg = now[self.name].moving_mass_kg + total(got, AddedMass)
        return {
            "position_m": now[self.name].velocity_m_s,
            "velocity_m_s": total(got, Force) / mass_kg,
        }

    def derive(self, now: Conditions) -> dict[str, Expression]:
        return {"moving_mass_kg": self.mass_kg + self.added_mass_kg}


@dataclass(frozen=True, kw_only=True)
class HeldRod(Part):
    """A rod that a force sensor pushes along while its motion and the pressure are recorded.

    The motion is slow, so the sensor holds the balance: its force on the rod, positive towards
    growing position, is minus the sum of all others; no state.

    Source: physics.md 2.7, ``cylinder_bench``.
    """

    def close(self, now: Conditions, received: Received) -> dict[str, Expression]:
        return {"force_n": -total(received(self.name), Force)}


@dataclass(frozen=True, kw_only=True)
class PressureFace(Part):
    """A piston face under a recorded chamber pressure, ambient on the other side.

    F = side (p - p_atm) A,    side +1 where pressure pushes towards growing position

    Source: physics.md 2.7, the plants of the real recordings.
    """

    body: str
    side: int = 1
    area_m2: Expression = form(5e-4, lower=1e-9)

    def terms(self, now: Conditions) -> Iterator[Force]:
        gauge_pa = now[self.name].pressure_pa - now["atmosphere"].pressure_pa
        yield Force(self.body, self.side * self.area_m2 * gauge_pa)


@dataclass(frozen=True, kw_only=True)
class Chamber(GasVolume):
    """A gas volume closed by a moving body, with its pressure and its mass of gas as states.

    V = V_dead (1 + e) + A l,   l = x - x_0 (side +1)   or   x_0 + L - x (side -1)

    The stroke of length L begins at x_0.

    Surface of the wall: 2 A + pi d l, with d the diameter and l the length of the chamber.

    Source: paper 002 Eqs. 4 and 5, in the balance of :class:`GasVolume`; dead volume by erratum
    E002-8.
    """

    causes = (
        Cause(
            name="dead_volume",
            strength="dead_volume_change",
            balance=Balance.MASS,
            drivers=("position near the ends",),
            kind=Kind.PARAMETER,
            held="dead_volume_m3",
            shown_by="strokes to both ends",
            source="paper 002 table 6; physics.md section 6 (dead_volume)",
        ),
    )

    body: str
    side: int
    area_m2: Expression = form(1e-3, lower=1e-9)
    stroke_m: Expression = form(0.1, lower=1e-6)
    lower_m: Expression = form(0.0, lower=-10.0, upper=10.0)
    dead_volume_m3: Expression = form(1e-5, lower=1e-9, relative_deviation=0.05)
    dead_volume_change: Expression = strength(typical=0.5, lower=-0.87, upper=2.0)
    initial_position_m: float = 0.0

    @property
    def bodies(self) -> tuple[str, ...]:
        """What closes the chamber."""
        return (self.body,)

    @property
    def initial_positions_m(self) -> tuple[float, ...]:
        """Where the bodies are at the start."""
        return (self.initial_position_m,)

    def initial_volume_m3(self) -> Expression:
        return self.volume_m3(*self.initial_positions_m)

    def length_m(self, position_m: Expression) -> Expression:
        """Length of the chamber with the body at ``position_m``."""
        travel_m = position_m - self.lower_m
        return travel_m if self.side > 0 else self.stroke_m - travel_m

    def volume_m3(self, position_m: Expression) -> Expression:
        """Gas volume with the body at ``position_m``."""
        dead_m3 = self.dead_volume_m3 * (1.0 + self.dead_volume_change)
        return dead_m3 + self.area_m2 * self.length_m(position_m)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        pressure_pa = seen.get(f"{self.name}.pressure_pa")
        positions_m = [seen.get(f"{body}.position_m") for body in self.bodies]
        if pressure_pa is None or any(position_m is None for position_m in positions_m):
            return {}
        return self.guessed(pressure_pa, self.volume_m3(*positions_m))

    def derive(self, now: Conditions) -> dict[str, Expression]:
        body = now[self.body]
        positions_m = (now[name].position_m for name in self.bodies)
        dead_m3 = self.dead_volume_m3 * (1.0 + self.dead_volume_change)
        # Only solvers come this far: geometry.py refuses stops that let a body go there.
        volume_m3 = ca.fmax(self.volume_m3(*positions_m), 0.1 * dead_m3)
        length_m = self.length_m(body.position_m)
        around_m = pi * ca.sqrt(4.0 / pi * self.area_m2)
        return self.gas(now, volume_m3) | {
            "volume_rate_m3_s": self.side * self.area_m2 * body.velocity_m_s,
            "length_m": length_m,
            "area_m2": self.area_m2,
            "surface_m2": 2.0 * self.area_m2 + around_m * ca.fmax(length_m, 0.0),
        }

    def terms(self, now: Conditions) -> Iterator[Term]:
        yield Force(self.body, self.side * self.area_m2 * now[self.name].pressure_pa)


PARTS = (Supply, Atmosphere, Body, HeldRod, PressureFace, Chamber)
