"""What a mode can do: poles, damping, controllability, observability, error against the plant.

Source: Kalman's rank conditions, Kailath 1980, "Linear Systems", Ch. 2; physics.md 4.2 for what
they say of the gearbox, where position alone is not enough at rest.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from linearize.discrete import sampled
from linearize.modes import HybridModel, Mode
from linearize.reduction import DesignModel
from workbench.errors import InputError, Message, listed

RANK_TOLERANCE = 1e-6
UNREACHED = 1e-12  # of the largest singular value: what rounding leaves of nothing


@dataclass(frozen=True)
class ModeReport:
    """One mode as one row of a table.

    poles              eigenvalues of A, 1/s, shape (n_x,)
    frequency_hz       of the fastest oscillating pair, 0 without one
    damping            of that pair, 1 without one
    controllability    singular values of the scaled controllability matrix over the largest
    observability      likewise of the scaled observability matrix
    controllable, observable    ranks, with 1e-6 of the largest singular value as zero
    seen_from      rank of observability by each output alone
    drift              largest rate at the point over the scale of its state, 1/s
    """

    name: str
    poles: np.ndarray
    frequency_hz: float
    damping: float
    controllability: np.ndarray
    observability: np.ndarray
    controllable: int
    observable: int
    seen_from: Mapping[str, int]
    drift: float


def analyse(mode: Mode) -> ModeReport:
    """Poles and ranks of one mode.

    The Krylov matrices [B, AB, ...] take A over its own norm, so that their singular values
    compare directions and not units of time.
    """
    A, B, C = mode.scaled
    poles = np.linalg.eigvals(A)
    swinging = poles[np.abs(poles.imag) > 1e-6]
    fastest = swinging[np.argmax(np.abs(swinging))] if len(swinging) else None
    reach = _krylov_values(A, B)
    see = _krylov_values(A.T, C.T)
    return ModeReport(
        name=mode.name,
        poles=poles[np.argsort(-np.abs(poles))],
        frequency_hz=0.0 if fastest is None else float(abs(fastest) / (2 * np.pi)),
        damping=1.0 if fastest is None else float(-fastest.real / abs(fastest)),
        controllability=reach,
        observability=see,
        controllable=_rank(reach),
        observable=_rank(see),
        seen_from={
            name: _rank(_krylov_values(A.T, row[:, None]))
            for name, row in zip(mode.output_names, C, strict=True)
        },
        drift=float(np.abs(mode.drift / mode.scale).max(initial=0.0)),
    )


def _rank(values: np.ndarray) -> int:
    return int((values > RANK_TOLERANCE).sum())


def analyse_all(hybrid: HybridModel) -> tuple[ModeReport, ...]:
    """One report per mode."""
    return tuple(analyse(mode) for mode in hybrid.modes)


def require_controllable(mode: Mode) -> None:
    """Refuse a mode that the commands cannot steer as a whole, before a design on it.

    Raises
    ------
    InputError
        Naming the states that stay out of reach.
    """
    A, B, _ = mode.scaled
    directions, values = _krylov(A, B)
    missed = directions[:, values <= UNREACHED]
    if missed.shape[1]:
        out = np.linalg.norm(missed, axis=1) > 1e-3
        states = [name for name, beyond in zip(mode.state_names, out, strict=True) if beyond]
        rank = len(A) - missed.shape[1]
        what = f"not controllable: its commands reach {rank} of {len(A)} directions of the state"
        commands = listed(mode.command_names) or "no command"
        expected = f"a mode in which {commands} can steer {listed(states)}"
        raise InputError(Message(what, f"mode '{mode.name}'", expected))


def _krylov_values(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Singular values of [B, AB, ...] over the largest; zeros where B vanishes."""
    return _krylov(A, B)[1]


def _krylov(A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left singular vectors, (n, n), and values over the largest, (n,), of [B, AB, ...]."""
    n, size, entering = len(A), max(np.linalg.norm(A, 2), 1e-12), np.linalg.norm(B, axis=0)
    block = B[:, entering > 0] / entering[entering > 0]
    if not block.size:
        return np.eye(n), np.zeros(n)
    blocks = [block]
    for _ in range(n - 1):
        blocks.append(A @ blocks[-1] / size)
    directions, values, _ = np.linalg.svd(np.hstack(blocks))
    values = np.pad(values, (0, n - len(values)))
    return directions, values / values[0]


def prediction_error(
    model: DesignModel,
    mode: Mode,
    command_change: Iterable[float],
    *,
    horizon_s: float,
    sample_time_s: float = 1e-3,
) -> np.ndarray:
    """Largest error of the mode against the whole plant over a horizon, by state, shape (n_x,).

    Both start at the mode's point and get its command plus ``command_change``, shape (n_u,).  The
    plant is that of the design model with all its states and effects: a servo drive behind the dead
    zone with its gas masses, a gearbox with contact and dry friction under the same flows.
    """
    plant, step = model.plant, model.plant.model.step(sample_time_s)
    command = mode.command + np.array([*command_change])
    sent = mode.sent(model, command)
    held = {**mode.elsewhere, **{name: region.point for name, region in mode.box.items()}}
    point = held | dict(zip(mode.state_names, mode.state, strict=True))
    kept = [point.get(n, v) for n, v in zip(model.states, model.initial, strict=True)]
    x, small = model.full_under(kept, mode.sent(model, mode.command)), sampled(mode, sample_time_s)
    _, d, p = plant.nominal
    rows = [plant.model.states.index(name) for name in mode.state_names]
    linear, worst = mode.state.copy(), np.zeros(len(rows))
    for _ in range(round(horizon_s / sample_time_s)):
        x = step(x, sent, d, p)
        linear = small.F @ linear + small.G @ command + small.offset
        worst = np.maximum(worst, np.abs(x.full().ravel()[rows] - linear))
    return worst
