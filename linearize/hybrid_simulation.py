"""Hybrid modes in time: each sampled exactly, switched where the state or the command leaves a box.

Inside a mode the state goes by x[k+1] = F x[k] + G u[k] + offset.  The mode is looked up at every
sample, which is when a controller would look too.

Jumps.  A piston that picks up another one shares its momentum with it, within the sample in which
they meet; see :class:`linearize.cuts.Jump`.

Sticking.  A mode that holds states stands for dry friction or for a stop: the velocity is zero,
the position stays.  :mod:`linearize.holding` says when it lets go, so that a slide breaks away when
pressure overcomes the peak of static friction.  A velocity that would jump across its holding
interval within one sample stops in it.

Source: Karnopp 1985 (zero velocity as an interval, break-away by force); Goebel, Sanfelice, Teel
2009, "Hybrid dynamical systems" (jumps of the state); physics.md 4.2, 4.3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from linearize.cuts import SAME_LEVEL, Level, Region
from linearize.discrete import sampled
from linearize.holding import Hold, holds_of, resting_states
from linearize.modes import HybridModel, Mode
from workbench.plant import require


@dataclass(frozen=True)
class HybridRun:
    """What the modes do under commands, of one start or of n_w starts side by side.

    states     of the design model, shape (n_x, n) or (n_x, n, n_w); the first column is the start
    modes      index into ``HybridModel.modes`` from each sample on, shape (n,) or (n, n_w)
    """

    states: np.ndarray
    modes: np.ndarray


@dataclass(frozen=True)
class SampledHybrid:
    """All modes at samples as one stack, over rows z = (x, u, 1) of the whole design model.

    steps          [F G offset] of every mode, shape (n_modes, n_x, n_x + n_u + 1)
    lower, upper   ends of the boxes, shape (n_modes, n_signals)
    columns        place of each cut signal in z, shape (n_signals,)
    guards         rows over z that must not be negative, shape (n_modes, n_guards, n_z)
    holds          what each mode holds, by index; only the modes that hold a velocity
    """

    hybrid: HybridModel
    sample_time_s: float
    steps: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    columns: np.ndarray
    guards: np.ndarray
    holds: Mapping[int, tuple[Hold, ...]]

    def run(self, start: np.ndarray, commands: np.ndarray) -> HybridRun:
        """From ``start``, (n_x,) or (n_x, n_w), under ``commands``, (n_u, n) or (n_u, n, n_w).

        Commands are those behind the dead zone.

        Raises
        ------
        LookupError
            If no mode covers a state and its command, naming the signals.
        """
        single = np.ndim(start) == 1
        x = np.reshape(start, (len(start), -1)).T
        u = np.reshape(commands, (*np.shape(commands)[:2], -1)).transpose(1, 2, 0)
        states, modes = np.empty((len(u), *x.shape)), np.empty((len(u), len(x)), dtype=int)
        for k, now in enumerate(u):
            z = np.column_stack([x, np.broadcast_to(now, (len(x), u.shape[2])), np.ones(len(x))])
            states[k], modes[k] = x, self.active(z)
            later = np.einsum("wij,wj->wi", self.steps[modes[k]], z)
            x = self.jumped(x, self.stopped(x, later))
        states = states.transpose(2, 0, 1)
        return HybridRun(states[..., 0], modes[:, 0]) if single else HybridRun(states, modes)

    def active(self, z: np.ndarray) -> np.ndarray:
        """Index of the mode for each row (x, u, 1), shape (n_w,).

        Where a guard lets go the signal counts as just outside of its holding interval.
        """
        signals = z[:, self.columns]
        found = self._boxed(z, signals)
        k = -1
        while (ahead := found[(found > k) & self._holding[found]]).size:
            k = ahead.min()
            here = np.flatnonzero(found == k)
            gone = np.zeros(len(here), dtype=bool)
            for hold in self.holds[k]:
                side = hold.side(z[here])
                column = np.flatnonzero(self.columns == hold.column)
                outside = np.where(side > 0, hold.above, hold.below)[side != 0]
                signals[here[side != 0], column] = outside
                gone |= side != 0
            if gone.any():
                free = here[gone]
                found[free] = self._boxed(z[free], signals[free])
        return found

    def _boxed(self, z: np.ndarray, signals: np.ndarray) -> np.ndarray:
        """The first mode whose box is around each row of signals and whose guards hold."""
        inside = (self.lower <= signals[:, None]) & (signals[:, None] < self.upper)
        guarded = np.einsum("mgz,wz->wmg", self.guards, z) >= 0.0
        covered = inside.all(axis=2) & guarded.all(axis=2)
        if not covered.any(axis=1).all():
            lost = signals[np.argmin(covered.any(axis=1))]
            names = (*self.hybrid.model.states, *self.hybrid.model.commands)
            told = {names[c]: float(value) for c, value in zip(self.columns, lost, strict=True)}
            raise LookupError(f"no mode of {self.hybrid.model.plant.name} covers {told}")
        return covered.argmax(axis=1)

    def stopped(self, x: np.ndarray, later: np.ndarray) -> np.ndarray:
        """Later states, (n_w, n_x), inside of a holding interval that a step would jump across."""
        for column, below, above, inside in self._intervals:
            fell = (x[:, column] >= above) & (later[:, column] <= below)
            rose = (x[:, column] <= below) & (later[:, column] >= above)
            later[fell | rose, column] = inside
        return later

    def jumped(self, x: np.ndarray, later: np.ndarray) -> np.ndarray:
        """Later states, (n_w, n_x), after what jumps where a signal rises to its value."""
        model = self.hybrid.model
        for jump in self.hybrid.jumps:
            signal, state = model.states.index(jump.signal), model.states.index(jump.state)
            met = (x[:, signal] < jump.at) & (later[:, signal] >= jump.at)
            later[met, state] *= jump.ratio
        return later

    @cached_property
    def _holding(self) -> np.ndarray:
        """Which modes hold something that may let go, shape (n_modes,)."""
        return np.isin(np.arange(len(self.hybrid.modes)), [*self.holds])

    @cached_property
    def _intervals(self) -> set[tuple[int, float, float, float]]:
        return {hold.interval for holds in self.holds.values() for hold in holds}


def sampled_hybrid(hybrid: HybridModel, sample_time_s: float) -> SampledHybrid:
    """The modes at samples, with the boxes and guards by which they switch.

    Raises
    ------
    UnknownNameError
        If a cut or guarded signal is neither a state nor a command of the design model.
    """
    names = (*hybrid.model.states, *hybrid.model.commands)
    signals = tuple(dict.fromkeys(name for mode in hybrid.modes for name in mode.box))
    guarded = [name for mode in hybrid.modes for guard in mode.guards for name in guard.weights]
    require((*signals, *guarded), names, hybrid.model.plant.name)
    boxes = np.array([[ends(mode.box.get(name)) for name in signals] for mode in hybrid.modes])
    boxes = boxes.reshape(len(hybrid.modes), len(signals), 2)
    holds = ((k, holds_of(hybrid, mode)) for k, mode in enumerate(hybrid.modes))
    return SampledHybrid(
        hybrid=hybrid,
        sample_time_s=sample_time_s,
        steps=np.array([whole_step(hybrid, mode, sample_time_s) for mode in hybrid.modes]),
        lower=boxes[:, :, 0],
        upper=boxes[:, :, 1],
        columns=np.array([names.index(name) for name in signals], dtype=int),
        guards=_guards(hybrid.modes, names),
        holds={k: held for k, held in holds if held},
    )


def ends(region: Region | None) -> tuple[float, float]:
    """Lower and upper end of a region of a signal; no ends where it is not cut."""
    if region is None:
        return -np.inf, np.inf
    if isinstance(region, Level):
        return region.point - SAME_LEVEL, region.point + SAME_LEVEL
    return region.lower, region.upper


def _guards(modes: Sequence[Mode], names: tuple[str, ...]) -> np.ndarray:
    """Guards as rows over z; rows of zeros, which always hold, where a mode has fewer."""
    rows = np.zeros((len(modes), max(len(mode.guards) for mode in modes), len(names) + 1))
    for row, mode in zip(rows, modes, strict=True):
        for place, guard in zip(row, mode.guards, strict=False):
            place[[names.index(name) for name in guard.weights]] = [*guard.weights.values()]
            place[-1] = guard.offset
    return rows


def whole_step(hybrid: HybridModel, mode: Mode, sample_time_s: float) -> np.ndarray:
    """[F G offset] over all states and commands, shape (n_x, n_x + n_u + 1).

    What the mode holds stays, its rates are zero.
    """
    step, model = sampled(mode, sample_time_s), hybrid.model
    names = (*model.states, *model.commands)
    kept = [names.index(name) for name in mode.state_names]
    driven = [names.index(name) for name in mode.command_names]
    rows = np.eye(len(model.states), len(names) + 1)
    rows[kept] = 0.0
    columns = [*kept, *driven, len(names)]
    rows[np.ix_(kept, columns)] = np.column_stack([step.F, step.G, step.offset])
    rows[[names.index(name) for name in resting_states(hybrid, mode)]] = 0.0
    return rows
