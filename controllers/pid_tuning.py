"""Gains of a PID on one mode from a specification: bandwidth, phase margin, overshoot.

At the wanted crossover w the loop is to have |L| = 1 and the phase -180 deg + margin.  With K_i
tied to K_p by the integral time these are two linear equations for K_p and K_d,

    K_p (1 + I(w) / T_i) + K_d H(w) = exp(j (margin - pi)) / G(w)

where G is the sampled mode with its delays and lags, I the summation and H the
derivative filter as they are run.  Where they ask for a negative K_d the phase suffices without,
and K_d is zero.  Where the loop is unstable or bears too little gain, no PID of that bandwidth is
right, and the answer names the nearest that is right on all modes.  A lightly damped spring leaves
a gap: below it the crossover is slow and needs no derivative, above it is fast and lives by it.

Source: K. J. Astrom and T. Hagglund, "Advanced PID Control", ISA 2006 (one point of the Nyquist
curve); overshoot to phase margin by the second-order loop w^2 / (s (s + 2 z w)).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, log, pi, radians, sqrt, tau

import numpy as np

from controllers.axis import axis_of
from controllers.charging import charging_on
from controllers.derivative import Derivative, LowPassDerivative
from controllers.lags import behind_lags, measured_lags
from controllers.margins import Law, Margins, both_ways_s, closed, loop, margins_of
from controllers.motion import MotionLimits, sliding_on
from controllers.scheduled import Schedule, constant, driven_modes, scheduled
from controllers.spec import ranged
from controllers.through_valve import through_valve
from controllers.two_degree_pid import Dither, Feedforward, PidGains, TwoDegreePid, law_of
from linearize.modes import HybridModel, Mode
from linearize.reduction import closed_command
from workbench.errors import InputError, Message

LOWEST_HZ, HIGHEST_HZ, TRIED = 0.1, 50.0, 40  # where another bandwidth is looked for


@dataclass(frozen=True, kw_only=True)
class TuningSpec:
    """What a loop is to do on every mode.

    Attributes
    ----------
    bandwidth_hz
        Where the loop's gain crosses one.
    phase_margin_rad, overshoot
        At least this margin, and as much as keeps a second-order loop from overshooting more.
    gain_margin
        Factor that the gain must bear upwards.
    integral_periods
        T_i = integral_periods / w.
    """

    bandwidth_hz: float = 2.0
    phase_margin_rad: float = ranged(radians(50.0), most=pi / 2.0)
    overshoot: float = ranged(0.15, most=1.0)
    gain_margin: float = ranged(1.8, least=1.0)
    integral_periods: float = 8.0

    @property
    def margin_rad(self) -> float:
        """The larger of both demands on the phase."""
        return max(self.phase_margin_rad, margin_of_overshoot(self.overshoot))


@dataclass(frozen=True, kw_only=True)
class PidParts:
    """All of a PID besides its gains."""

    derivative: Derivative = LowPassDerivative(3e-3)
    setpoint: float = 1.0
    setpoint_rate: float = 0.0
    feedforward_share: float = 0.0
    turn_speed: float = 0.02
    turn_per_s: float = 5.0
    standing_per_s: float = 5.0
    limits: MotionLimits = MotionLimits()
    dither: Dither = Dither()
    tracking_time_s: float = 0.0
    smooth_v: float = 0.01
    sample_time_s: float = 1e-3


PAPER_GAINS = {
    "crr_rig": PidGains(proportional=250.0, integral=200.0, derivative=8.0, setpoint_rate=1.0),
    "crr_arm": PidGains(proportional=4.0, integral=4.0, derivative=0.4, setpoint_rate=1.0),
}
"""Those under which papers 000 and 001 are reproduced; *chosen*, none are printed (physics.md)."""


def margin_of_overshoot(overshoot: float) -> float:
    """Phase margin in rad of the second-order loop that overshoots by this share of a step."""
    if overshoot <= 0.0:
        return atan(2.0 / sqrt(sqrt(5.0) - 2.0))  # damping 1
    if overshoot >= 1.0:
        return 0.0
    z = -log(overshoot) / sqrt(pi**2 + log(overshoot) ** 2)
    return atan(2.0 * z / sqrt(sqrt(1.0 + 4.0 * z**4) - 2.0 * z**2))


def tuned_pid(
    hybrid: HybridModel, spec: TuningSpec | None = None, parts: PidParts | None = None
) -> TwoDegreePid:
    """A PID with the gains of each mode from one specification, at the plant's delays and lags.

    Raises
    ------
    InputError
        If a mode does not allow the bandwidth, with the nearest that all of them allow.
    """
    spec, parts = spec or TuningSpec(), parts or PidParts()
    delay_s = both_ways_s(hybrid.plant)
    lags = measured_lags(hybrid.plant, axis_of(hybrid.plant).position)
    lagging = behind_lags(hybrid, lags)
    modes = tuple(mode for side in driven_modes(lagging) for mode in side)
    gains = scheduled(lagging, lambda mode: tuned_gains(mode, spec, parts, delay_s, modes))
    return pid_with(hybrid, gains, parts)


def pid_with(
    hybrid: HybridModel, gains: Schedule[PidGains] | PidGains, parts: PidParts | None = None
) -> TwoDegreePid:
    """A PID with known gains: those of the papers, or those of each mode."""
    parts, axis = parts or PidParts(), axis_of(hybrid.plant)
    centre_v = closed_command(hybrid.plant)
    ahead = Feedforward(
        sliding=scheduled(hybrid, lambda mode: sliding_on(mode, axis, centre_v)),
        charging=scheduled(hybrid, lambda mode: charging_on(mode, axis, centre_v)),
        share=parts.feedforward_share,
        turn_speed=parts.turn_speed,
        turn_per_s=parts.turn_per_s,
        standing_per_s=parts.standing_per_s,
        limits=parts.limits,
    )
    return TwoDegreePid(
        signal=axis.position,
        gains=constant(gains) if isinstance(gains, PidGains) else gains,
        valve=through_valve(hybrid.plant.lean(), parts.smooth_v),
        feedforward=ahead,
        derivative=parts.derivative,
        dither=parts.dither,
        tracking_time_s=parts.tracking_time_s,
        sample_time_s=parts.sample_time_s,
    )


def tuned_gains(
    mode: Mode,
    spec: TuningSpec,
    parts: PidParts,
    delay_s: float,
    modes: tuple[Mode, ...] = (),
) -> PidGains:
    """The gains of one mode, which is among ``modes`` or alone.

    Raises
    ------
    InputError
        If it does not allow the bandwidth, with the nearest that all of them allow.
    """
    found = _at_bandwidth(mode, spec, parts, delay_s, spec.bandwidth_hz)
    if found is not None:
        return found
    together = (mode, *(other for other in modes if other is not mode))
    nearest = _nearest_hz(together, spec, parts, delay_s)
    what = f"no PID crosses at {spec.bandwidth_hz:g} Hz with a phase margin of "
    what += f"{np.degrees(spec.margin_rad):.0f} deg and a gain margin of {spec.gain_margin:g}"
    expected = "smaller margins" if nearest is None else f"for example {nearest:g} Hz"
    raise InputError(Message(what, f"mode '{mode.name}'", expected))


def _nearest_hz(
    modes: tuple[Mode, ...], spec: TuningSpec, parts: PidParts, delay_s: float
) -> float | None:
    """The bandwidth next to the wanted one that all modes allow, as it is printed."""
    tried = np.array([float(f"{hz:.2g}") for hz in np.geomspace(LOWEST_HZ, HIGHEST_HZ, TRIED)])
    tried = tried[np.argsort(abs(np.log(tried / spec.bandwidth_hz)))]
    return next((hz for hz in tried if _allowed(modes, spec, parts, delay_s, hz)), None)


def _allowed(
    modes: tuple[Mode, ...], spec: TuningSpec, parts: PidParts, delay_s: float, hz: float
) -> bool:
    return all(_at_bandwidth(mode, spec, parts, delay_s, hz) is not None for mode in modes)


def pid_margins(mode: Mode, gains: PidGains, parts: PidParts, delay_s: float) -> Margins:
    """The margins of known gains on a mode, with the delays in the loop."""
    dt = parts.sample_time_s
    law = law_of(gains, parts.derivative.filter(dt), dt, len(mode.state_names))
    return margins_of(mode, law, dt, delay_s)


def _at_bandwidth(
    mode: Mode, spec: TuningSpec, parts: PidParts, delay_s: float, bandwidth_hz: float
) -> PidGains | None:
    w, dt = tau * bandwidth_hz, parts.sample_time_s
    if bandwidth_hz >= 0.5 / dt:
        return None  # samples show it as a lower frequency
    z, integral_time_s = np.exp(1j * w * dt), spec.integral_periods / w
    A, B, C, D = parts.derivative.filter(dt)
    slope = C @ np.linalg.solve(z * np.eye(len(A)) - A, B) + D
    summed = 1.0 + dt * z / (z - 1.0) / integral_time_s
    wanted = np.exp(1j * (spec.margin_rad - pi)) / _plant_at(mode, z, dt, delay_s)
    both = np.array([[summed.real, slope.real], [summed.imag, slope.imag]])
    kp, kd = np.linalg.solve(both, [wanted.real, wanted.imag])
    if kd < 0.0:
        kp, kd = abs(wanted) / abs(summed), 0.0
    shares = {"setpoint": parts.setpoint, "setpoint_rate": parts.setpoint_rate}
    gains = PidGains(proportional=kp, integral=kp / integral_time_s, derivative=kd, **shares)
    law = law_of(gains, (A, B, C, D), dt, len(mode.state_names))
    if kp < 0.0 or np.abs(np.linalg.eigvals(closed(mode, law, dt, delay_s))).max() >= 1.0:
        return None
    found = margins_of(mode, law, dt, delay_s)
    right = found.gain[1] >= spec.gain_margin
    return gains if right and found.phase_rad >= 0.99 * spec.margin_rad else None


def _plant_at(mode: Mode, z: complex, sample_time_s: float, delay_s: float) -> complex:
    """From the opening to the position, at one point of the plane of z."""
    n = len(mode.state_names)
    seen = Law(np.zeros((0, 0)), np.zeros((0, n)), np.zeros(0), -np.eye(n)[0])
    A, B, C = loop(mode, seen, sample_time_s, delay_s)
    return complex((C @ np.linalg.solve(z * np.eye(len(A)) - A, B))[0, 0])
