"""Laws behind an estimator that hands on the state which their opening will meet.

The estimators of a plant with delayed commands carry their state on by what was sent and is under
way (:mod:`estimators.ahead`), over whole samples and then the rest.  On a mode that is linear,

    x_m = F^m x + sum over k = 1 .. m of F^(m-k) G u(k - delay / T),   delay = m T + rest
    x_ahead = F_rest x_m + G_rest u(0)

u counted in samples after the newest, between samples by interpolation.  So it is part of the law,
whose memory the sent openings are; the delay itself is in the loop as any other.

Source: O. J. M. Smith, "Closer control of loops with dead time", Chem. Eng. Progress 53 (1957) 217,
in its state-space form.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from controllers.axis import Axis
from controllers.lags import Lag, lags_of
from controllers.margins import Law, both_ways_s, unforeseen_s
from controllers.on_measurement import OnMeasurement
from controllers.scheduled import Schedule, with_modes
from linearize.discrete import sampled
from linearize.modes import HybridModel, Mode
from workbench.contracts import Controller
from workbench.plant import Plant
from workbench.simulation import command_delay_s

SLACK = 1e-6  # of a sample, as of the estimators


@dataclass(frozen=True)
class Delays:
    """What is late in a loop: sensors, commands, and whether an estimator foresees the latter.

    ``lags`` are those of the spool and of a sensor that are in the loop (:mod:`controllers.lags`).
    """

    sensors_s: float
    commands_s: float
    foreseen: bool
    lags: tuple[Lag, ...] = ()

    @property
    def both_s(self) -> float:
        """What is in the loop."""
        return self.sensors_s + self.commands_s

    @property
    def left_s(self) -> float:
        """What an exact foresight leaves of it."""
        return self.sensors_s if self.foreseen else self.both_s


def delays_of(plant: Plant, law: Controller) -> Delays:
    """Those that a law is designed for: one on the measurement itself meets all of both."""
    sensors_s, foreseen = unforeseen_s(plant), not isinstance(law, OnMeasurement)
    commands_s = both_ways_s(plant) - sensors_s
    return Delays(sensors_s, commands_s, foreseen, lags_of(plant, law))


def foreseeing(
    hybrid: HybridModel, laws: Schedule[Law], sample_time_s: float, axis: Axis | None = None
) -> Schedule[Law]:
    """The laws of all driven modes, each behind the foresight of its mode."""
    delay_s = command_delay_s(hybrid.plant)

    def ahead(mode: Mode, law: Law) -> Law:
        return foresighted(mode, law, sample_time_s, delay_s)

    return with_modes(hybrid, laws, ahead, axis)


def foresighted(mode: Mode, law: Law, sample_time_s: float, delay_s: float) -> Law:
    """One law on the predicted state; its memory ends with the sent openings, oldest first."""
    reach, effects = _ahead(mode, sample_time_s, delay_s)
    m, kept = len(law.A), effects.shape[1]
    if not kept:
        return law
    A = np.zeros((m + kept,) * 2)
    A[:m, :m], A[:m, m:] = law.A, law.B @ effects
    A[m:, m:] = np.eye(kept, k=1)
    C, D = np.concatenate([law.C, law.D @ effects]), law.D @ reach
    A[-1] = C
    return Law(A, np.vstack([law.B @ reach, np.zeros((kept - 1, len(D))), D]), C, D)


def _ahead(mode: Mode, sample_time_s: float, delay_s: float) -> tuple[np.ndarray, np.ndarray]:
    """What state and sent openings, oldest first, do to the predicted state: (n, n), (n, kept)."""
    late, small = delay_s / sample_time_s, sampled(mode, sample_time_s)
    whole = int(late + SLACK)
    reach, effects = np.eye(len(small.F)), np.zeros((len(small.F), under_way(late)))
    for k in range(1, whole + 1):
        sent = sent_at(k - late, effects.shape[1])
        reach, effects = small.F @ reach, small.F @ effects + np.outer(small.G[:, 0], sent)
    if late - whole > SLACK:
        rest = sampled(mode, delay_s - whole * sample_time_s)
        reach, effects = rest.F @ reach, rest.F @ effects
        effects[:, -1] += rest.G[:, 0]
    return reach, effects


def under_way(late: float) -> int:
    """How many sent openings count, so many samples late."""
    return ceil(late - SLACK)


def sent_at(samples: float, kept: int) -> np.ndarray:
    """Weights of the sent openings, oldest first, so many samples after the newest, (kept,)."""
    index = np.arange(kept) - (kept - 1)
    return np.array([np.interp(samples, index, one) for one in np.eye(kept)])
