"""Running a plant on recorded commands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.called import result
from workbench.effects.timing import delay_s
from workbench.plant import Plant
from workbench.recording import Recording

AT_ONCE = 5000  # samples of one call; more run no faster and take memory


def inputs(plant: Plant, recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Commands and measured inputs as the plant gets them, shapes (n_u, n) and (n_d, n).

    Causes in time (delay, pause) act here, on the sampled sequences, in each piece by itself.
    """
    dt, starts = recording.sample_time_s, recording.starts
    groups = (plant.commands, plant.measured_inputs)
    u, d = (
        [_arrived(plant, signal.name, recording[signal.name], dt, starts) for signal in group]
        for group in groups
    )
    n = len(recording)
    return np.reshape(u, (len(u), n)), np.reshape(d, (len(d), n))


def received(
    plant: Plant, outputs: np.ndarray, sample_time_s: float, starts: Sequence[int] = (0,)
) -> np.ndarray:
    """Outputs as the computer gets them through the causes in time, shape (n_y, n).

    ``starts`` are the first samples of pieces: nothing arrives in one that was sent in another.
    """
    rows = [
        _arrived(plant, name, row, sample_time_s, starts)
        for name, row in zip(plant.measured, outputs, strict=True)
    ]
    return np.reshape(rows, outputs.shape)


def _arrived(
    plant: Plant, channel: str, sent: np.ndarray, dt: float, starts: Sequence[int]
) -> np.ndarray:
    """A signal (n,) behind the plant's causes in time; time runs from the start of each piece."""
    pieces = np.split(sent, starts[1:])
    for member in plant.members:
        pieces = [member.resample(channel, piece, dt) for piece in pieces]
    return np.concatenate(pieces)


def arriving_at_rest(plant: Plant) -> dict[str, float]:
    """Each command as it arrives, behind all that alters it, where its valve is at its centre.

    That of the valve itself where it has one, whatever offset has been fitted before it; else what
    arrives of the command at which the plant rests.
    """
    names = [signal.name for signal in plant.commands]
    found = plant.model.quantities(*names)(plant.initial, *plant.nominal).full().ravel()
    members = {member.name: member for member in plant.members}
    valves = (members.get(name.rpartition(".")[0]) for name in names)
    centres = (getattr(valve, "centre_v", rest) for valve, rest in zip(valves, found, strict=True))
    return {name: float(centre) for name, centre in zip(names, centres, strict=True)}


def command_delay_s(plant: Plant) -> float:
    """How long a command is under way to the plant, the longest of several."""
    return delay_s(plant.effects, (signal.name for signal in plant.commands))


def output_delay_s(plant: Plant) -> float:
    """How long an output is under way to the computer, the longest of several."""
    return delay_s(plant.effects, plant.measured)


def simulate(plant: Plant, recording: Recording, initial: np.ndarray | None = None) -> Recording:
    """The plant's states and outputs under recorded inputs, held between samples.

    ``recording`` holds the commands and measured inputs; ``initial`` is the state at the first
    sample, shape (n_x,), the plant's own initial state by default.  Pieces restart from it.

    Raises
    ------
    ArithmeticError
        If the solution is not finite, naming the first bad time.
    """
    model, dt = plant.model, recording.sample_time_s
    x0 = plant.initial if initial is None else np.asarray(initial, dtype=float)
    u, d = inputs(plant, recording)
    p = plant.nominal[2]
    ends = (*recording.starts[1:], len(recording))
    x = np.hstack(
        [
            _run(plant, x0, u[:, first:last], d[:, first:last], p, dt)
            for first, last in zip(recording.starts, ends, strict=True)
        ]
    )
    y = received(plant, _outputs(plant, x, u, d, p), dt, recording.starts)
    bad = ~np.isfinite(y).all(axis=0)
    if bad.any():
        raise ArithmeticError(
            f"{plant.name}: the simulation is not finite from {dt * bad.argmax():.4g} s on"
        )
    names = (*model.commands, *model.measured_inputs, *model.states, *model.measured)
    rows = np.vstack([recording.rows((*model.commands, *model.measured_inputs)), x, y])
    channels = dict(zip(names, rows, strict=True))
    return Recording(recording.name, dt, channels, starts=recording.starts, source="simulation")


def _run(
    plant: Plant, x0: np.ndarray, u: np.ndarray, d: np.ndarray, p: np.ndarray, dt: float
) -> np.ndarray:
    """States at every sample of one piece, shape (n_x, n)."""
    n = max(u.shape[1], d.shape[1])
    if not len(x0):
        return np.zeros((0, n))
    if n < 2:
        return x0[:, None]
    rows = [np.reshape(x0, (-1, 1))]
    for part in _parts(n - 1):
        several = plant.model.run(dt, part.stop - part.start)
        rows.append(result(several, rows[-1][:, -1], u[:, part], d[:, part], p))
    return np.hstack(rows)


def _outputs(
    plant: Plant, x: np.ndarray, u: np.ndarray, d: np.ndarray, p: np.ndarray
) -> np.ndarray:
    """Outputs at every sample, shape (n_y, n)."""
    h, n = plant.model.h, max(u.shape[1], d.shape[1])
    several = ((h.map(s.stop - s.start), s) for s in _parts(n))
    return np.hstack(
        [
            result(give, x[:, s], u[:, s], d[:, s], np.tile(p[:, None], s.stop - s.start))
            for give, s in several
        ]
    )


def _parts(n: int) -> list[slice]:
    """Samples 0 to n in parts: CasADi copies all parameters for every sample of a call."""
    return [slice(first, min(first + AT_ONCE, n)) for first in range(0, n, AT_ONCE)]
