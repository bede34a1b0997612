"""What a drive's recordings show of friction: forces at steady speed, and forces at break-away.

The force of friction is what all others leave over, read from the plant's own balance of the body
at the recorded pressures: F_f = sum of the other forces - M a.  What the plant's own factor says
that pressure adds to it is taken off: the factor stays in the plant, and would count twice.

Source: paper 002 Eq. 9, Figs. 13 and 14; physics.md 5, rows S002-4 and S002-5.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.differentiator import derivative
from workbench.effect import Expression
from workbench.effects import StribeckFriction
from workbench.plant import Plant
from workbench.recording import Recording

SMOOTHING_S = 0.05  # of the speed, where it is to be steady
STEADY = 0.15  # of the speed: it stays within
LEAST_TRAVEL_M = 0.06
RESTING_M_S, MOVING_M_S = 2e-3, 20e-3
LEAST_REST_S = 0.05
LONGEST_CREEP_S = 0.5  # between the rest and the motion
FORCE_SAMPLES = 5  # over which forces are averaged
WAYS = (True, False)  # forward, back
LEAST_BREAKS = 3  # of one direction, whose spread is one
SPREAD = 0.05  # of a break-away force, where too few tell it: that over the stroke of a real seal


@dataclass(frozen=True)
class SteadyRun:
    """Mean speed and friction of one run, and the standard deviation of that friction.

    As in all of this file, friction is without the part by pressure.
    """

    velocity_m_s: float
    force_n: float
    deviation_n: float


@dataclass(frozen=True)
class BreakAway:
    """The force at which a resting piston broke away, where it rested, and which way it went."""

    position_m: float
    forward: bool
    force_n: float


@dataclass(frozen=True)
class Motion:
    """Position, speed and the sum of all forces but friction, each of shape (n,).

    ``pressed_n`` is the dry friction by pressure, positive; ``mass_kg`` all that moves along.
    """

    sample_time_s: float
    position_m: np.ndarray
    velocity_m_s: np.ndarray
    pushing_n: np.ndarray
    pressed_n: np.ndarray
    mass_kg: float

    def friction_n(self, forward: bool, mean_samples: int = 1) -> np.ndarray:
        """What friction holds against at rest or at constant speed, (n,), positive that way."""
        pushing_n = self.pushing_n if forward else -self.pushing_n
        return _averaged(pushing_n - self.pressed_n, mean_samples)


def motion(plant: Plant, friction: StribeckFriction, recording: Recording) -> Motion:
    """The motion of the body that a friction acts on, as recorded."""
    body = friction.body
    position = recording[f"{body}.position_m"]
    dt = recording.sample_time_s
    seen = {**recording.channels, f"{body}.velocity_m_s": derivative(position, dt)}
    x = np.repeat(plant.initial[:, None], len(recording), axis=1)
    for row, name in enumerate(plant.state_list):
        if name in seen:
            x[row] = seen[name]
    u, d = (
        recording.rows(signal.name for signal in group)
        for group in (plant.commands, plant.measured_inputs)
    )
    model = plant.model
    pushed = sum(_received(plant, "Force", body, but=friction.name))
    carried = sum(_received(plant, "AddedMass", body))
    moved_kg = model.conditions.read(f"{body}.moving_mass_kg") + carried
    told = ca.vertcat(pushed, friction.pressed_force_n(model.conditions), moved_kg)
    evaluate = ca.Function("told", [*model.symbols], [told]).map(len(recording))
    pushing, pressed, mass = evaluate(x, u, d, plant.nominal[2]).full()
    speed = seen[f"{body}.velocity_m_s"]
    return Motion(dt, position, speed, pushing, pressed, float(np.mean(mass)))


def _received(plant: Plant, kind: str, body: str, but: str = "") -> Iterator[Expression]:
    """What all members but one put into a body."""
    for (member, flow, balance), value in plant.model.flows.items():
        if flow == kind and balance == body and member != but:
            yield value


def steady_run(moved: Motion) -> SteadyRun | None:
    """The longest stretch of steady speed, if it is long enough."""
    width = max(round(SMOOTHING_S / moved.sample_time_s), 1)
    speed = _averaged(moved.velocity_m_s, width)
    fast = np.abs(speed) > 0.5 * np.quantile(np.abs(speed), 0.95)
    usual = float(np.median(speed[fast])) if fast.any() else 0.0
    first, last = _longest(np.abs(speed - usual) < STEADY * abs(usual))
    inside = slice(first, last)
    position = moved.position_m[inside]
    if len(position) < 3 * width or abs(position[-1] - position[0]) < LEAST_TRAVEL_M:
        return None
    time_s = moved.sample_time_s * np.arange(len(position))
    acceleration = float(np.polyfit(time_s, speed[inside], 1)[0])
    along = 1.0 if usual > 0 else -1.0
    force = along * moved.friction_n(usual > 0)[inside] - moved.mass_kg * acceleration
    blocks = force[: len(force) // width * width].reshape(-1, width).mean(axis=1)
    deviation = float(np.std(blocks) / np.sqrt(len(blocks)))
    velocity = float((position[-1] - position[0]) / time_s[-1])
    return SteadyRun(velocity, float(np.mean(force)), deviation)


def break_aways(moved: Motion) -> tuple[BreakAway, ...]:
    """Every start of a motion behind a rest of 50 ms: the largest force between the two.

    The piston creeps for a while at that force, since friction falls with speed only.
    """
    dt, speed = moved.sample_time_s, np.abs(moved.velocity_m_s)
    rest = round(LEAST_REST_S / dt)
    rested = np.flatnonzero(_averaged(1.0 * (speed < RESTING_M_S), rest) > 0.95)
    starts = np.flatnonzero((speed[1:] > MOVING_M_S) & (speed[:-1] <= MOVING_M_S)) + 1
    found, last = [], 0
    for start in starts:
        since = rested[(rested >= last) & (rested < start)]
        last = start
        if not len(since) or (start - since[-1]) * dt > LONGEST_CREEP_S:
            continue
        forward = bool(moved.velocity_m_s[start] > 0)
        near = moved.friction_n(forward, FORCE_SAMPLES)[since[-1] : start + 1]
        size = float(np.max(near))
        found.append(BreakAway(float(moved.position_m[since[-1]]), forward, size))
    return tuple(found)


def breaking_forces(breaks: Sequence[BreakAway]) -> list[tuple[bool, float, float]]:
    """Direction, mean force and the deviation of that mean, of each direction that broke away.

    The spread over few is that of the other direction, or else a usual one: one break-away has
    none, and two may agree by chance.
    """
    every = [(way, np.array([b.force_n for b in breaks if b.forward == way])) for way in WAYS]
    told = [np.std(n, ddof=1) / np.mean(n) for _, n in every if len(n) >= LEAST_BREAKS]
    usual = float(np.mean(told)) if told else SPREAD
    found = []
    for forward, sizes in (row for row in every if len(row[1])):
        own_n = float(np.std(sizes, ddof=1)) if len(sizes) > 1 else 0.0
        few_n = usual * float(np.mean(sizes)) if len(sizes) < LEAST_BREAKS else 0.0
        spread_n = max(own_n, few_n) / np.sqrt(len(sizes))
        found.append((forward, float(np.mean(sizes)), float(spread_n)))
    return found


def speeds(runs: Sequence[SteadyRun], forward: bool) -> int:
    """How many different speeds the runs of one direction have; closer than steady is the same."""
    count, last = 0, 0.0
    for speed in sorted(abs(r.velocity_m_s) for r in runs if (r.velocity_m_s > 0) == forward):
        if speed > (1.0 + STEADY) * last:
            count, last = count + 1, speed
    return count


def _averaged(values: np.ndarray, width: int) -> np.ndarray:
    """Moving mean, shorter at the ends."""
    window = np.ones(min(width, len(values)))
    count = np.convolve(np.ones(len(values)), window, mode="same")
    return np.convolve(values, window, mode="same") / count


def _longest(chosen: np.ndarray) -> tuple[int, int]:
    """First and last index (excluded) of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]])))
    if not len(edges):
        return 0, 0
    firsts, lasts = edges[::2], edges[1::2]
    k = int(np.argmax(lasts - firsts))
    return int(firsts[k]), int(lasts[k])
