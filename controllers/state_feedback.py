"""State feedback with integral action, by linear-quadratic regulation on each mode."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from controllers.lq import Gain, lq_gain
from controllers.margins import Law
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
from linearize.modes import HybridModel
from linearize.standard import COMMAND, POSITION, PRESSURES, VELOCITY
from workbench.contracts import Command, Estimate

FINEST_M = 1e-6  # no sensor shows less; gains for it are those of no weight on the valve


@dataclass(frozen=True, kw_only=True)
class LqSpec:
    """Tolerable deviations, each worth a cost of one (Bryson's rule), and the clock.

    ``integral_time_s`` is the time over which a constant tolerable position error costs one.
    """

    sample_time_s: float = 2e-3
    position_m: float = ranged(1.5e-3, least=FINEST_M)
    velocity_m_s: float = 0.12
    pressure_pa: float = 1e6
    opening_v: float = 0.3
    integral_time_s: float = 0.1
    positioning: PositioningSpec = field(default_factory=PositioningSpec)

    @property
    def tolerable(self) -> dict[str, float]:
        """The weights by signal name."""
        pressures = dict.fromkeys(PRESSURES, self.pressure_pa)
        own = {POSITION: self.position_m, VELOCITY: self.velocity_m_s, COMMAND: self.opening_v}
        return own | pressures


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
        return self.gains.mapped(lambda gain: gain.law(self.sample_time_s))

    def start(self) -> Command:
        return Command(self.task.valve.shut, Memory())

    @waiting
    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        memory, valve = last.memory, self.task.valve
        now = self.task.task(memory, reference, estimate.pick(STATES), self.sample_time_s)
        if now.rests:
            shut = valve.sent(0.0, estimate)
            return Command(shut, Memory(memory.integral_m_s, True), {"resting": 1.0})
        here = self.gains.weighted(now.x[0], now.ahead)
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
    NoGainError
        If the regulator of these weights cannot be computed.
    """
    spec = spec or LqSpec()
    weighed = (spec.tolerable, spec.integral_time_s, spec.sample_time_s)
    gains = scheduled(hybrid, lambda mode: lq_gain(mode, *weighed))
    return StateFeedback(positioning(hybrid, spec.positioning), gains, spec.sample_time_s)
