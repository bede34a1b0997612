"""Running a plant on recorded commands."""

from __future__ import annotations

import numpy as np

from workbench.called import result
from workbench.plant import Plant
from workbench.recording import Recording

AT_ONCE = 5000  # samples of one call; more run no faster and take memory


def inputs(plant: Plant, recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Commands and measured inputs as the plant gets them, shapes (n_u, n) and (n_d, n).

    Causes in time (delay, pause) act here, on the sampled sequences.
    """
    dt = recording.sample_time_s

    def prepared(channel: str) -> np.ndarray:
        values = recording[channel]
        for member in plant.members:
            values = member.resample(channel, values, dt)
        return values

    groups = (plant.commands, plant.measured_inputs)
    u, d = ([prepared(signal.name) for signal in group] for group in groups)
    n = len(recording)
    return np.reshape(u, (len(u), n)), np.reshape(d, (len(d), n))


def received(plant: Plant, outputs: np.ndarray, sample_time_s: float) -> np.ndarray:
    """Outputs as the computer gets them through the causes in time, shape (n_y, n)."""
    rows = list(outputs)
    for member in plant.members:
        rows = [
            member.resample(name, row, sample_time_s)
            for name, row in zip(plant.measured, rows, strict=True)
        ]
    return np.reshape(rows, outputs.shape)


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
    y = received(plant, _outputs(plant, x, u, d, p), dt)
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
