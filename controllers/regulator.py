"""Scheduled LQ control of one axis, whatever its units: one gain per mode, mixed between them.

    opening = opening of the wanted motion - K (x - target) - K_i integral

Target and opening follow from the affine modes, so gravity, dry friction and the pressures that an
acceleration needs stand in them.  With an estimator that is a Kalman filter this is LQG.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from controllers.axis import Axis, axis_of
from controllers.lq import Gain, lq_gain
from controllers.margins import Law
from controllers.motion import PREVIEW, MotionLimits, Sliding, going_with, motion, sliding_on
from controllers.ranges import InRanges, ranges_of
from controllers.scheduled import Schedule, scheduled
from controllers.spec import ranged
from controllers.through_valve import ThroughValve, through_valve
from controllers.unseen import waiting
from linearize.modes import HybridModel
from linearize.reduction import closed_command
from workbench.contracts import Command, Estimate


@dataclass(frozen=True, kw_only=True)
class RegulatorSpec:
    """Weights and clock of a scheduled LQ design.

    Attributes
    ----------
    tolerable
        Deviation by signal name, each worth a cost of one (Bryson's rule).
    integral_time_s
        Time over which a constant tolerable error of the position costs one.
    turn_speed, turn_per_s
        The direction is that of speed + turn_per_s * error, mixed within ``turn_speed``.
    smooth_v
        Opening over which the jump across a dead zone builds up.
    """

    tolerable: Mapping[str, float]
    integral_time_s: float = 0.3
    sample_time_s: float = 1e-3
    turn_speed: float = 0.02
    turn_per_s: float = 20.0
    smooth_v: float = 0.01
    limits: MotionLimits = field(default_factory=MotionLimits)


@dataclass(frozen=True, kw_only=True)
class Regulator:
    """See the module.  Its memory is the integral, which rests while the valve is at a limit."""

    axis: Axis
    spec: RegulatorSpec
    gains: Schedule[Gain]
    sliding: Schedule[Sliding]
    valve: ThroughValve
    preview: int = PREVIEW

    @property
    def sample_time_s(self) -> float:
        return self.spec.sample_time_s

    @property
    def laws(self) -> Schedule[Law]:
        """What it does while no limit is met."""
        return self.gains.mapped(lambda gain: gain.law(self.sample_time_s))

    def start(self) -> Command:
        return Command(self.valve.shut, 0.0)

    @waiting
    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        spec, x = self.spec, estimate.pick(self.axis.states)
        wanted = motion(reference[0, :PREVIEW], spec.sample_time_s, spec.limits)
        error = float(x[0] - reference[0, 0])
        ahead = 0.5 + 0.5 * np.tanh((wanted[0] - spec.turn_per_s * error) / spec.turn_speed)
        p_a, p_b, moving_v = going_with(self.sliding, x[0], ahead, wanted).tolist()
        target = np.array([reference[0, 0], wanted[0], p_a, p_b])
        integral = last.memory + spec.sample_time_s * error
        here = self.gains.weighted(x[0], ahead)
        opening_v = moving_v - sum(
            w * (gain.feedback @ (x - target) + gain.integral * integral) for w, gain in here
        )
        limited_v = float(np.clip(opening_v, *self.valve.openings_v))
        kept = integral if limited_v == opening_v else last.memory
        notes = {"opening_v": limited_v, "integral": kept}
        return Command(self.valve.sent(limited_v, estimate), kept, notes)


@dataclass(frozen=True, kw_only=True)
class AxisLqSpec:
    """Weights and clock of a scheduled LQ design, in ranges of the axis: for any unit.

    Attributes
    ----------
    position, velocity
        Tolerable deviations in ranges of the axis, and in ranges per second.
    pressure_pa, opening_v
        Tolerable deviations of each pressure and of the opening.
    integral_time_s, smooth_v
        As of a :class:`RegulatorSpec`.
    motion
        When a reference has jumped, and within which speed the directions are mixed.
    """

    sample_time_s: float = 1e-3
    position: float = ranged(0.008, least=1e-5)  # as a micrometre of 100 mm
    velocity: float = 1.0
    pressure_pa: float = 1e6
    opening_v: float = 1.0
    integral_time_s: float = 0.3
    smooth_v: float = 0.01
    motion: InRanges = field(default_factory=InRanges)

    def weighed(self, axis: Axis, wide: float) -> RegulatorSpec:
        """The specification of an axis whose range is so wide."""
        return RegulatorSpec(
            tolerable={
                axis.position: self.position * wide,
                axis.velocity: self.velocity * wide,
                **dict.fromkeys(axis.pressures, self.pressure_pa),
                axis.command: self.opening_v,
            },
            integral_time_s=self.integral_time_s,
            sample_time_s=self.sample_time_s,
            turn_speed=self.motion.turn * wide,
            turn_per_s=self.motion.turn_per_s,
            smooth_v=self.smooth_v,
            limits=self.motion.limits(wide),
        )


def axis_regulator(hybrid: HybridModel, spec: AxisLqSpec | None = None) -> Regulator:
    """A regulator of the plant's only axis, from weights in its ranges.

    Raises
    ------
    NoGainError
        If the regulator of these weights cannot be computed.
    """
    ((axis, wide),) = ranges_of(hybrid.plant)
    return regulator_on(hybrid, axis, (spec or AxisLqSpec()).weighed(axis, wide))


def regulator(hybrid: HybridModel, spec: RegulatorSpec) -> Regulator:
    """As :func:`regulator_on`, of the plant's only axis."""
    return regulator_on(hybrid, axis_of(hybrid.plant), spec)


def regulator_on(hybrid: HybridModel, axis: Axis, spec: RegulatorSpec) -> Regulator:
    """LQ designs on every mode in which the axis' valve drives its motion.

    Raises
    ------
    InputError
        If a weight is for a signal that the modes do not have, or one is missing.
    NoGainError
        If the regulator of these weights cannot be computed.
    """
    centre_v = closed_command(hybrid.plant, axis.command)
    weighed = (spec.tolerable, spec.integral_time_s, spec.sample_time_s)
    return Regulator(
        axis=axis,
        spec=spec,
        gains=scheduled(hybrid, lambda mode: lq_gain(mode, *weighed), axis),
        sliding=scheduled(hybrid, lambda mode: sliding_on(mode, axis, centre_v), axis),
        valve=through_valve(hybrid.plant.lean(), spec.smooth_v, axis.command),
    )
