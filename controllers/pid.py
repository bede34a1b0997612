"""PID control of the position, with the gains from the poles of each mode."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from controllers.margins import Law, closed
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
from linearize.standard import POSITION, VELOCITY
from workbench.contracts import Command, Estimate

HALVINGS = 12  # of a gain's interval: to a four thousandth
DOUBLE = 1e-6  # what rounding makes of the double pole at 1 that a loop without K_p has

CALM = PositioningSpec(
    approach_m=0.3,
    band_m=1e-4,
    leave_m=1.9e-4,
    integrate_m=2e-4,
    stuck_factor=2.0,
    stribeck_share=0.0,
)
"""Without feedback of the pressures a slide that breaks away is caught late: integrate gently."""


@dataclass(frozen=True, kw_only=True)
class PidSpec:
    """How a PID is tuned on a mode, and its clock.

    Attributes
    ----------
    stiffening
        Square of the closed loop's fast frequency over that of the pneumatic spring, above 1.
    share_of_limit
        Proportional gain over the one at which the loop begins to swing, and the most that the
        derivative one may have of its own such limit.
    integral_time_s
        K_p / K_i.
    filter_s
        Time constant of the filter on the velocity; none by default, since an estimate is smooth
        already, and each millisecond of lag takes from a lightly damped spring.
    """

    ELSEWHERE: ClassVar[Mapping[str, str]] = {
        "bandwidth_hz": "`axis-pid` is tuned to a bandwidth: [axis-pid.tuning] bandwidth_hz"
    }

    sample_time_s: float = 1e-3
    stiffening: float = ranged(8.0, least=1.0, above=True)
    share_of_limit: float = ranged(0.45, most=1.0, above=True)
    integral_time_s: float = 0.5
    filter_s: float = ranged(0.0)
    positioning: PositioningSpec = field(default_factory=lambda: CALM)


@dataclass(frozen=True)
class PidGain:
    """Gains in V/m, V/(m s) and V s/m, and the poles of the mode under K_p and K_d, 1/s."""

    proportional: float
    integral: float
    derivative: float
    poles: np.ndarray

    def law(self, sample_time_s: float, filter_s: float) -> Law:
        """Its memory is the integral of the error and the filtered velocity."""
        share = sample_time_s / (sample_time_s + filter_s)
        moved = np.zeros((2, len(STATES)))
        moved[0, STATES.index(POSITION)], moved[1, STATES.index(VELOCITY)] = sample_time_s, share
        kept, gains = np.diag([1.0, 1.0 - share]), np.array([self.integral, self.derivative])
        direct = -gains @ moved
        direct[STATES.index(POSITION)] -= self.proportional
        return Law(kept, moved, -gains @ kept, direct)


@dataclass(frozen=True)
class Pid:
    """Opening = that of the wanted motion - K_p e - K_i integral - K_d (v - v_r), two degrees.

    The derivative acts on the estimated velocity, filtered; a step of the reference does not kick.
    The plan of the memory is the filtered velocity.
    """

    task: Positioning
    gains: Schedule[PidGain]
    sample_time_s: float
    filter_s: float
    preview: int = PREVIEW

    @property
    def laws(self) -> Schedule[Law]:
        """What it does while the slide moves and no limit is met."""
        return self.gains.mapped(lambda gain: gain.law(self.sample_time_s, self.filter_s))

    def start(self) -> Command:
        return Command(self.task.valve.shut, Memory(plan=0.0))

    @waiting
    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        memory, valve, dt = last.memory, self.task.valve, self.sample_time_s
        now = self.task.task(memory, reference, estimate.pick(STATES), dt)
        slow = memory.plan + dt / (dt + self.filter_s) * (now.x[1] - memory.plan)
        if now.rests:
            shut = valve.sent(0.0, estimate)
            return Command(shut, Memory(memory.integral_m_s, True, slow), {"resting": 1.0})
        here = self.gains.weighted(now.x[0], now.ahead)
        kp, ki, kd = (
            sum(w * getattr(gain, key) for w, gain in here)
            for key in ("proportional", "integral", "derivative")
        )
        integral = memory.integral_m_s + dt * now.rate_m
        error_m = now.x[0] - now.target[0]
        wanted = now.opening_v - kp * error_m - ki * integral - kd * (slow - now.speed_m_s)
        opening = float(np.clip(wanted, *valve.openings_v))
        if opening != wanted:
            integral = memory.integral_m_s
        notes = {"resting": 0.0, "opening_v": opening, "integral_m_s": integral}
        return Command(valve.sent(opening, estimate), Memory(integral, False, slow), notes)


def pid(hybrid: HybridModel, spec: PidSpec | None = None) -> Pid:
    """PID gains on every mode in which the valve drives the motion."""
    spec = spec or PidSpec()
    gains = scheduled(hybrid, lambda mode: pid_gain(mode, spec))
    task = positioning(hybrid, spec.positioning)
    return Pid(task, gains, spec.sample_time_s, spec.filter_s)


def pid_gain(mode: Mode, spec: PidSpec) -> PidGain:
    """Gains from the mode taken as b / (s (s^2 + 2 z w s + w^2)) from opening to position.

    With K_d the spring frequency rises to w sqrt(stiffening), as far as ``share_of_limit`` of the
    largest K_d goes; K_p is that share of its own largest.  The limits are those of the loop as it
    is run: Routh's, without sampling and filter, are several times as large, and swing.
    """
    pair = max(np.linalg.eigvals(mode.A), key=lambda pole: pole.imag)
    spring, damping = abs(pair) ** 2, -2.0 * pair.real
    b = float((mode.A @ mode.B)[mode.state_names.index(VELOCITY), 0])  # jerk per volt
    wanted, share = (spec.stiffening - 1.0) * spring / b, spec.share_of_limit
    kd = min(wanted, share * _limit(lambda k: _growth(mode, 0.0, k, spec) < DOUBLE, wanted / share))
    routh = damping * spring * spec.stiffening / b
    kp = share * _limit(lambda k: _growth(mode, k, kd, spec) < 0.0, routh)
    feedback = np.zeros(len(mode.A))
    feedback[[mode.state_names.index(POSITION), mode.state_names.index(VELOCITY)]] = kp, kd
    poles = np.linalg.eigvals(mode.A - mode.B @ feedback[None, :])
    return PidGain(kp, kp / spec.integral_time_s, kd, poles)


def _growth(mode: Mode, kp: float, kd: float, spec: PidSpec) -> float:
    """What the loop as it is run grows by in a sample; negative where it is stable."""
    gain = PidGain(kp, kp / spec.integral_time_s, kd, np.zeros(0))
    law = gain.law(spec.sample_time_s, spec.filter_s)
    return float(np.abs(np.linalg.eigvals(closed(mode, law, spec.sample_time_s))).max()) - 1.0


def _limit(stable: Callable[[float], bool], most: float) -> float:
    """The largest gain up to ``most`` that is stable, where all smaller ones are."""
    least = 0.0 if not stable(most) else most
    for _ in range(HALVINGS if least < most else 0):
        middle = (least + most) / 2.0
        least, most = (middle, most) if stable(middle) else (least, middle)
    return least
