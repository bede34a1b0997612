"""Estimators on data that lack something: holes, slow sensors, outliers, an output that is late.

Each is a simulation with sensor noise of which the estimator gets less, or something wrong; what is
told is how far its outputs are from the truth.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimators.gated import Gated
from estimators.late import Late
from studies.estimator_runs import Followed, follow, rmse

GAP_S, APART_S = 0.05, 0.25  # a hole in all outputs, and from one to the next
SLOW = 5  # samples from one value of a slow output to the next
OFF, SHARE = 50.0, 0.01  # outliers: so many standard deviations off, in this share of the samples
LATE = 3  # samples by which the first output is late
HOLES = "after holes of 50 ms"
SLOWLY = "all but the first every 5th sample"
GATED, UNGATED = "1 % outliers, gate", "1 % outliers, no gate"
LATELY = "the first 3 samples late"


def disturbed(
    estimator: Any,
    commands: np.ndarray,
    seen: np.ndarray,
    truth: np.ndarray,
    noise: np.ndarray,
    sample_time_s: float,
) -> dict[str, np.ndarray]:
    """RMS error of each output, (n_y,), by what the data lack; NaN of what is not estimated.

    Commands (n_u, n), noisy outputs ``seen`` and true ones ``truth`` (n_y, n), ``noise`` (n_y,).
    An estimator that is lost has NaN throughout.
    """
    holes, last = _with_holes(seen, sample_time_s)
    late = seen.copy()
    late[0] = np.concatenate([np.full(LATE, seen[0, 0]), seen[0, :-LATE]])
    first = estimator.plant.measured[0]
    ways = {
        HOLES: (estimator, holes, last),
        SLOWLY: (estimator, _slow(seen), None),
        UNGATED: (estimator, _with_outliers(seen, noise), None),
        GATED: (Gated(inner=estimator), _with_outliers(seen, noise), None),
        LATELY: (Late(inner=estimator, samples={first: LATE}), late, None),
    }
    judged = np.arange(seen.shape[1] // 10, seen.shape[1])
    return {
        what: _errors(told, commands, y, truth, judged if at is None else at)
        for what, (told, y, at) in ways.items()
    }


def _errors(
    estimator: Any, commands: np.ndarray, y: np.ndarray, truth: np.ndarray, at: np.ndarray
) -> np.ndarray:
    measured = estimator.plant.measured
    try:
        found: Followed | None = follow(estimator, commands, y, 0)
    except ArithmeticError:
        found = None
    known: Mapping[str, np.ndarray] = (
        dict(zip(found.names, found.states, strict=True)) if found else {}
    )
    lost = np.full(truth.shape[1], np.nan)
    pairs = zip(measured, truth, strict=True)
    return np.array([rmse((known.get(name, lost) - row)[at]) for name, row in pairs])


def _with_holes(seen: np.ndarray, sample_time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Outputs with stretches in which nothing is received, and the last sample of each."""
    gap, apart = max(round(GAP_S / sample_time_s), 2), max(round(APART_S / sample_time_s), 4)
    hole = (np.arange(seen.shape[1]) % apart) >= apart - gap
    return np.where(hole, np.nan, seen), np.flatnonzero(hole[:-1] & ~hole[1:])


def _slow(seen: np.ndarray) -> np.ndarray:
    """All outputs but the first at every fifth sample only; a single one, too."""
    y, skipped = seen.copy(), np.arange(seen.shape[1]) % SLOW > 0
    y[np.ix_(np.arange(len(y)) >= min(1, len(y) - 1), skipped)] = np.nan
    return y


def _with_outliers(seen: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Some values far off, always the same ones; the first sample is none of them."""
    rng = np.random.default_rng(1)
    wrong = rng.random(seen.shape) < SHARE
    wrong[:, 0] = False
    return seen + OFF * noise[:, None] * np.where(wrong, rng.choice([-1.0, 1.0], seen.shape), 0.0)
