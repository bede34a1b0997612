"""How likely recordings are at several settings of a filter, all side by side.

A setting is one intensity of the unknown inputs or of the process noise; the runs share the
recording and go through it in blocks, on several threads.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

import casadi as ca
import numpy as np

from workbench.called import result
from workbench.filter_passes import BLOCK, blocks, covariances, posed
from workbench.plant_filter import PlantFilter
from workbench.recording import Recording


def log_likelihoods(found: PlantFilter, recording: Recording, factors: np.ndarray) -> np.ndarray:
    """Log-likelihood of a recording at several intensities of the unknown inputs, side by side.

    ``factors`` (n_w, n) multiply the intensities of ``found``; 0 switches an input off.  Returns
    shape (n,), not finite where a run was lost.
    """
    pairs = zip(*(covariances(found, column) for column in factors.T), strict=True)
    return _likelihoods(found, recording, *map(np.array, pairs))


def log_likelihoods_of_noise(
    found: PlantFilter, recording: Recording, noises: np.ndarray
) -> np.ndarray:
    """The same for several process noises, (n, n_x): what states gain per square root of a second.

    Unknown inputs keep their intensity.
    """
    relative = np.pad(noises / found.plant.scale, ((0, 0), (0, len(found.unknown_inputs))))
    step_s = found.sample_time_s * found.decimate
    walks = np.diag([*np.zeros(len(found.plant.scale)), *np.ones(len(found.unknown_inputs))])
    Q = step_s * walks + step_s * relative[:, :, None] ** 2 * np.eye(len(found.scale))
    return _likelihoods(found, recording, np.tile(found.start_covariance, (len(Q), 1, 1)), Q)


def _likelihoods(
    found: PlantFilter, recording: Recording, starts: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Log-likelihood for each pair of start and step covariance, (n, n_X, n_X) both; (n,)."""
    n = len(starts)
    P, Q = (each.reshape(n, -1).T for each in (starts, steps))
    total = np.zeros((1, n))
    block, one = found.likelihood.fold(BLOCK), found.likelihood
    threads = min(n, os.cpu_count() or 1)
    runs, last = (block.map(n, "thread", threads), block), (one.map(n), one)
    for piece in recording.pieces:
        start, columns = posed(found, piece)
        now = np.vstack([np.tile(start[:, None], n), P, Q, total])
        whole = columns[-1].shape[1] // BLOCK * BLOCK
        for part in blocks(columns, slice(0, whole), BLOCK):
            now = _side_by_side(*runs, now, part)
        for part in blocks(columns, slice(whole, columns[-1].shape[1]), 1):
            now = _side_by_side(*last, now, part)
        total = now[-1:]
    return total.ravel()


def _side_by_side(
    runs: ca.Function, one: ca.Function, now: np.ndarray, part: Sequence[np.ndarray]
) -> np.ndarray:
    """All runs after a part of the recording, (n_state, n); a lost one is NaN from there on.

    The filter of a run that leaves all bounds fails in its linear equations, and with it the call
    for all: then each goes on alone.  A lost run computes with the numbers of another.
    """
    lost = ~np.isfinite(now).all(axis=0)
    if lost.all():
        return now
    going = np.where(lost, now[:, [int(np.argmin(lost))]], now)
    try:
        after = result(runs, going, *(np.tile(each, now.shape[1]) for each in part))
    except RuntimeError:
        after = np.column_stack([_alone(one, column, part) for column in going.T])
    return np.where(lost, np.nan, after)


def _alone(one: ca.Function, now: np.ndarray, part: Sequence[np.ndarray]) -> np.ndarray:
    """One run after a part of the recording; NaN where it is lost."""
    try:
        return result(one, now, *part)[:, 0]
    except RuntimeError:
        return np.full(len(now), np.nan)
