"""What a rig was doing at each sample of a recording: valve side, direction, rest, ends, reversal.

Regimes overlap: a sample may be "at rest" and "valve closed" at once.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from workbench.effects.forces import EndStops
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.starts import bridged, guessed_states, slope
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import inputs
from workbench.units import display_unit

RESTING_M_S = 5e-3
NEAR_SHARE = 0.1  # of the stroke at each end
REVERSAL_S = 0.05  # on either side of a change of direction
OPEN_SHARE = 1e-3  # of the range of a command, behind the dead zone


def regimes(
    plant: Plant, recording: Recording, states: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """Which samples belong to each regime, shape (n,) each; only those that the channels show.

    The valve side is that of the command as the valve gets it, behind offset and dead zone;
    ``states`` (n_x, n) are guessed from the recording if not given.
    """
    found: dict[str, np.ndarray] = {}
    for signal, command in _commands(plant, recording, states).items():
        member = signal.rpartition(".")[0]
        closed, size = _closed(plant, signal)
        away = command - closed
        found[f"{member} closed"] = np.abs(away) <= size
        centre = f"{closed:.4g} {display_unit(signal)}".strip()
        found[f"{member} open above {centre}"] = away > size
        found[f"{member} open below {centre}"] = away < -size
    place = _position(plant, recording)
    if place is not None:
        found |= _motion(plant, recording, place)
    return {name: samples for name, samples in found.items() if samples.any()}


def shares(chosen: Mapping[str, np.ndarray], squared: np.ndarray) -> dict[str, float]:
    """Share of the squared error (n,) that falls into each regime, largest first.

    Samples without an error are NaN and count for nothing.
    """
    total = float(np.nansum(squared))
    found = {
        name: float(np.nansum(squared[samples])) / total if total > 0 else 0.0
        for name, samples in chosen.items()
    }
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def regime_shares(fit: Fit) -> dict[str, float]:
    """Share of the weighted squared error of a fit by regime, over all its recordings."""
    windows, plant = fit.windows, fit.plant.lean()
    squares = (fit.residual**2).sum(axis=0)
    sums: dict[str, float] = {}
    done = 0
    for recording, firsts in zip(windows.recordings, windows.firsts, strict=True):
        squared = np.full(len(recording), np.nan)
        for k, first in enumerate(firsts, start=done):
            squared[first : first + windows.length] = squares[k]
        done += len(firsts)
        for name, samples in regimes(plant, recording).items():
            sums[name] = sums.get(name, 0.0) + float(np.nansum(squared[samples]))
    total = float(squares.sum())
    found = {name: part / total if total > 0 else 0.0 for name, part in sums.items()}
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _commands(
    plant: Plant, recording: Recording, states: np.ndarray | None
) -> dict[str, np.ndarray]:
    """Each command behind all that alters it, shape (n,)."""
    model = plant.model
    if not model.commands:
        return {}
    u, d = inputs(plant, recording)
    x, p = guessed_states(plant, recording)[0] if states is None else states, plant.nominal[2]
    values = model.quantities(*model.commands).map(len(recording))(x, u, d, p).full()
    return dict(zip(model.commands, values, strict=True))


def _closed(plant: Plant, command: str) -> tuple[float, float]:
    """The value at which a command opens nothing, and how far off is still closed."""
    signal = next(s for s in plant.commands if s.name == command)
    span = signal.upper - signal.lower
    return signal.nominal, OPEN_SHARE * (span if np.isfinite(span) else 1.0)


def _position(plant: Plant, recording: Recording) -> str | None:
    """The recorded position, if there is one."""
    names = (*plant.measured, *(s.name for s in plant.measured_inputs))
    found = [n for n in names if n.endswith("position_m") and n in recording.channels]
    return found[0] if found else None


def _motion(plant: Plant, recording: Recording, place: str) -> dict[str, np.ndarray]:
    position_m = bridged(recording[place], recording.starts)
    velocity_m_s = slope(position_m, recording.sample_time_s, recording.starts)
    moving = np.where(np.abs(velocity_m_s) < RESTING_M_S, 0.0, np.sign(velocity_m_s))
    low_m, high_m = _stroke(plant, position_m)
    near_m = NEAR_SHARE * (high_m - low_m)
    return {
        "at rest": moving == 0.0,
        "moving forward": moving > 0.0,
        "moving backward": moving < 0.0,
        "near the ends": (position_m < low_m + near_m) | (position_m > high_m - near_m),
        "reversal": _reversals(moving, round(REVERSAL_S / recording.sample_time_s)),
    }


def _stroke(plant: Plant, position_m: np.ndarray) -> tuple[float, float]:
    """The stops, or the recorded range where the plant has none."""
    stops = [effect for effect in plant.effects if isinstance(effect, EndStops)]
    if stops:
        return float(stops[0].lower_m), float(stops[0].upper_m)
    return float(np.nanmin(position_m)), float(np.nanmax(position_m))


def _reversals(moving: np.ndarray, around: int) -> np.ndarray:
    """Samples near a change of direction, rests between two directions passed over, shape (n,)."""
    last = np.maximum.accumulate(np.where(moving != 0, np.arange(len(moving)), 0))
    direction = moving[last]
    turns = np.flatnonzero(direction[1:] * direction[:-1] < 0) + 1
    near = np.zeros(len(moving), dtype=bool)
    for turn in turns:
        near[max(turn - around, 0) : turn + around] = True
    return near
