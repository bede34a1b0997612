"""Simple rivals of hybrid MPC for switching valves: PD or LQ, then one switch or its average.

    share_j = held_j - k_j (x - x_target),   x = (p1, p2, place, speed)

``held`` are the commands that lead to the target, and the target has the pressures that they leave.
A valve is energised where its share is above one half, no sooner than its least time after the last
switch; or it is energised for the share of each period, in steps of the least time (PWM).  Without
a finite estimate the last command holds, then both are shut, as in :mod:`controllers.unseen`; what
was sent then counts too, so that the least time is kept once the estimate is back.

Source: Appl. Sci. 2020, 10(10), 3514 (PD and LQ on the modes of the actuator of paper 003, valves
discretised).  The PD gains and the tolerances of LQ are *chosen*.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from controllers.lq import dlqr
from controllers.shift_prediction import drives
from controllers.unseen import waiting
from linearize.discrete import sampled
from linearize.modes import HybridModel
from linearize.shift_modes import valve_flows
from linearize.shifting import STATES
from linearize.valve_response import MASK, age
from linearize.valve_sample import STANDING_PA
from workbench.contracts import Command, Estimate

SAMPLE_TIME_S, HOLD = 1e-3, 4
PER_M, S_PER_M = 100.0, 1.0
TOLERABLE = np.array([3e5, 3e5, 1e-3, 0.3])  # of the states
TOLERABLE_KG_S = 5e-3
GAUGED = ("Low side 1 charges 2 charges", "High side 1 charges 2 charges")


@dataclass(frozen=True)
class SwitchedMemory:
    """What was done so far.

    sent        commands as integers, newest lowest
    phase       sample within the period
    shares      of the period
    """

    sent: tuple[int, int] = (0, 0)
    phase: int = 0
    shares: tuple[float, float] = (0.0, 0.0)


def _switched(sent: tuple[int, int], wanted: list[int]) -> tuple[np.ndarray, tuple[int, int]]:
    """What is sent of what is wanted, (2,), no valve sooner than it may; and all that was sent."""
    pairs = zip(sent, wanted, strict=True)
    on = [u if age(s) >= HOLD else s & 1 for s, u in pairs]
    first, second = ((s << 1 | u) & MASK for s, u in zip(sent, on, strict=True))
    return np.array(on, dtype=float), (first, second)


def _held_or_shut(wanted: np.ndarray, memory: SwitchedMemory) -> tuple[np.ndarray, SwitchedMemory]:
    """What is sent while nobody knows where the piston is; a period goes on afterwards."""
    on, sent = _switched(memory.sent, wanted.astype(int).tolist())
    return on, replace(memory, sent=sent)


@dataclass(frozen=True)
class SwitchedFeedback:
    """See the module.

    gains       below and above Neutral, each of shape (2, 4)
    targets     pressures and commands that lead there, by position
    period      samples of PWM; 0 without
    """

    gains: tuple[np.ndarray, np.ndarray]
    targets: Mapping[float, tuple[np.ndarray, np.ndarray]]
    period: int = 0
    sample_time_s: float = SAMPLE_TIME_S
    preview: int = 1

    def start(self) -> Command:
        return Command(np.zeros(2), SwitchedMemory())

    @partial(waiting, sent=_held_or_shut)
    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        x, memory = estimate.pick(STATES), last.memory
        place_m = min(self.targets, key=lambda m: abs(m - reference[0, 0]))
        wanted, held = self.targets[place_m]
        shares = held - self.gains[int(x[2] > 0.0)] @ (x - wanted)
        if self.period and memory.phase:
            shares = np.array(memory.shares)
        level = 0.5
        if self.period:
            steps = self.period / HOLD
            shares = np.round(np.clip(shares, 0.0, 1.0) * steps) / steps
            level = memory.phase / self.period
        on, sent = _switched(memory.sent, [int(share > level) for share in shares])
        phase = (memory.phase + 1) % self.period if self.period else 0
        return Command(on, SwitchedMemory(sent, phase, tuple(map(float, shares))))


def switched_pd(hybrid: HybridModel) -> SwitchedFeedback:
    """PD on the place: a brake where the speed is high for what is left of the way."""
    row = np.array([0.0, 0.0, PER_M, S_PER_M])
    gain = np.array([row, -row])
    return SwitchedFeedback((gain, gain), _targets(hybrid))


def switched_lq(hybrid: HybridModel, *, scheduled: bool) -> SwitchedFeedback:
    """LQ on the mode of each side; without scheduling that of the High side counts everywhere."""
    flows = valve_flows(hybrid.plant)
    per_kg_s = 1.0 / (flows(1.0, STANDING_PA) - flows(0.0, STANDING_PA))
    gains = []
    for name in GAUGED:
        small = sampled(hybrid[name], SAMPLE_TIME_S)
        Q, R = np.diag(TOLERABLE**-2.0), np.eye(2) * TOLERABLE_KG_S**-2.0
        gains.append(per_kg_s[:, None] * dlqr(small.F, small.G, Q, R, hybrid[name].scale))
    low, high = gains
    return SwitchedFeedback((low if scheduled else high, high), _targets(hybrid))


def averaged(design: SwitchedFeedback, period: int = 3 * HOLD) -> SwitchedFeedback:
    """The same law behind PWM with this period in samples."""
    return replace(design, period=period)


def _targets(hybrid: HybridModel) -> dict[float, tuple[np.ndarray, np.ndarray]]:
    plant = hybrid.plant
    vented, full = (float(plant.values[f"{n}.pressure_pa"]) for n in ("atmosphere", "supply"))
    return {
        m: (np.array([full if on else vented for on in held] + [m, 0.0]), np.array(held, float))
        for m, held in drives(plant, SAMPLE_TIME_S).items()
    }
