"""A PID of any axis, tuned per mode, its numbers in ranges of the axis; see the laws it stands on.

:mod:`controllers.two_degree_pid` is the law, :mod:`controllers.pid_tuning` gives its gains.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from controllers.derivative import Derivative, LowPassDerivative, SpanDerivative
from controllers.pid_tuning import PidParts, TuningSpec, tuned_pid
from controllers.ranges import InRanges, ranges_of
from controllers.spec import ranged
from controllers.two_degree_pid import Dither, TwoDegreePid
from linearize.modes import HybridModel


@dataclass(frozen=True, kw_only=True)
class AxisPidSpec:
    """What the loop is to do on every mode, and the parts of the PID besides its gains.

    Attributes
    ----------
    tuning
        Bandwidth, margins and overshoot; by default a bandwidth that the weakest spring allows.
    setpoint, setpoint_rate
        Shares of the reference in P and in D.
    feedforward_share
        Of the opening of the wanted motion; friction is compensated by it too.
    filter_s, span
        Lag of the derivative; or, from 1 on, the periods over which it is taken, as in paper 001.
    dither
        A sine on the opening; none by default.
    tracking_time_s
        Of back-calculation, where the valve is at its limit.
    """

    sample_time_s: float = 1e-3
    tuning: TuningSpec = field(default_factory=lambda: TuningSpec(bandwidth_hz=0.7))
    setpoint: float = ranged(1.0)
    setpoint_rate: float = ranged(1.0)
    feedforward_share: float = ranged(1.0)
    filter_s: float = 3e-3
    span: int = ranged(0, most=100)
    dither: Dither = field(default_factory=Dither)
    tracking_time_s: float = 0.05
    smooth_v: float = 0.01
    motion: InRanges = field(default_factory=lambda: InRanges(turn_per_s=5.0))

    def parts(self, wide: float) -> PidParts:
        """Those of an axis whose range is so wide."""
        lag, span = LowPassDerivative(self.filter_s), SpanDerivative(max(self.span, 1))
        derivative: Derivative = span if self.span else lag
        return PidParts(
            derivative=derivative,
            setpoint=self.setpoint,
            setpoint_rate=self.setpoint_rate,
            feedforward_share=self.feedforward_share,
            turn_speed=self.motion.turn * wide,
            turn_per_s=self.motion.turn_per_s,
            limits=self.motion.limits(wide),
            dither=self.dither,
            tracking_time_s=self.tracking_time_s,
            smooth_v=self.smooth_v,
            sample_time_s=self.sample_time_s,
        )


def axis_pid(hybrid: HybridModel, spec: AxisPidSpec | None = None) -> TwoDegreePid:
    """The PID of the plant's only axis.

    Raises
    ------
    InputError
        If a mode does not allow the bandwidth, with the nearest that all of them allow.
    """
    spec = spec or AxisPidSpec()
    ((_, wide),) = ranges_of(hybrid.plant)
    return tuned_pid(hybrid, spec.tuning, spec.parts(wide))
