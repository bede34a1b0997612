"""What a plant visits in a manoeuvre, and the windows in which its prediction is judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from linearize.reduction import DesignModel, offset
from workbench.called import result
from workbench.comparison.run import plant_for, simulate
from workbench.effects.forces import EndStops
from workbench.effects.solenoid_valve import SolenoidValve
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.simulation import inputs

HORIZON_S = 0.05
APART_S = 0.02  # between the starts of windows


@dataclass(frozen=True)
class Visited:
    """States and commands of a design model along a manoeuvre of the full plant.

    states        shape (n_x, n)
    commands      behind the dead zone, shape (n_u, n)
    touching      where something touches an end stop, shape (n,)
    free          what the modes are to stand for, shape (n,): all that does not touch, or all
                  where modes hold what stands at a stop
    starts        first sample of each gap-free piece
    """

    sample_time_s: float
    states: np.ndarray
    commands: np.ndarray
    touching: np.ndarray
    free: np.ndarray
    starts: tuple[int, ...]

    @property
    def rows(self) -> np.ndarray:
        """States, then commands, at the samples that count; shape (n_x + n_u, n_free)."""
        return np.vstack([self.states, self.commands])[:, self.free]


@dataclass(frozen=True)
class Windows:
    """Pieces of a manoeuvre side by side, n samples each, the first of which is the start.

    states, commands      shapes (n_x, n, n_w) and (n_u, n, n_w)
    """

    sample_time_s: float
    states: np.ndarray
    commands: np.ndarray


def visited(
    model: DesignModel, plant: Plant, simulated: Recording, at_stops: bool = False
) -> Visited:
    """What ``plant`` visits in its own simulation, which holds all of its states.

    The commands of the design model are read off the plant: a command behind its dead zone, or of a
    solenoid valve the flow through it, which over each sample is the mean of those at its ends, and
    at the last one of a piece that at its beginning.
    ``at_stops`` counts what is at an end stop too, for modes that hold it there.

    Raises
    ------
    UnknownNameError
        If a state or a command of the plant is not among the channels.
    """
    full = plant.model
    x, (u, d), n = simulated.rows(full.states), inputs(plant, simulated), len(simulated)
    p = np.tile(plant.nominal[2][:, None], n)
    behind = result(_commands(model, plant).map(n), x, u, d, p)
    flows = [name.endswith(".flow_kg_s") for name in model.commands]
    goes_on = np.append(~np.isin(np.arange(1, n), simulated.starts), False)
    passed = behind[flows]
    behind[flows] = np.where(goes_on, 0.5 * (np.roll(passed, -1, axis=1) + passed), passed)
    touching = _at_stops(model, plant, simulated)
    free = np.full(n, True) if at_stops else ~touching
    states = simulated.rows(model.states)
    return Visited(simulated.sample_time_s, states, behind, touching, free, simulated.starts)


def recorded_visits(
    rig: Rig,
    model: DesignModel,
    recording: Recording,
    at_stops: bool = False,
    per_sample: int = 1,
) -> Visited:
    """What a rig's plant visits under a recording's inputs, so many times as finely sampled.

    Inputs are held between samples, as they were when they were recorded.

    Raises
    ------
    InputError
        If a command or measured input is missing.
    ArithmeticError
        If the solution is not finite.
    """
    finer = replace(
        recording,
        sample_time_s=recording.sample_time_s / per_sample,
        channels={name: np.repeat(row, per_sample) for name, row in recording.channels.items()},
        starts=tuple(start * per_sample for start in recording.starts),
    )
    plant = plant_for(rig, finer).lean()
    return visited(model, plant, simulate(rig, finer), at_stops)


def joined(parts: Sequence[Visited]) -> Visited:
    """Several manoeuvres of one sample time, one after the other, with a gap between them."""
    first, offsets = parts[0], np.cumsum([0, *(part.states.shape[1] for part in parts)])
    starts = (offset + k for part, offset in zip(parts, offsets, strict=False) for k in part.starts)
    rows = {
        name: np.concatenate([getattr(part, name) for part in parts], axis=-1)
        for name in ("states", "commands", "touching", "free")
    }
    return replace(first, **rows, starts=tuple(map(int, starts)))


def _commands(model: DesignModel, plant: Plant) -> ca.Function:
    """(x, u, d, p) of the plant -> commands of the design model, shape (n_u, 1).

    The offset of a valve is part of the design model, so it is added again.
    """
    now, read = plant.model.conditions, []
    valves = {f"{e.name}.flow_kg_s": e for e in plant.effects if isinstance(e, SolenoidValve)}
    for name in model.commands:
        if name in valves:
            read.append(plant.model.flows[valves[name].name, "MassFlow", valves[name].chamber])
        else:
            read.append(now.read(name) + offset(model.plant, name))
    return ca.Function("commands", [*plant.model.symbols], [ca.vertcat(*read)])


def _at_stops(model: DesignModel, plant: Plant, simulated: Recording) -> np.ndarray:
    """Where something that moves in the design model touches an end stop, shape (n,)."""
    touching = np.zeros(len(simulated), dtype=bool)
    for stop in plant.effects:
        name = f"{stop.body}.position_m" if isinstance(stop, EndStops) else ""
        if name in model.states:
            at = simulated[name]
            touching |= (at <= float(stop.lower_m)) | (at >= float(stop.upper_m))
    return touching


def windows(seen: Visited, horizon_s: float = HORIZON_S, apart_s: float = APART_S) -> Windows:
    """Windows of samples that all count, none across a gap.

    Raises
    ------
    ValueError
        If there is none, or if samples are further apart than the horizon is long.
    """
    if round(horizon_s / seen.sample_time_s) < 1:
        raise ValueError(
            f"no window of {horizon_s:g} s: samples are {seen.sample_time_s:g} s apart"
        )
    n, apart = round(horizon_s / seen.sample_time_s) + 1, round(apart_s / seen.sample_time_s)
    ends = (*seen.starts[1:], seen.states.shape[1])
    firsts = [
        first
        for start, end in zip(seen.starts, ends, strict=True)
        for first in range(start, end - n + 1, max(apart, 1))
        if seen.free[first : first + n].all()
    ]
    if not firsts:
        raise ValueError(f"no window of {horizon_s:g} s in free motion; the manoeuvre is too short")
    samples = np.arange(n)[:, None] + np.array(firsts)
    return Windows(seen.sample_time_s, seen.states[:, samples], seen.commands[:, samples])
