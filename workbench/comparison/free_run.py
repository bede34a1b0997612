"""Errors of free runs: from the first sample of each piece to its end, nothing fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from workbench.comparison.compare import signal_error
from workbench.fitting.errors import SignalError
from workbench.fitting.starts import guessed_states
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.simulation import simulate
from workbench.units import public_name


def free_run_errors(
    rig: Rig, sets: Mapping[str, Sequence[Recording]], noise: Mapping[str, float]
) -> dict[str, dict[str, SignalError]]:
    """Errors of each set of recordings by public output name; empty for a plant without states.

    ``noise`` goes by full output name.  A run that does not stay finite has the error NaN.
    """
    if not rig.plant.state_list:
        return {}
    return {
        label: {
            public_name(name): _error(rows, noise.get(name, float("nan")))
            for name, rows in _runs(rig, recordings).items()
        }
        for label, recordings in sets.items()
    }


def _runs(rig: Rig, recordings: Sequence[Recording]) -> dict[str, list[np.ndarray]]:
    """Recorded and simulated values, each (2, n), of every piece by full output name."""
    found: dict[str, list[np.ndarray]] = {}
    leans: dict[int, Plant] = {}
    for recording in recordings:
        fitting = rig.fit_for(recording)
        plant = leans.setdefault(id(fitting), fitting.lean())
        for piece in recording.pieces:
            for name, row in _simulated(plant, piece).items():
                found.setdefault(name, []).append(np.stack([piece[name], row]))
    return found


def _simulated(plant: Plant, piece: Recording) -> dict[str, np.ndarray]:
    try:
        run = simulate(plant, piece, guessed_states(plant, piece)[0, :, 0])
    except ArithmeticError:
        return {name: np.full(len(piece), np.nan) for name in plant.measured}
    return {name: run[name] for name in plant.measured}


def _error(rows: list[np.ndarray], noise: float) -> SignalError:
    measured, simulated = np.hstack(rows)
    if np.isnan(simulated).any():
        return SignalError(np.nan, np.nan, noise, int(np.isfinite(measured).sum()))
    return signal_error(measured, simulated, noise)
