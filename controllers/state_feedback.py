"""State feedback with integral action, by linear-quadratic regulation on each mode."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import solve_discrete_are

from controllers.margins import Law, integral_of
from controllers.positioning import (
    PREVIEW,
    STATES,
    Memory,
    Positioning,
    PositioningSpec,
    positioning,
)
from controllers.scheduled import Schedule, scheduled
from linearize.discrete import sampled
from linearize.modes import HybridModel, Mode
from linearize.standard import POSITION, PRESSURES, VELOCITY
from workbench.contracts import Command, Estimate


@dataclass(frozen=True, kw_only=True)
class LqSpec:
    """Tolerable deviations, each worth a cost of one (Bryson's rule), and the clock.

    ``integral_time_s`` is the time over which a constant tolerable position error costs one.
    """

    sample_time_s: float = 2e-3
    position_m: float = 1.5e-3
    velocity_m_s: float = 0.12
    pressure_pa: float = 1e6
    opening_v: float = 0.3
    integral_time_s: float = 0.1
    positioning: PositioningSpec = field(default_factory=PositioningSpec)


@dataclass(frozen=True)
class Gain:
    """Feedback of (position, velocity, pressure a, pressure b) and of the integral of the error.

    feedback      K in V per unit of state, shape (4,)
    integral      K_i in V/(m s)
    poles         of the closed loop with integral, on the plane of s, 1/s, shape (5,)
    """

    feedback: np.ndarray
    integral: float
    poles: np.ndarray


@dataclass(frozen=True)
class StateFeedback:
    """Opening = that of the motion - K (x - target) - K_i integral, one gain per mode, mixed.

    The integral rests while the opening is at its limit, so that it cannot wind up.
    """

    task: Positioning
    gains: Schedule[Gain]
    sample_time_s: float
    preview: int = PREVIEW

    @property
    def laws(self) -> Schedule[Law]:
        """What it does while the slide moves and no limit is met."""
        dt = self.sample_time_s
        return self.gains.mapped(lambda gain: integral_of(gain.feedback, gain.integral, dt))

    def start(self) -> Command:
        return Command(self.task.valve.shut, Memory())

    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        memory, valve = last.memory, self.task.valve
        now = self.task.task(memory, reference, estimate.pick(STATES), self.sample_time_s)
        if now.rests:
            shut = valve.sent(0.0, estimate)
            return Command(shut, Memory(memory.integral_m_s, True), {"resting": 1.0})
        here = [*self.gains.weighted(now.x[0], now.ahead)]
        feedback = sum(w * gain.feedback for w, gain in here)
        integral_gain = sum(w * gain.integral for w, gain in here)
        integral = memory.integral_m_s + self.sample_time_s * now.rate_m
        wanted = now.opening_v - feedback @ now.deviation - integral_gain * integral
        opening = float(np.clip(wanted, *valve.openings_v))
        if opening != wanted:
            integral = memory.integral_m_s
        notes = {"resting": 0.0, "opening_v": opening, "integral_m_s": integral}
        return Command(valve.sent(opening, estimate), Memory(integral), notes)


def lq_state_feedback(hybrid: HybridModel, spec: LqSpec | None = None) -> StateFeedback:
    """LQ designs on every mode in which the valve drives the motion.

    Raises
    ------
    ValueError
        If a mode cannot be stabilised.
    """
    spec = spec or LqSpec()
    gains = scheduled(hybrid, lambda mode: lq_gain(mode, spec))
    return StateFeedback(positioning(hybrid, spec.positioning), gains, spec.sample_time_s)


def weights(spec: LqSpec) -> tuple[np.ndarray, np.ndarray]:
    """Q of (state, integral), shape (5, 5), and R, shape (1, 1), in SI units."""
    tolerable = {
        POSITION: spec.position_m,
        VELOCITY: spec.velocity_m_s,
        **dict.fromkeys(PRESSURES, spec.pressure_pa),
    }
    state = [tolerable[name] ** -2.0 for name in STATES]
    integral = (spec.position_m * spec.integral_time_s) ** -2.0
    return np.diag([*state, integral]), np.array([[spec.opening_v**-2.0]])


def lq_gain(mode: Mode, spec: LqSpec) -> Gain:
    """Gain of one sampled mode, extended by the integral of the position error."""
    small, n, dt = sampled(mode, spec.sample_time_s), len(mode.state_names), spec.sample_time_s
    F, G = np.eye(n + 1), np.zeros((n + 1, 1))
    F[:n, :n], F[n, mode.state_names.index(POSITION)], G[:n] = small.F, dt, small.G
    Q, R = weights(spec)
    try:
        K = dlqr(F, G, Q, R, np.array([*mode.scale, mode.scale[0]]))
    except np.linalg.LinAlgError as error:
        raise ValueError(f"mode {mode.name!r} cannot be stabilised by its command") from error
    poles = np.log(np.linalg.eigvals(F - G @ K).astype(complex)) / dt
    return Gain(K[0, :n], float(K[0, n]), poles)


def dlqr(
    F: np.ndarray, G: np.ndarray, Q: np.ndarray, R: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """K of u = -K x that minimises the sum of x'Qx + u'Ru, shape (n_u, n_x); solved scaled."""
    F, G = F * scale / scale[:, None], G / scale[:, None]
    Q = Q * np.outer(scale, scale)
    X = solve_discrete_are(F, G, Q, R)
    return np.linalg.solve(R + G.T @ X @ G, G.T @ X @ F) / scale
