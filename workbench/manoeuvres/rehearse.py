"""Manoeuvres rehearsed on a fitted plant, all in one batch, with a position loop where one acts.

The loop gives the command that moves the plant at the speed it asks for,

    v = dr/dt + w (r - y),   u = speed map^-1 (v)

with the speed map of the fitted plant from a batch of constant commands: dead zones and unequal
directions are jumped over.  Close to a resting reference it gives the resting command, as a person
stops the hunting of a drive with stiction, and so it does without a reference.  Where rivals are
compared each runs in a loop of its own: a loop hides what tells them apart unless the commands are
compared too (diagnosis.md 1.8).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.called import called, result
from workbench.effects.timing import sent_at_s
from workbench.filtering import consistent_start
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.window_runs import THREADS
from workbench.manoeuvres.limits import Axis, Limits
from workbench.manoeuvres.play import Play
from workbench.model import BLOCK
from workbench.recording import Recording
from workbench.simulation import received

BANDWIDTH_RAD_S = 6.0
PER_UPDATE = 0.5  # of the error that is left may go in one update of the loop
REST = 5e-3  # of the range of an axis: closer to a resting reference the loop rests
PROBED = 61  # constant commands
PROBE_S = 0.6
PROBED_WAY = 0.15  # of the range of an axis: beyond, a probe is over


@dataclass(frozen=True)
class SpeedMap:
    """Speed of an axis, rising, and the command that gives it, both of shape (n,)."""

    speed: np.ndarray
    command: np.ndarray

    def command_for(self, wanted: np.ndarray) -> np.ndarray:
        """Commands for speeds."""
        return np.interp(wanted, self.speed, self.command)


def rehearse(
    fit: Fit, limits: Limits, plays: Sequence[Play], maps: Sequence[SpeedMap]
) -> list[Recording]:
    """What a fitted plant would record of each play: commands, measured inputs and outputs.

    It starts where the first recording does, at rest: elsewhere a limit may be broken before
    anything is played.  ``maps`` are those of the axes: one loop serves all rivals.
    """
    if not plays:
        return []
    batch = _Batch(fit, limits, len(plays))
    commands = np.array([play.commands for play in plays])  # (n_plays, n_u, n)
    reference = np.array([play.reference for play in plays])
    for first in range(0, limits.samples, BLOCK):
        span = slice(first, min(first + BLOCK, limits.samples))
        for k, (axis, speeds) in enumerate(zip(limits.axes, maps, strict=True)):
            row = fit.windows.plant.measured.index(axis.output)
            given = _loop(limits, axis, speeds, reference[:, k], batch.outputs()[row], first)
            own = commands[:, k, span]
            commands[:, k, span] = np.where(np.isnan(own), given[:, None], own)
        batch.advance(commands, span)
    return batch.recordings(commands)


def speed_maps(fit: Fit, limits: Limits) -> list[SpeedMap]:
    """The speed map of each axis from the middle of its range on, other commands at rest.

    From an end of the stroke, where many a recording begins, it would move one way only.
    """
    places = np.linspace(-1.0, 1.0, PROBED)
    sizes = places * np.abs(places)  # close to the centre, where dead zones end
    samples = BLOCK * max(round(PROBE_S / limits.sample_time_s / BLOCK), 1)
    found = []
    for k, axis in enumerate(limits.axes):
        signal = limits.commands[k]
        nominal = np.array([s.nominal for s in limits.commands])
        commands = np.tile(nominal[None, :, None], (PROBED, 1, samples))
        up, down = signal.upper - signal.nominal, signal.nominal - signal.lower
        levels = signal.nominal + np.where(sizes > 0, up, down) * sizes
        commands[:, k] = levels[:, None]
        middle = {**limits.begun, axis.output: (axis.low + axis.high) / 2}
        batch = _Batch(fit, replace(limits, begun=middle), PROBED)
        for first in range(0, samples, BLOCK):
            batch.advance(commands, slice(first, first + BLOCK))
        row = fit.windows.plant.measured.index(axis.output)
        moved = np.array([one[row] for one in batch.seen()])
        speed = _speeds(moved, axis, limits.sample_time_s)
        if speed[-1] < speed[0]:
            speed, levels = speed[::-1], levels[::-1]
        found.append(SpeedMap(np.maximum.accumulate(speed), levels))
    return found


def _speeds(moved: np.ndarray, axis: Axis, sample_time_s: float) -> np.ndarray:
    """Speed of each probe (n_probes, n) over the second half of its way, or of its time."""
    far = np.abs(moved - moved[:, :1]) > PROBED_WAY * (axis.high - axis.low)
    last = np.where(far.any(axis=1), far.argmax(axis=1), moved.shape[1] - 1).clip(2)
    half = last // 2
    rows = np.arange(len(moved))
    return (moved[rows, last] - moved[rows, half]) / ((last - half) * sample_time_s)


def update_s(limits: Limits) -> float:
    """Time from one command of the loop to the next, which it holds meanwhile."""
    return BLOCK * limits.sample_time_s


def bandwidth_rad_s(limits: Limits) -> float:
    """The loop's bandwidth w: less where its updates are far apart."""
    return min(BANDWIDTH_RAD_S, PER_UPDATE / update_s(limits))


def rest_within(axis: Axis) -> float:
    """How near to a resting reference the loop rests, in m or rad."""
    return REST * (axis.high - axis.low)


def _loop(
    limits: Limits, axis: Axis, speeds: SpeedMap, reference: np.ndarray, y: np.ndarray, first: int
) -> np.ndarray:
    """The command of one axis until the next update, for every play, shape (n_plays,).

    Where a reference ends before the next update it is followed as one that rests.
    """
    step_s = update_s(limits)
    later = min(first + BLOCK, reference.shape[1] - 1)
    rate = np.nan_to_num(reference[:, later] - reference[:, first]) / step_s
    error = reference[:, first] - y
    wanted = rate + bandwidth_rad_s(limits) * error
    given = speeds.command_for(np.clip(wanted, -axis.speed, axis.speed))
    still = np.abs(rate) < 1e-6 * (axis.high - axis.low) / step_s
    rests = ((np.abs(error) < rest_within(axis)) & still) | np.isnan(reference[:, first])
    nominal = limits.commands[limits.axes.index(axis)].nominal
    return np.where(rests, nominal, given)


class _Batch:
    """A fitted plant run under several command sequences side by side, from where limits begin."""

    def __init__(self, fit: Fit, limits: Limits, n: int) -> None:
        self.plant, self.limits, self.n = fit.plant, limits, n
        plant = fit.windows.plant  # its model serves all values
        self.model, self.channels = plant.model, _held_inputs(fit)
        block = self.model.compiled_block(limits.sample_time_s)
        self.block, self.h = block.map(n, "thread", THREADS), self.model.h.map(n)
        self.p = np.tile(self.plant.nominal[2][:, None], n)
        self.d = np.array([*self.channels.values()]).reshape(-1, 1)
        self.x = np.tile(consistent_start(self.plant, limits.begun)[:, None], (1, n))
        time_s = limits.time_s
        sent_s = [sent_at_s(self.plant.members, name, time_s) for name in self.model.commands]
        self.late = {k: sent for k, sent in enumerate(sent_s) if sent is not time_s}
        self.states: list[np.ndarray] = []
        self.inputs: list[np.ndarray] = []

    def outputs(self) -> np.ndarray:
        """Outputs now, shape (n_y, n_plays), under the commands that hold."""
        u = self.inputs[-1][:, :, -1].T if self.inputs else self._resting()
        return result(self.h, self.x, u, np.tile(self.d, (1, self.n)), self.p)

    def advance(self, commands: np.ndarray, span: slice) -> None:
        """Run one block on under commands (n_plays, n_u, n), known up to its end."""
        u = self._arrived(commands, span)
        size = u.shape[2]
        full = np.pad(u, ((0, 0), (0, 0), (0, BLOCK - size)), mode="edge")
        columns = full.transpose(1, 0, 2).reshape(u.shape[1], self.n * BLOCK)
        d = np.tile(self.d, (1, self.n * BLOCK))
        last, later = called(self.block, self.x, columns, d, self.p)
        later = later.reshape(len(self.x), self.n, BLOCK).transpose(1, 0, 2)
        here = np.concatenate([self.x.T[:, :, None], later[:, :, :-1]], axis=2)
        self.states.append(here[:, :, :size])
        self.inputs.append(u)
        self.x = last

    def seen(self) -> list[np.ndarray]:
        """Outputs of each play as the computer gets them, shape (n_y, n)."""
        x, u = (np.concatenate(parts, axis=2) for parts in (self.states, self.inputs))
        n = x.shape[2]
        h, d, p = self.model.h.map(n), np.tile(self.d, (1, n)), np.tile(self.p[:, :1], n)
        dt = self.limits.sample_time_s
        return [
            received(self.plant, result(h, own, sent, d, p), dt)
            for own, sent in zip(x, u, strict=True)
        ]

    def recordings(self, commands: np.ndarray) -> list[Recording]:
        """What each play records, with the states behind it as far as they are not recorded."""
        found = []
        states = np.concatenate(self.states, axis=2)
        for sent, hidden, outputs in zip(commands, states, self.seen(), strict=True):
            n = outputs.shape[1]
            held = {name: np.full(n, value) for name, value in self.channels.items()}
            rows = dict(zip(self.model.commands, sent, strict=True)) | held
            rows |= dict(zip(self.model.states, hidden, strict=True))
            rows |= dict(zip(self.model.measured, outputs, strict=True))
            dt = self.limits.sample_time_s
            found.append(Recording("rehearsal", dt, rows, source="simulation"))
        return found

    def _arrived(self, commands: np.ndarray, span: slice) -> np.ndarray:
        """Commands of a block behind the causes in time, of all that was sent up to its end."""
        found = commands[:, :, span].copy()
        for k, sent_s in self.late.items():
            place = sent_s[span] / self.limits.sample_time_s
            known = np.arange(span.stop)
            found[:, k] = [np.interp(place, known, row[: span.stop]) for row in commands[:, k]]
        return found

    def _resting(self) -> np.ndarray:
        nominal = np.array([s.nominal for s in self.limits.commands])
        return np.tile(nominal[:, None], (1, self.n))


def _held_inputs(fit: Fit) -> dict[str, float]:
    """Measured inputs at the middle of what was recorded of them."""
    recorded = fit.windows.recordings
    names = [signal.name for signal in fit.windows.plant.measured_inputs]
    return {n: float(np.nanmedian(np.concatenate([r[n] for r in recorded]))) for n in names}
