"""A lever that turns about a fixed axis, and the force that loads it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from workbench.effect import (
    Conditions,
    Expression,
    Part,
    Received,
    State,
    Torque,
    form,
)
from workbench.linkage import TURNING
from workbench.parts import total


@dataclass(frozen=True, kw_only=True)
class Lever(Part):
    """A lever whose tip, ``arm_m`` away from the axis, moves along a line for small angles.

    J domega/dt = sum of torques,   x_tip = r theta

    Source: paper 003 (shift finger); physics.md 2.5.
    """

    balances = (TURNING,)

    tip_body: str

    inertia_kg_m2: Expression = form(1e-3, lower=1e-8, relative_deviation=0.05)
    arm_m: Expression = form(0.05, lower=1e-3)
    initial_angle_rad: float = 0.0

    def states(self) -> Iterator[State]:
        yield State("angle_rad", self.initial_angle_rad, scale=0.2, tolerance=2e-6)
        yield State("velocity_rad_s", initial=0.0, scale=20.0, tolerance=0.04)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        position_m = seen.get(f"{self.tip_body}.position_m")
        velocity_m_s = seen.get(f"{self.tip_body}.velocity_m_s")
        if position_m is None or velocity_m_s is None:
            return {}
        return {
            "angle_rad": (position_m / self.arm_m, 2e-3),
            "velocity_rad_s": (velocity_m_s / self.arm_m, 1.0),
        }

    def derive(self, now: Conditions) -> dict[str, Expression]:
        own = now[self.name]
        return {
            "arm_m": self.arm_m,
            "inertia_kg_m2": self.inertia_kg_m2,
            "tip_m": self.arm_m * own.angle_rad,
            "tip_velocity_m_s": self.arm_m * own.velocity_rad_s,
        }

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        return {
            "angle_rad": now[self.name].velocity_rad_s,
            "velocity_rad_s": total(received(self.name), Torque) / self.inertia_kg_m2,
        }


@dataclass(frozen=True, kw_only=True)
class LeverLoad(Part):
    """A force from outside against a lever: torque -F r.  A recorded force takes its place.

    Source: paper 003 (load force of the synchroniser side, zero in its validation); physics.md 2.5.
    """

    lever: str

    arm_m: Expression = form(0.06, lower=1e-3)
    force_n: Expression = form(0.0, lower=-5e3, upper=5e3)

    def derive(self, now: Conditions) -> dict[str, Expression]:
        return {"force_n": self.force_n}

    def terms(self, now: Conditions) -> Iterator[Torque]:
        yield Torque(self.lever, -now[self.name].force_n * self.arm_m)
