"""A PID of any axis, tuned per mode, its numbers in ranges of the axis; see the laws it stands on.

:mod:`controllers.two_degree_pid` is the law, :mod:`controllers.pid_tuning` gives its gains.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from controllers.derivative import Derivative, LowPassDerivative, SpanDerivative
from controllers.pid_tuning import PidParts, TuningSpec, pid_with, tuned_pid
from controllers.ranges import InRanges, ranges_of
from controllers.scheduled import scheduled
from controllers.spec import ranged
from controllers.two_degree_pid import Dither, PidGains, TwoDegreePid
from linearize.modes import HybridModel
from workbench.errors import InputError, Message


@dataclass(frozen=True, kw_only=True)
class Usual:
    """Numbers where none are asked for; a ``tracking_time_s`` of 0 is that of the gains."""

    bandwidth_hz: float = 0.7
    integral_periods: float = 40.0
    standing_per_s: float = 20.0
    tracking_time_s: float = 0.0


USUAL = {
    "crr_rig": Usual(bandwidth_hz=5.0),
    "crr_arm": Usual(integral_periods=10.0, tracking_time_s=0.05),
    "servo_drive": Usual(bandwidth_hz=1.0, integral_periods=26.0, standing_per_s=60.0),
}
"""By plant.

The weakest mode of an arm allows no more than 0.7 Hz.  The light rod of the rig has a stiff and
well damped spring, allows 6 Hz, and at 5 Hz holds the sines of its bench against dry friction.
Steps end on the raw measurement and behind an EKF 0.4 and 0.8 mm away on the rig, 0.5 and 1.0 deg
on the arm, 0.13 and 0.10 mm on the drive.  Stiction leaves them little room: eight drives, seven of
them drawn, end 0.7 mm away in the median and 9 mm at worst, six arms 0.8 and 4 deg.
"""


@dataclass(frozen=True, kw_only=True)
class OwnTuning(TuningSpec):
    """As the tuning of a mode; a bandwidth or periods of 0 are the usual ones of the plant.

    The integral is slow: what it gathers while an axis sticks throws the axis beyond its target.
    """

    bandwidth_hz: float = ranged(0.0)
    integral_periods: float = ranged(0.0)

    def on(self, usual: Usual) -> TuningSpec:
        """With what is usual where nothing is asked for."""
        hz = self.bandwidth_hz or usual.bandwidth_hz
        periods = self.integral_periods or usual.integral_periods
        return replace(self, bandwidth_hz=hz, integral_periods=periods)


@dataclass(frozen=True, kw_only=True)
class OwnGains:
    """Gains of one's own for all modes, in V per unit of the position, per second and V s per unit.

    Without ``proportional`` the modes are tuned.  Those under which papers 000 and 001 are
    reproduced are 250, 200, 8 on the rig, and 4, 4, 0.4 on the arm.
    """

    proportional: float = ranged(0.0)
    integral: float = ranged(0.0)
    derivative: float = ranged(0.0)

    @property
    def given(self) -> bool:
        """True where they take the place of the tuning.

        Raises
        ------
        InputError
            If there are others without the proportional one.
        """
        if not self.proportional and (self.integral or self.derivative):
            what = "needs the proportional gain too"
            raise InputError(Message(what, "axis-pid.gains", "proportional above 0, or no gains"))
        return self.proportional > 0.0


@dataclass(frozen=True, kw_only=True)
class AxisPidSpec:
    """What the loop is to do on every mode, and the parts of the PID besides its gains.

    Attributes
    ----------
    tuning
        Bandwidth, margins and overshoot.
    gains
        Gains of one's own in place of the tuning.
    setpoint, setpoint_rate
        Shares of the reference in P and in D.  What the first takes from a step comes in by the
        integral, whose usual time of 4 s on a drive is long: give it fewer ``integral_periods``.
    feedforward_share
        Of the opening of the wanted motion; friction is compensated by it too.
    filter_s, span
        Lag of the derivative; or, from 1 on, the periods over which it is taken, as in paper 001.
    dither
        A sine on the opening; none by default.
    tracking_time_s
        Of back-calculation, where the valve is at its limit; 0 is the integral time of the gains,
        or that of the plant in ``USUAL``.
    standing_per_s
        In place of ``turn_per_s`` of the motion while the reference stands; 0 is the usual one.
    """

    sample_time_s: float = 1e-3
    tuning: OwnTuning = field(default_factory=OwnTuning)
    gains: OwnGains = field(default_factory=OwnGains)
    setpoint: float = ranged(1.0)
    setpoint_rate: float = ranged(1.0)
    feedforward_share: float = ranged(1.0)
    filter_s: float = 3e-3
    span: int = ranged(0, most=100)
    dither: Dither = field(default_factory=Dither)
    tracking_time_s: float = ranged(0.0)
    smooth_v: float = 0.01
    standing_per_s: float = ranged(0.0)
    motion: InRanges = field(default_factory=lambda: InRanges(turn_per_s=5.0))

    def parts(self, wide: float, usual: Usual) -> PidParts:
        """Those of an axis whose range is so wide; gains of one's own have their own time."""
        lag, span = LowPassDerivative(self.filter_s), SpanDerivative(max(self.span, 1))
        derivative: Derivative = span if self.span else lag
        tuned_s = 0.0 if self.gains.given else usual.tracking_time_s
        return PidParts(
            derivative=derivative,
            setpoint=self.setpoint,
            setpoint_rate=self.setpoint_rate,
            feedforward_share=self.feedforward_share,
            turn_speed=self.motion.turn * wide,
            turn_per_s=self.motion.turn_per_s,
            standing_per_s=self.standing_per_s or usual.standing_per_s,
            limits=self.motion.limits(wide),
            dither=self.dither,
            tracking_time_s=self.tracking_time_s or tuned_s,
            smooth_v=self.smooth_v,
            sample_time_s=self.sample_time_s,
        )


def axis_pid(hybrid: HybridModel, spec: AxisPidSpec | None = None) -> TwoDegreePid:
    """The PID of the plant's only axis, tuned or with gains of one's own.

    Raises
    ------
    InputError
        If a mode does not allow the bandwidth, with the nearest that all of them allow; or if of
        the gains the proportional one is missing, or the integral one that a setpoint needs.
    """
    spec = spec or AxisPidSpec()
    ((_, wide),) = ranges_of(hybrid.plant)
    usual = USUAL.get(hybrid.plant.name, Usual())
    parts = spec.parts(wide, usual)
    if spec.gains.given:
        own = _own(spec)
        return pid_with(hybrid, scheduled(hybrid, lambda mode: own), parts)
    return tuned_pid(hybrid, spec.tuning.on(usual), parts)


def _own(spec: AxisPidSpec) -> PidGains:
    """The given gains with the shares of the reference.

    Raises
    ------
    InputError
        If a share of P needs an integral, and there is none.
    """
    if spec.setpoint != 1.0 and not spec.gains.integral:
        what, where = "takes from every step what no integral gives back", "axis-pid.setpoint"
        raise InputError(Message(what, where, "1, or an integral gain above 0"))
    return PidGains(
        proportional=spec.gains.proportional,
        integral=spec.gains.integral,
        derivative=spec.gains.derivative,
        setpoint=spec.setpoint,
        setpoint_rate=spec.setpoint_rate,
    )
