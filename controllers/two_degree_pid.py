"""PID with two degrees of freedom on the raw measurement of one axis, for any plant with a valve.

    P = K_p (b r - y),   D = K_d (c dr/dt - slope of y),   I' = K_i (r - y) + (sent - wanted) / T_t
    opening = limited(P + I + D + share * opening of the wanted motion) + dither

The integral is kept in volts.  Where the gains change with the mode, it takes over what P and D
lose or gain by that, so that the opening does not jump (bumpless transfer).  Where the valve is at
its limit, it follows what was sent (back-calculation).

The opening of the wanted motion comes from the modes: its part at zero speed is what dry friction
and gravity need in that direction (friction compensation), the rest is feedforward of speed,
acceleration and jerk.  The dead zone is undone in the command.

Source: K. J. Astrom and T. Hagglund, "Advanced PID Control", ISA 2006.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sin, tau

import numpy as np

from controllers.derivative import Derivative, Filter, LowPassDerivative, settled
from controllers.margins import Law
from controllers.motion import PREVIEW, MotionLimits, Sliding, motion
from controllers.scheduled import Schedule
from controllers.spec import ranged
from controllers.through_valve import ThroughValve
from workbench.contracts import Command, Estimate


@dataclass(frozen=True, kw_only=True)
class PidGains:
    """Gains in V per unit of position, per unit and second, and in V s per unit.

    ``setpoint`` and ``setpoint_rate`` are b and c, the shares of the reference in P and D.
    """

    proportional: float
    integral: float
    derivative: float
    setpoint: float = 1.0
    setpoint_rate: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Dither:
    """A sine on the opening that keeps dry friction moving; none by default."""

    amplitude_v: float = ranged(0.0)
    frequency_hz: float = 50.0

    def at(self, time_s: float) -> float:
        return self.amplitude_v * sin(tau * self.frequency_hz * time_s)


@dataclass(frozen=True, kw_only=True)
class Feedforward:
    """What of the wanted motion's opening is sent ahead of the error; by default nothing.

    Attributes
    ----------
    share
        Of that opening.
    turn_speed
        Speed, in units of the position per second, within which the directions are mixed.
    turn_per_s
        An error counts as so much speed in its direction: at rest friction is compensated towards
        the target.
    limits
        Beyond which the reference has jumped.
    """

    sliding: Schedule[Sliding]
    share: float = 0.0
    turn_speed: float = 0.02
    turn_per_s: float = 5.0
    limits: MotionLimits = MotionLimits()


@dataclass(frozen=True)
class PidMemory:
    """Integral in volts, the derivative's memory, the gains of last time, and samples so far."""

    integral_v: float
    slopes: np.ndarray
    gains: PidGains
    samples: int


@dataclass(frozen=True, kw_only=True)
class TwoDegreePid:
    """See the module; ``signal`` names the measured position."""

    signal: str
    gains: Schedule[PidGains]
    valve: ThroughValve
    feedforward: Feedforward
    derivative: Derivative = LowPassDerivative(3e-3)
    dither: Dither = Dither()
    tracking_time_s: float = 0.05
    sample_time_s: float = 1e-3
    preview: int = PREVIEW

    @property
    def laws(self) -> Schedule[Law]:
        """What it does while no limit is met and the gains do not change."""
        return self.gains.mapped(lambda gains: law_of(gains, self._filter, self.sample_time_s))

    def start(self) -> Command:
        return Command(self.valve.shut)

    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        dt, (y,) = self.sample_time_s, estimate.pick([self.signal])
        A, B, C, D = self._filter
        moving = motion(reference[0, :PREVIEW], dt, self.feedforward.limits)
        ahead = self._ahead(moving[0], float(reference[0, 0] - y))
        now = mixed(self.gains, float(y), ahead)
        memory = last.memory or PidMemory(0.0, settled(self._filter, y), now, 0)
        slope = float(C @ memory.slopes + D * y)

        def proportional_and_rate(gains: PidGains) -> float:
            along = gains.setpoint * reference[0, 0] - y
            rate = gains.setpoint_rate * moving[0] - slope
            return gains.proportional * along + gains.derivative * rate

        direct = proportional_and_rate(now)
        taken_over = proportional_and_rate(memory.gains) - direct if now.integral else 0.0
        integral = memory.integral_v + taken_over
        integral += dt * now.integral * float(reference[0, 0] - y)
        wanted = direct + integral + self._ahead_v(float(y), ahead, moving)
        opening = float(np.clip(wanted, *self.valve.openings_v))
        integral += dt / self.tracking_time_s * (opening - wanted)
        sent = self.valve.sent(opening + self.dither.at(memory.samples * dt), estimate)
        kept = PidMemory(integral, A @ memory.slopes + B * y, now, memory.samples + 1)
        return Command(sent, kept, {"opening_v": opening, "integral_v": integral})

    def _ahead(self, speed: float, error: float) -> float:
        wish = (speed + self.feedforward.turn_per_s * error) / self.feedforward.turn_speed
        return 0.5 + 0.5 * float(np.tanh(wish))

    def _ahead_v(self, place: float, ahead: float, moving: np.ndarray) -> float:
        if not self.feedforward.share:
            return 0.0
        here = self.feedforward.sliding.weighted(place, ahead)
        return self.feedforward.share * float(sum(w * each.at(moving)[2] for w, each in here))

    @cached_property
    def _filter(self) -> Filter:
        return self.derivative.filter(self.sample_time_s)


def mixed(schedule: Schedule[PidGains], place: float, ahead: float) -> PidGains:
    """The gains at a place and for a direction, mixed from the modes'."""
    here = [*schedule.weighted(place, ahead)]
    names = PidGains.__dataclass_fields__
    return PidGains(**{key: float(sum(w * getattr(g, key) for w, g in here)) for key in names})


def law_of(gains: PidGains, slopes: Filter, sample_time_s: float) -> Law:
    """From the states of an axis, position first, to the opening; its memory ends with I / K_i."""
    A, B, C, D = slopes
    n, place = len(A), np.array([1.0, 0.0, 0.0, 0.0])
    kept = np.zeros((n + 1, n + 1))
    kept[:n, :n], kept[n, n] = A, 1.0
    moved = np.outer([*B, sample_time_s], place)
    direct = gains.proportional + gains.derivative * D + gains.integral * sample_time_s
    return Law(kept, moved, -np.array([*(gains.derivative * C), gains.integral]), -direct * place)
