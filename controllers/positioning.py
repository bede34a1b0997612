"""What every position controller of a pneumatic slide shares: target, dry friction, rest.

Sliding.  The wanted motion needs certain pressures and a certain opening; see
:mod:`controllers.motion`.

Stribeck.  Below the Stribeck velocity friction rises above Coulomb's; a share of that rise is
added to the wanted pressure difference in the direction in which the slide is to move.

Rest.  A pneumatic slide with dry friction hunts under plain integral action: chamber and
integrator both keep charging while the slide sticks, and it breaks away too far.  So inside a
small band, at rest, the valve is shut and the integral frozen, until the error leaves a wider
band or the reference moves.  Outside the band the integral runs fast while the slide sticks and
slow while it moves, so that it breaks away soon but gently.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import tanh
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from controllers.axis import axis_of
from controllers.motion import PREVIEW, MotionLimits, Sliding, going_with, motion, sliding_on
from controllers.scheduled import Schedule, scheduled
from controllers.spec import ranged
from controllers.through_valve import ThroughValve, through_valve
from linearize.modes import HybridModel
from linearize.reduction import closed_command
from linearize.standard import POSITION, PRESSURES, VELOCITY
from workbench.called import Curve
from workbench.effect import Conditions
from workbench.effects.stribeck_friction import StribeckFriction
from workbench.parts import Chamber

FAST_M_S = 1e3  # no Stribeck peak there
STATES = (POSITION, VELOCITY, *PRESSURES)


@dataclass(frozen=True, kw_only=True)
class PositioningSpec:
    """Numbers of the positioning task that all controllers share.

    Attributes
    ----------
    approach_m
        Errors above this count as this, which limits the speed of approach.
    fastest_m_s, hardest_m_s2, sharpest_m_s3
        A reference that moves faster has jumped, and asks for no speed; one that accelerates harder
        has a corner, and asks for no acceleration; likewise its jerk.
    band_m, leave_m, resting_m_s
        Rest begins inside ``band_m`` below ``resting_m_s`` and ends outside ``leave_m``.
    integrate_m
        Error below which the integral runs while the slide moves.
    stuck_factor
        How many times faster the integral runs while the slide sticks.
    stribeck_share
        Share of the Stribeck rise that is compensated.
    turn_per_s, standing_per_s, turn_m_s
        The direction is that of v_r - turn_per_s * error, mixed within ``turn_m_s``; while the
        reference stands with ``standing_per_s``.  Friction changes sides over turn_m_s / turn_per_s
        of error, which is a stiff spring: too stiff a one swings about a target at rest.
    smooth_v
        Opening over which the jump across the dead zone builds up.
    """

    approach_m: float = 0.03
    fastest_m_s: float = 2.0
    hardest_m_s2: float = 30.0
    sharpest_m_s3: float = 1e3
    band_m: float = ranged(5e-5)
    leave_m: float = ranged(1e-4)
    resting_m_s: float = ranged(5e-3)
    integrate_m: float = ranged(2e-3)
    stuck_factor: float = ranged(8.0)
    stribeck_share: float = ranged(0.8, most=1.0)
    turn_per_s: float = 50.0
    standing_per_s: float = 50.0
    turn_m_s: float = 0.02
    smooth_v: float = 0.01

    @cached_property
    def limits(self) -> MotionLimits:
        """Beyond which the reference has jumped."""
        return MotionLimits(
            speed=self.fastest_m_s, acceleration=self.hardest_m_s2, jerk=self.sharpest_m_s3
        )


@dataclass(frozen=True)
class Memory:
    """What a position controller remembers: integral of the error in m s, rest, and its plan."""

    integral_m_s: float = 0.0
    resting: bool = False
    plan: Any = None


class Task(NamedTuple):
    """One sample of the positioning task.

    x             position, velocity and pressures, shape (4,)
    target        where they should be, shape (4,); the position within the approach of x
    opening_v     of the wanted motion
    error_m       true error, not limited
    ahead         1 forward, 0 backward
    rests         the valve stays shut
    rate_m        what the integral grows by per second
    rise_n        friction above Coulomb's that the target pressures overcome
    """

    x: np.ndarray
    target: np.ndarray
    opening_v: float
    error_m: float
    speed_m_s: float
    ahead: float
    rests: bool
    rate_m: float
    rise_n: float

    @property
    def deviation(self) -> np.ndarray:
        """State minus target, shape (4,)."""
        return self.x - self.target


@dataclass(frozen=True, kw_only=True)
class Positioning:
    """The task on one plant."""

    spec: PositioningSpec
    valve: ThroughValve
    sliding: Schedule[Sliding]
    friction: StribeckFriction | None
    area_m2: float

    def task(
        self, memory: Memory, reference: np.ndarray, x: np.ndarray, sample_time_s: float
    ) -> Task:
        """The task now, from the coming reference, shape (1, PREVIEW) or longer."""
        spec, (place_m, v_m_s, *_) = self.spec, x.tolist()
        error_m = place_m - float(reference[0, 0])
        wanted = motion(reference[0, :PREVIEW], sample_time_s, spec.limits)
        speed_m_s = float(wanted[0])
        turn_per_s = spec.turn_per_s if speed_m_s else spec.standing_per_s
        wish = (speed_m_s - turn_per_s * error_m) / spec.turn_m_s
        ahead = 0.5 + 0.5 * tanh(wish)
        p_a, p_b, opening_v = going_with(self.sliding, place_m, ahead, wanted).tolist()
        rise_n = self._stribeck_n(v_m_s) * (2.0 * ahead - 1.0)
        rise_pa = rise_n / (2.0 * self.area_m2)
        near = place_m - min(max(error_m, -spec.approach_m), spec.approach_m)
        target = np.array([near, speed_m_s, p_a + rise_pa, p_b - rise_pa])
        rests = self._rests(memory, error_m, v_m_s, speed_m_s)
        rate_m = self._rate_m(error_m, v_m_s)
        return Task(x, target, opening_v, error_m, speed_m_s, ahead, rests, rate_m, rise_n)

    def _rests(self, memory: Memory, error_m: float, v_m_s: float, speed_m_s: float) -> bool:
        spec = self.spec
        if speed_m_s != 0.0:
            return False
        if memory.resting:
            return abs(error_m) < spec.leave_m
        return abs(error_m) < spec.band_m and abs(v_m_s) < spec.resting_m_s

    def _rate_m(self, error_m: float, v_m_s: float) -> float:
        spec = self.spec
        if abs(v_m_s) < spec.resting_m_s / 2.0:
            return spec.stuck_factor * min(max(error_m, -spec.integrate_m), spec.integrate_m)
        return error_m if abs(error_m) < spec.integrate_m else 0.0

    def _stribeck_n(self, v_m_s: float) -> float:
        """The compensated share of g(v) - F_C."""
        return self.spec.stribeck_share * self.rise_n(v_m_s) if self.friction else 0.0

    @cached_property
    def rise_n(self) -> Curve:
        """Velocity -> dry friction above that of fast sliding, at the start of the stroke."""
        v, friction, now = ca.SX.sym("v"), self.friction, Conditions()
        for name in (*friction.chambers, "atmosphere"):
            now.place(f"{name}.pressure_pa", 0.0)
        now.place(f"{friction.body}.position_m", 0.0)
        forces = []
        for velocity in (v, FAST_M_S):
            now.place(f"{friction.body}.velocity_m_s", velocity)
            forces.append(friction.dry_force_n(now))
        return Curve(ca.Function("rise", [v], [forces[0] - forces[1]]))


def positioning(hybrid: HybridModel, spec: PositioningSpec) -> Positioning:
    """The positioning task on the modes of a plant with one valve and two chambers."""
    plant, axis = hybrid.model.plant, axis_of(hybrid.plant)
    real = hybrid.plant.lean()
    friction = [e for e in plant.effects if isinstance(e, StribeckFriction)]
    centre_v = closed_command(plant)
    return Positioning(
        spec=spec,
        valve=through_valve(real, spec.smooth_v),
        sliding=scheduled(hybrid, lambda mode: sliding_on(mode, axis, centre_v)),
        friction=friction[0] if friction else None,
        area_m2=next(m.area_m2 for m in plant.parts if isinstance(m, Chamber)),
    )
