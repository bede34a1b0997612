"""What a mode can do: poles, damping, controllability, observability, error against the plant."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from linearize.discrete import sampled
from linearize.modes import HybridModel, Mode
from linearize.reduction import DesignModel

RANK_TOLERANCE = 1e-6


@dataclass(frozen=True)
class ModeReport:
    """One mode as one row of a table.

    poles              eigenvalues of A, 1/s, shape (n_x,)
    frequency_hz       of the fastest oscillating pair, 0 without one
    damping            of that pair, 1 without one
    controllability    singular values of the scaled controllability matrix over the largest
    observability      likewise of the scaled observability matrix
    controllable, observable    ranks, with 1e-6 of the largest singular value as zero
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
        controllable=int((reach > RANK_TOLERANCE).sum()),
        observable=int((see > RANK_TOLERANCE).sum()),
        drift=float(np.abs(mode.drift / mode.scale).max(initial=0.0)),
    )


def analyse_all(hybrid: HybridModel) -> tuple[ModeReport, ...]:
    """One report per mode."""
    return tuple(analyse(mode) for mode in hybrid.modes)


def _krylov_values(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Singular values of [B, AB, ...] over the largest; zeros where B vanishes."""
    size, entering = max(np.linalg.norm(A, 2), 1e-12), np.linalg.norm(B, axis=0)
    block = B[:, entering > 0] / entering[entering > 0]
    if not block.size:
        return np.zeros(len(A))
    blocks = [block]
    for _ in range(len(A) - 1):
        blocks.append(A @ blocks[-1] / size)
    values = np.linalg.svd(np.hstack(blocks), compute_uv=False)[: len(A)]
    return values / values[0]


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
    plant is the full one behind the dead zone, gas masses included and friction without bristle.
    """
    plant, step = model.plant, model.plant.model.step(sample_time_s)
    command = mode.command + np.array([*command_change])
    point = dict(zip(mode.state_names, mode.state, strict=True))
    kept = [point.get(n, v) for n, v in zip(model.states, model.initial, strict=True)]
    x, small = model.full(kept), sampled(mode, sample_time_s)
    _, d, p = plant.nominal
    rows = [plant.model.states.index(name) for name in mode.state_names]
    linear, worst = mode.state.copy(), np.zeros(len(rows))
    for _ in range(round(horizon_s / sample_time_s)):
        x = step(x, command, d, p)
        linear = small.F @ linear + small.G @ command + small.offset
        worst = np.maximum(worst, np.abs(x.full().ravel()[rows] - linear))
    return worst
