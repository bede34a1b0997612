"""How much of what a recording does the rig's plant explains, on a few of its liveliest windows.

Each window starts from the states that its sensors show, and nothing is fitted.  For every output

    unexplained = sqrt(sum of squared errors / sum of squares about the window's mean)

is 0 for a perfect plant, about 1 for one that says no more than the mean of each window, and
beyond for one that contradicts the recording.  Unlike fit percent over a whole recording it does
not profit from what a free start tells of a slow signal.  A plant without states has no start to
profit from: there the mean is that of all windows.

Source: coefficient of determination, 1 - unexplained^2; windows as in diagnosis.md 1.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.fitting.error_model import ACTIVE
from workbench.fitting.errors import in_units
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.holes import long_holes
from workbench.fitting.noise import NoNoiseError, measured_noise
from workbench.fitting.starts import sensed_states
from workbench.fitting.window_cuts import (
    begun_s,
    cut_rows,
    received_windows,
    variances,
    window_firsts,
)
from workbench.fitting.window_length import window_length_s
from workbench.fitting.window_runs import WindowRuns
from workbench.fitting.windows import Windows
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import inputs

MOST_PROBED = 16  # windows
LEAST_SAMPLES = 20  # of a window
ABSURD = 50.0  # typical sizes of a state: a start beyond takes for ever and explains nothing
WORST = 1e3  # of what is unexplained; more, or no number at all, says no more


@dataclass(frozen=True)
class Probe:
    """Where a recording is looked at: first samples of windows of ``length`` samples."""

    firsts: tuple[int, ...]
    length: int


def probe(plant: Plant, recording: Recording) -> Probe | None:
    """The liveliest windows; None where none is long enough."""
    length_s = window_length_s(plant, [recording])
    length = max(round(length_s / recording.sample_time_s), LEAST_SAMPLES)
    blind = long_holes(plant, recording)
    firsts = tuple(k for k in window_firsts(recording, length) if not blind[k : k + length].any())
    if not firsts:
        return None
    spread = np.sqrt(variances(cut_rows(recording.rows(plant.measured), firsts, length)))
    lively = (spread / np.maximum(spread.max(axis=1, keepdims=True), 1e-300)).sum(axis=0)
    chosen = np.sort(np.argsort(-lively, kind="stable")[:MOST_PROBED])
    return Probe(tuple(firsts[k] for k in chosen), length)


def moving(plant: Plant, recording: Recording, where: Probe) -> np.ndarray:
    """Which outputs move in the windows beyond their noise, (n_y,)."""
    cut = cut_rows(recording.rows(plant.measured), where.firsts, where.length)
    size = np.sqrt(variances(cut).mean(axis=1))
    return size > ACTIVE * np.array([shown_noise(recording, name) for name in plant.measured])


def unexplained(plant: Plant, readings: Sequence[Recording], where: Probe) -> np.ndarray:
    """What the plant leaves unexplained of each output in each reading, (n_readings, n_y).

    ``readings`` are the same recording read in several ways.
    """
    y = _simulated(plant, readings, where)
    measured = [
        cut_rows(each.rows(plant.measured), where.firsts, where.length) for each in readings
    ]
    pairs = zip(np.split(y, len(readings), axis=1), measured, strict=True)
    return np.array([_ratio(one - other, other, not plant.state_list) for one, other in pairs])


def predicted_motion(plant: Plant, recording: Recording, where: Probe) -> np.ndarray:
    """Standard deviation of each output in each window as the plant has it, (n_y, n_windows)."""
    return _simulated(plant, [recording], where).std(axis=2)


def _simulated(plant: Plant, readings: Sequence[Recording], where: Probe) -> np.ndarray:
    """Outputs from the states that the sensors show, (n_y, n_readings * n_windows, length)."""
    dt, length, firsts = readings[0].sample_time_s, where.length, where.firsts
    starts, fed = [], []
    for each in readings:
        nowhere = np.zeros(len(each), dtype=bool)
        starts.append(sensed_states(plant, each, nowhere)[0][:, list(firsts)])
        fed.append([cut_rows(rows, firsts, length) for rows in inputs(plant, each)])
    u, d = (np.concatenate([each[k] for each in fed], axis=1) for k in (0, 1))
    u, d = (v.reshape(len(v), v.shape[1] * length) for v in (u, d))
    x0, count = np.hstack(starts), len(readings) * len(firsts)
    absurd = (np.abs(x0) > ABSURD * (plant.scale + np.abs(plant.initial))[:, None]).any(axis=0)
    x0 = np.where(absurd, plant.initial[:, None], x0)
    p = np.tile(plant.nominal[2][:, None], count)
    runs = WindowRuns(plant.model, dt, length)
    y = runs.outputs(x0, u, d, p)
    sent = y.reshape(len(plant.measured), count, length)
    sent[:, absurd] = np.nan
    return received_windows(plant, sent, begun_s(readings, (firsts,) * len(readings)), dt)


def left_unexplained(fit: Fit) -> dict[str, float]:
    """The same for the windows of a fit, by full name of the outputs that move."""
    windows = fit.windows
    error = in_units(fit)
    stateless = not windows.plant.state_list
    moves = _motion(windows, stateless) > ACTIVE * windows.noise
    found = _ratio(error, windows.measured, stateless)
    return {n: float(x) for n, x, m in zip(windows.plant.measured, found, moves, strict=True) if m}


def _motion(windows: Windows, stateless: bool) -> np.ndarray:
    """Standard deviation of each output beyond noise, about the same means as the ratio, (n_y,)."""
    if not stateless:
        some = np.maximum(np.isfinite(windows.measured).any(axis=2).sum(axis=1), 1)
        return np.sqrt(np.sum(windows.activity**2, axis=1) / some)
    seen = np.maximum(np.isfinite(windows.measured).sum(axis=(1, 2)), 1)
    variance = _spread(windows.measured, stateless) / seen
    return np.sqrt(np.maximum(variance - windows.noise**2, 0.0))


def _spread(measured: np.ndarray, stateless: bool) -> np.ndarray:
    """Sum of squares about the mean, of each window or of all, (n_y,)."""
    axes = (1, 2) if stateless else (2,)
    seen = np.isfinite(measured).sum(axis=axes, keepdims=True)
    about = np.nansum(measured, axis=axes, keepdims=True) / np.maximum(seen, 1)
    return np.nansum((measured - about) ** 2, axis=(1, 2))


def _ratio(error: np.ndarray, measured: np.ndarray, stateless: bool) -> np.ndarray:
    """Root of squared errors over squares about the mean, (n_y,); arrays (n_y, n_windows, L)."""
    seen, spread = np.isfinite(measured), _spread(measured, stateless)
    lost = (seen & ~np.isfinite(error)).any(axis=(1, 2))
    with np.errstate(over="ignore", invalid="ignore"):
        squares = np.sum(np.where(seen, error, 0.0) ** 2, axis=(1, 2))
        found = np.sqrt(squares / np.maximum(spread, 1e-300))
    return np.where(lost, WORST, np.minimum(found, WORST))


def shown_noise(recording: Recording, channel: str) -> float:
    """Noise of a channel, 0 where it shows none."""
    try:
        return measured_noise([recording], [channel])[channel]
    except NoNoiseError:
        return 0.0
