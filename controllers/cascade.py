"""Cascade: a force loop on the pressures inside, a position loop outside.

    F* = F_r - M (w^2 e + 2 z w (v - v_r) + K_i integral),   lowest <= F* <= highest
    opening = opening_r + W_f / b (F* - F) + c (v - v_r)

F is the force of both pressures, F_r and opening_r what the wanted motion needs, M the moved mass
and b the rise of the force per volt and second.  c undoes what the speed takes from the pressures.
So the position loop sees a mass behind a lag of 1 / W_f.  The wanted force stays below what supply
and atmosphere can give, and the integral rests there: that is the cascade's own anti-windup.

Source: a pressure or force loop inside the position loop is named as future work in paper 003; the
poles are placed on the modes as in the equations above.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import tau

import numpy as np

from controllers.lq import gain_of
from controllers.margins import Law, integral_of
from controllers.motion import PREVIEW
from controllers.positioning import (
    STATES,
    Memory,
    Positioning,
    PositioningSpec,
    positioning,
)
from controllers.scheduled import Schedule, scheduled
from controllers.spec import ranged
from controllers.unseen import waiting
from linearize.modes import HybridModel, Mode
from linearize.standard import PRESSURES, SUPPLY, VELOCITY
from workbench.contracts import Command, Estimate
from workbench.parts import Atmosphere

FINE = PositioningSpec(
    approach_m=0.012,
    band_m=2.2e-5,
    leave_m=5e-5,
    stribeck_share=1.0,
    turn_per_s=100.0,
    standing_per_s=12.5,
    turn_m_s=0.005,
)
"""The force loop catches a slide that breaks away: rest can be sought in a narrow band, and all of
the friction can be compensated as soon as the reference turns."""


@dataclass(frozen=True, kw_only=True)
class CascadeSpec:
    """Bandwidths of both loops, damping of the outer one, and the clock.

    Attributes
    ----------
    bandwidth_hz, damping
        Of the position loop: w / (2 pi), and z.
    force_bandwidth_hz
        Of the force loop; several times the other, or its lag takes the damping away.
    integral_time_s
        w^2 / K_i.
    force_share
        Of the largest force that supply and atmosphere give, which the wanted force may take.
    """

    sample_time_s: float = 1e-3
    bandwidth_hz: float = 15.0
    damping: float = 1.0
    force_bandwidth_hz: float = 70.0
    integral_time_s: float = 0.15
    force_share: float = ranged(0.8, most=1.0, above=True)
    positioning: PositioningSpec = field(default_factory=lambda: FINE)


@dataclass(frozen=True)
class CascadeGain:
    """Gains of both loops on one mode.

    force           V per N of missing force
    speed           V s/m that undo what the speed takes from the pressures
    outer           N per m, N s per m and N per m s
    poles           of the closed loop with integral, on the plane of s, 1/s, shape (5,)
    """

    force: float
    speed: float
    outer: np.ndarray
    poles: np.ndarray

    def feedback(self, area_m2: float) -> np.ndarray:
        """The same as a feedback of states and integral, V per unit of each, shape (5,)."""
        stiffness, damping, integral = self.force * self.outer
        at_pressure = self.force * area_m2
        return np.array([stiffness, damping - self.speed, at_pressure, -at_pressure, integral])

    def law(self, area_m2: float, sample_time_s: float) -> Law:
        """Its memory is the integral of the error."""
        *feedback, integral = self.feedback(area_m2)
        return integral_of(np.array(feedback), integral, sample_time_s)


@dataclass(frozen=True)
class Cascade:
    """The position by a wanted force, the force by the opening; see the module."""

    task: Positioning
    gains: Schedule[CascadeGain]
    sample_time_s: float
    largest_n: float
    preview: int = PREVIEW

    @property
    def laws(self) -> Schedule[Law]:
        """What it does while the slide moves and no limit is met."""
        numbers = self.task.area_m2, self.sample_time_s
        return self.gains.mapped(lambda gain: gain.law(*numbers))

    def start(self) -> Command:
        return Command(self.task.valve.shut, Memory())

    @waiting
    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        memory, valve, area = last.memory, self.task.valve, self.task.area_m2
        now = self.task.task(memory, reference, estimate.pick(STATES), self.sample_time_s)
        if now.rests:
            shut = valve.sent(0.0, estimate)
            return Command(shut, Memory(memory.integral_m_s, True), {"resting": 1.0})
        here = self.gains.weighted(now.x[0], now.ahead)
        force_v, speed_v = (sum(w * getattr(g, key) for w, g in here) for key in ("force", "speed"))
        integral = memory.integral_m_s + self.sample_time_s * now.rate_m
        outer = sum(w * gain.outer for w, gain in here)
        needed_n = area * (now.target[2] - now.target[3])
        wanted_n = needed_n - outer @ [*now.deviation[:2], integral]
        limited_n = float(np.clip(wanted_n, -self.largest_n, self.largest_n))
        missing_n = limited_n - area * (now.x[2] - now.x[3])
        wanted = now.opening_v + force_v * missing_n + speed_v * now.deviation[1]
        opening = float(np.clip(wanted, *valve.openings_v))
        if opening != wanted or limited_n != wanted_n:
            integral = memory.integral_m_s
        notes = {"opening_v": opening, "integral_m_s": integral, "force_n": limited_n}
        return Command(valve.sent(opening, estimate), Memory(integral), {"resting": 0.0, **notes})


def cascade(hybrid: HybridModel, spec: CascadeSpec | None = None) -> Cascade:
    """Both loops on every mode in which the valve drives the motion."""
    spec = spec or CascadeSpec()
    task, plant = positioning(hybrid, spec.positioning), hybrid.plant
    ambient_pa = next(float(m.pressure_pa) for m in plant.parts if isinstance(m, Atmosphere))
    largest_n = spec.force_share * task.area_m2 * (float(plant.values[SUPPLY]) - ambient_pa)
    gains = scheduled(hybrid, lambda mode: cascade_gain(mode, task.area_m2, spec))
    return Cascade(task, gains, spec.sample_time_s, largest_n)


def cascade_gain(mode: Mode, area_m2: float, spec: CascadeSpec) -> CascadeGain:
    """Gains of both loops by placing their poles on one mode."""
    v = mode.state_names.index(VELOCITY)
    first, second = (mode.state_names.index(name) for name in PRESSURES)
    mass_kg = area_m2 / mode.A[v, first]
    rise = area_m2 * (mode.B[first, 0] - mode.B[second, 0])
    taken = area_m2 * (mode.A[first, v] - mode.A[second, v])
    w = tau * spec.bandwidth_hz
    damping = 2.0 * spec.damping * w + mode.A[v, v]  # less what the mode damps by itself
    outer = mass_kg * np.array([w**2, damping, w**2 / spec.integral_time_s])
    gain = CascadeGain(tau * spec.force_bandwidth_hz / rise, -taken / rise, outer, np.zeros(0))
    poles = gain_of(mode, gain.feedback(area_m2), spec.sample_time_s).poles
    return replace(gain, poles=poles)
