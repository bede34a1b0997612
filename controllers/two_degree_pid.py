"""PID with two degrees of freedom on the raw measurement of one axis, for any plant with a valve.

    P = K_p (b r - y),   D = K_d (c dr/dt - slope of y),   I' = K_i (r - y) + (sent - wanted) / T_t
    opening = limited(P + I + D + share * opening of the wanted motion) + dither

The integral is kept in volts and begins with K_p (1 - b) r, so that an axis at rest on its target
stays there; what b takes from a later step comes in by the integral, within K_p / K_i.  Where the
gains change with the mode, it takes over what P and D lose or gain by that, so that the opening
does not jump (bumpless transfer).  They do so under the reference of the last sample: a step that
turns the direction would else leave its size times the difference of both K_p behind.

Where the valve is at its limit, the integral follows what was sent (back-calculation), within
T_i = K_p / K_i by default: in a shorter time a large step drives it against the error, and it needs
T_i to come back.

The opening of the wanted motion comes from the modes and builds the pressures that belong to it:
those against dry friction and gravity in that direction (friction compensation), and those of speed
and acceleration, see :mod:`controllers.charging`.  The dead zone is undone in the command.

Source: K. J. Astrom and T. Hagglund, "Advanced PID Control", ISA 2006.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sin, tau

import numpy as np

from controllers.charging import Charging, charging_mixed
from controllers.derivative import Derivative, Filter, LowPassDerivative, settled
from controllers.margins import Law
from controllers.motion import PREVIEW, MotionLimits, Sliding, motion
from controllers.on_measurement import OnMeasurement
from controllers.scheduled import Schedule
from controllers.spec import ranged
from controllers.through_valve import ThroughValve
from controllers.unseen import waiting
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

    def direct_v(self, asked: tuple[float, float], place: float, slope: float) -> float:
        """P + D of a reference with its slope, and of the measured place with its own."""
        along, rate = self.setpoint * asked[0] - place, self.setpoint_rate * asked[1] - slope
        return self.proportional * along + self.derivative * rate

    def held_v(self, place: float) -> float:
        """The integral with which an axis at rest on its target stays there."""
        return self.proportional * (1.0 - self.setpoint) * place


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
    turn_per_s, standing_per_s
        An error counts as so much speed in its direction, the latter while the reference stands: at
        rest friction is compensated towards the target.  More of it is a stiffer spring, which on
        the move turns with the noise of a measurement.
    limits
        Beyond which the reference has jumped.
    """

    sliding: Schedule[Sliding]
    charging: Schedule[Charging]
    share: float = 0.0
    turn_speed: float = 0.02
    turn_per_s: float = 5.0
    standing_per_s: float = 5.0
    limits: MotionLimits = MotionLimits()


@dataclass(frozen=True)
class PidMemory:
    """What a sample leaves for the next.

    The integral is in V, ``slopes`` is of the derivative, gains and what was asked (see
    :meth:`PidGains.direct_v`) are those of last time, and pressures those of the wanted motion,
    None before the first sample that asks for any.
    """

    integral_v: float
    slopes: np.ndarray
    gains: PidGains
    samples: int
    pressures: np.ndarray | None = None
    asked: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class TwoDegreePid(OnMeasurement):
    """See the module; ``signal`` names the measured position.

    A ``tracking_time_s`` of 0 is the integral time of the gains.
    """

    gains: Schedule[PidGains]
    valve: ThroughValve
    feedforward: Feedforward
    derivative: Derivative = LowPassDerivative(3e-3)
    dither: Dither = Dither()
    tracking_time_s: float = 0.0
    sample_time_s: float = 1e-3
    preview: int = PREVIEW

    @property
    def laws(self) -> Schedule[Law]:
        """What it does while no limit is met and the gains do not change."""
        return self.gains.mapped(lambda gains: law_of(gains, self._filter, self.sample_time_s))

    def start(self) -> Command:
        return Command(self.valve.shut)

    @waiting
    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        dt, (y,) = self.sample_time_s, estimate.pick([self.signal])
        A, B, C, D = self._filter
        moving = motion(reference[0, :PREVIEW], dt, self.feedforward.limits)
        ahead = self._ahead(moving[0], float(reference[0, 0] - y))
        now = mixed(self.gains, float(y), ahead)
        begun_v = now.held_v(float(reference[0, 0]))
        memory = last.memory or PidMemory(begun_v, settled(self._filter, y), now, 0)
        slope = float(C @ memory.slopes + D * y)

        seen, asked = (float(y), slope), (float(reference[0, 0]), float(moving[0]))
        direct = now.direct_v(asked, *seen)
        integral = memory.integral_v
        if now.integral:
            before = memory.asked or asked
            integral += memory.gains.direct_v(before, *seen) - now.direct_v(before, *seen)
        integral += dt * now.integral * float(reference[0, 0] - y)
        sent_ahead, pressures = self._ahead_v(float(reference[0, 0]), ahead, moving, memory)
        wanted = direct + integral + sent_ahead
        opening = float(np.clip(wanted, *self.valve.openings_v))
        integral += self._share_followed(now) * (opening - wanted)
        sent = self.valve.sent(opening + self.dither.at(memory.samples * dt), estimate)
        slopes, samples = A @ memory.slopes + B * y, memory.samples + 1
        kept = PidMemory(integral, slopes, now, samples, pressures, asked)
        return Command(sent, kept, {"opening_v": opening, "integral_v": integral})

    def _share_followed(self, gains: PidGains) -> float:
        """Of what was cut off, in one sample; none where no integral gain could undo it."""
        if not gains.integral:
            return 0.0
        dt = self.sample_time_s
        within = self.tracking_time_s or gains.proportional / gains.integral
        return dt / max(within, dt)

    def _ahead(self, speed: float, error: float) -> float:
        given = self.feedforward
        per_s = given.turn_per_s if speed else given.standing_per_s
        wish = (speed + per_s * error) / given.turn_speed
        return 0.5 + 0.5 * float(np.tanh(wish))

    def _ahead_v(
        self, place: float, ahead: float, moving: np.ndarray, memory: PidMemory
    ) -> tuple[float, np.ndarray | None]:
        """The share of the wanted motion's opening, and its pressures a sample later.

        At the wanted place: at the measured one it would push away from it what gravity pulls to.
        """
        share, dt = self.feedforward.share, self.sample_time_s
        if not share:
            return 0.0, None
        pressures = memory.pressures
        if pressures is None:
            begun = self.feedforward.sliding.weighted(place, ahead)
            pressures = sum(w * each.level[:2] for w, each in begun)
        mode = charging_mixed(self.feedforward.charging.weighted(place, ahead))
        coming = moving[:2] + dt * moving[1:]
        wanted = mode.opening(pressures, moving[0], coming, dt)
        opening = float(np.clip(wanted, *self.valve.openings_v))
        return share * opening, mode.after(pressures, moving[0], opening, dt)

    @cached_property
    def _filter(self) -> Filter:
        return self.derivative.filter(self.sample_time_s)


def mixed(schedule: Schedule[PidGains], place: float, ahead: float) -> PidGains:
    """The gains at a place and for a direction, mixed from the modes'."""
    here = schedule.weighted(place, ahead)
    names = PidGains.__dataclass_fields__
    return PidGains(**{key: float(sum(w * getattr(g, key) for w, g in here)) for key in names})


def law_of(gains: PidGains, slopes: Filter, sample_time_s: float, states: int = 4) -> Law:
    """From so many states of an axis, position first, to the opening; its memory ends with I / K_i.

    Without an integral gain it has none: it would stand as a pole at one that nothing sees.
    """
    A, B, C, D = slopes
    place = np.eye(states)[0]
    kept, moved, seen = A, np.outer(B, place), gains.derivative * C
    if gains.integral:
        n = len(A)
        kept = np.block([[A, np.zeros((n, 1))], [np.zeros((1, n)), np.ones((1, 1))]])
        moved = np.vstack([moved, sample_time_s * place])
        seen = np.array([*seen, gains.integral])
    direct = gains.proportional + gains.derivative * D + gains.integral * sample_time_s
    return Law(kept, moved, -seen, -direct * place, bumpless=bool(gains.integral))
