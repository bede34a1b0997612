"""A method of its own in every mode: gains of PID, LQ or cascade in one schedule.

    opening = opening_r - K (x - target) - sum of K_i rate T

K and K_i are those of the modes that count here, each by its own method, mixed as in
:mod:`controllers.scheduled`.  The integral is kept in volts: what it holds against friction or an
offset stays where a mode with another K_i takes over, so nothing jumps there (bumpless transfer).
A PID takes the estimated velocity unfiltered, and the force that a cascade wants is not limited.

Source: W. J. Rugh and J. S. Shamma, "Research on gain scheduling", Automatica 36 (2000) 1401,
Sec. 4 (mixed designs); K. J. Astrom and T. Hagglund, "Advanced PID Control", ISA 2006, Sec. 3.5
(integral at the output).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from controllers.cascade import CascadeSpec, cascade_gain
from controllers.lq import Gain, gain_of, lq_gain
from controllers.margins import Law, in_volts
from controllers.motion import PREVIEW
from controllers.pid import PidSpec, pid_gain
from controllers.positioning import STATES, Memory, Positioning, PositioningSpec, positioning
from controllers.scheduled import Schedule, driven_modes, scheduled
from controllers.spec import chosen
from controllers.state_feedback import LqSpec
from controllers.unseen import waiting
from linearize.modes import HybridModel, Mode
from workbench.contracts import Command, Estimate
from workbench.errors import Message, UnknownNameError, listed, nearest


class Method(Enum):
    """How the gains of one mode are found."""

    LQ = "lq"
    PID = "pid"
    CASCADE = "cascade"


@dataclass(frozen=True, kw_only=True)
class PerModeSpec:
    """The method by name of a driven mode, LQ where none is named, and the clock.

    The methods have their usual numbers.
    """

    sample_time_s: float = 1e-3
    modes: Mapping[str, Method] = chosen(Method)
    positioning: PositioningSpec = field(default_factory=PositioningSpec)


@dataclass(frozen=True)
class PerMode:
    """See the module; the plan of the memory is the integral in V."""

    task: Positioning
    gains: Schedule[Gain]
    sample_time_s: float
    preview: int = PREVIEW

    @property
    def laws(self) -> Schedule[Law]:
        """What it does while the slide moves and no limit is met; the memory is in V."""
        return self.gains.mapped(lambda gain: in_volts(gain.law(self.sample_time_s)))

    def start(self) -> Command:
        return Command(self.task.valve.shut, Memory(plan=0.0))

    @waiting
    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        memory, valve, dt = last.memory, self.task.valve, self.sample_time_s
        now = self.task.task(memory, reference, estimate.pick(STATES), dt)
        if now.rests:
            shut = valve.sent(0.0, estimate)
            return Command(shut, replace(memory, resting=True), {"resting": 1.0})
        here = self.gains.weighted(now.x[0], now.ahead)
        integral_v = memory.plan + dt * now.rate_m * sum(w * gain.integral for w, gain in here)
        feedback = sum(w * gain.feedback for w, gain in here)
        wanted = now.opening_v - feedback @ now.deviation - integral_v
        opening = float(np.clip(wanted, *valve.openings_v))
        if opening != wanted:
            integral_v = memory.plan
        notes = {"resting": 0.0, "opening_v": opening, "integral_v": integral_v}
        return Command(valve.sent(opening, estimate), Memory(plan=integral_v), notes)


def per_mode(hybrid: HybridModel, spec: PerModeSpec | None = None) -> PerMode:
    """The chosen method on every mode in which the valve drives the motion.

    Raises
    ------
    UnknownNameError
        If a method is chosen for a mode in which the valve does not drive the motion.
    """
    spec = spec or PerModeSpec()
    names = [mode.name for side in driven_modes(hybrid) for mode in side]
    if unknown := [_unknown(name, names) for name in spec.modes if name not in names]:
        raise UnknownNameError(*unknown)
    task = positioning(hybrid, spec.positioning)

    def gain(mode: Mode) -> Gain:
        method = spec.modes.get(mode.name, Method.LQ)
        return GAINS[method](mode, task.area_m2, spec.sample_time_s)

    return PerMode(task, scheduled(hybrid, gain), spec.sample_time_s)


def _unknown(name: str, known: list[str]) -> Message:
    what = "the modes in which the valve drives the motion have no such name"
    expected = f"one of {listed(known, len(known))}"
    return Message(what, f"per-mode.modes.{name}", expected, nearest(name, known))


def _lq(mode: Mode, _area_m2: float, sample_time_s: float) -> Gain:
    spec = LqSpec()
    return lq_gain(mode, spec.tolerable, spec.integral_time_s, sample_time_s)


def _pid(mode: Mode, _area_m2: float, sample_time_s: float) -> Gain:
    # slower than a PID alone has it: here the integral runs from farther away
    found = pid_gain(mode, PidSpec(sample_time_s=sample_time_s, integral_time_s=1.0))
    K = np.array([found.proportional, found.derivative, 0.0, 0.0, found.integral])
    return gain_of(mode, K, sample_time_s)


def _cascade(mode: Mode, area_m2: float, sample_time_s: float) -> Gain:
    found = cascade_gain(mode, area_m2, CascadeSpec())
    return gain_of(mode, found.feedback(area_m2), sample_time_s)


GAINS: Mapping[Method, Callable[[Mode, float, float], Gain]] = {
    Method.LQ: _lq,
    Method.PID: _pid,
    Method.CASCADE: _cascade,
}
"""The gain of a mode by its method, from the mode, the piston's area and the sample time."""
