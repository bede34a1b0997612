"""An estimator over a recording, and what is read off the run: errors, innovations, consistency."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from scipy.stats import chi2

from estimators.foreseen import Foresight
from studies.text import shown
from workbench.called import result
from workbench.contracts import Estimate
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import inputs
from workbench.units import public_name

BAND = 0.95
BEYOND = 1e6  # typical sizes of a state: an estimate that says more is lost
LAGS = 20  # of the autocorrelation of innovations


@dataclass(frozen=True)
class Followed:
    """One run of an estimator over a recording, n samples.

    names             of the states
    states            shape (n_x, n)
    covariances       shape (n, n_x, n_x)
    innovations       measured less foreseen, (n_y, n), NaN where nothing was received or asked
    nis, received     innovation squared over its covariance, and outputs in it, (n,), likewise
    took_s            wall time of each update, (n,)
    notes             by name, (n,), NaN where nothing
    """

    names: tuple[str, ...]
    states: np.ndarray
    covariances: np.ndarray
    innovations: np.ndarray
    nis: np.ndarray
    received: np.ndarray
    took_s: np.ndarray
    notes: Mapping[str, np.ndarray]

    def state(self, name: str) -> np.ndarray:
        """One state, (n,)."""
        return self.states[self.names.index(name)]

    def deviation(self, name: str) -> np.ndarray:
        """Standard deviation of one state, (n,)."""
        k = self.names.index(name)
        return np.sqrt(np.maximum(self.covariances[:, k, k], 0.0))


def follow(estimator: Any, commands: np.ndarray, measured: np.ndarray, every: int = 1) -> Followed:
    """An estimator over commands (n_u, n) and outputs (n_y, n), NaN where not received.

    u[k] acts from sample k to the next.  Innovations are asked for at every so many samples, since
    they cost a second update; 0 asks for none.

    Raises
    ------
    ArithmeticError
        If the estimator is lost, with the sample.
    """
    sight, plant = Foresight(estimator), estimator.plant
    sizes = dict(zip(plant.model.states, plant.scale, strict=True))
    estimate = estimator.start(measured[:, 0])
    sent, rows, told = plant.nominal[0], [], []
    for k in range(measured.shape[1]):
        y = measured[:, k]
        seen = (np.full(len(y), np.nan), np.nan, 0.0)
        if every and k % every == 0 and np.isfinite(y).any():
            seen = _innovation(*sight.outputs(sight.blind(estimate, sent), sent), y)
        begun = perf_counter()
        estimate = _updated(estimator, estimate, sent, y, k, sizes)
        took = perf_counter() - begun
        rows.append((estimate.state, estimate.covariance, took, *seen))
        told.append(estimate.notes)
        sent = commands[:, k]
    return _followed(estimate, rows, told)


def _updated(
    estimator: Any,
    last: Estimate,
    command: np.ndarray,
    y: np.ndarray,
    k: int,
    sizes: Mapping[str, float],
) -> Estimate:
    """The next estimate, unless it says more than so many typical ``sizes`` of a state."""
    try:
        now = estimator.update(last, command, y)
    except RuntimeError as error:  # CasADi's word for a matrix that cannot be factorised
        raise ArithmeticError(f"lost at sample {k}: {str(error)[:60]}") from error
    if not np.isfinite(now.state).all():
        raise ArithmeticError(f"lost at sample {k}: its state is no number")
    for name, value in zip(now.names, now.state, strict=True):
        if abs(value) > BEYOND * sizes.get(name, np.inf):
            what = f"{public_name(name)} is {shown(value, name, 2)}"
            raise ArithmeticError(f"lost at sample {k}: {what}")
    return now


def _innovation(
    expected: np.ndarray, S: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, float, float]:
    there = np.isfinite(y)
    e = (y - expected)[there]
    nis = float(e @ np.linalg.solve(S[np.ix_(there, there)], e))
    return y - expected, nis, float(there.sum())


def _followed(last: Estimate, rows: Sequence[tuple], told: Sequence[Mapping]) -> Followed:
    states, covariances, took, innovations, nis, received = map(np.array, zip(*rows, strict=True))
    keys = dict.fromkeys(key for notes in told for key in notes)
    notes = {key: np.array([each.get(key, np.nan) for each in told]) for key in keys}
    return Followed(last.names, states.T, covariances, innovations.T, nis, received, took, notes)


def fed(plant: Plant, recording: Recording) -> tuple[Plant, np.ndarray, np.ndarray]:
    """The plant with its measured inputs commanded; commands (n_u, n) and outputs (n_y, n)."""
    u, d = inputs(plant, recording)
    return plant.with_inputs_commanded(), np.vstack([u, d]), recording.rows(plant.measured)


def rmse(error: np.ndarray) -> float:
    """Root of the mean square of what is finite; NaN where nothing is."""
    error = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(error**2))) if error.size else np.nan


def nees(found: Followed, truth: Mapping[str, np.ndarray]) -> np.ndarray:
    """Squared error of the named states over their covariance, shape (n,)."""
    places = [found.names.index(name) for name in truth]
    off = found.states[places] - np.array([*truth.values()])
    size = np.sqrt(np.mean(found.covariances[:, places, places], axis=0))
    P = found.covariances[:, places][:, :, places] / np.outer(size, size)
    off = (off / size[:, None]).T
    return np.einsum("ki,ki->k", off, np.linalg.solve(P, off[..., None])[..., 0])


def band(degrees: int, averaged: float) -> tuple[float, float]:
    """Ends of the 95 % band of the mean of so many independent chi-square values.

    Source: Bar-Shalom, Li and Kirubarajan 2001, Sec. 5.4.2.
    """
    tail = (1.0 - BAND) / 2.0
    low, high = chi2.ppf([tail, 1.0 - tail], degrees * averaged) / averaged
    return float(low), float(high)


def whiteness(innovations: np.ndarray) -> np.ndarray:
    """Share of the first lags at which an output's innovations are correlated, shape (n_y,).

    Beyond 1.96 / sqrt(n); about 5 % are, if they are white.  Source: Ljung 1999, Sec. 16.6.
    """
    shares = []
    for row in innovations:
        e = row[np.isfinite(row)]
        e = e - e.mean() if e.size else e
        if len(e) <= 2 * LAGS or not e.any():
            shares.append(np.nan)
            continue
        r = np.array([e[lag:] @ e[:-lag] for lag in range(1, LAGS + 1)]) / (e @ e)
        shares.append(float(np.mean(np.abs(r) > 1.96 / np.sqrt(len(e)))))
    return np.array(shares)


def foretold(
    found: Followed,
    plant: Plant,
    commands: np.ndarray,
    measured: np.ndarray,
    sample_time_s: float,
    horizons: Iterable[int],
    starts: np.ndarray,
) -> dict[int, np.ndarray]:
    """RMS error of each output, (n_y,), so many samples after the estimates at ``starts``.

    The plant runs on from the estimate under the commands; states that the estimator leaves out
    stand at their initial values, gas masses at the initial temperature.
    """
    longest = max(horizons)
    starts = starts[starts + longest < measured.shape[1]]
    if not len(starts):
        return {h: np.full(len(measured), np.nan) for h in horizons}
    x = _whole(found, plant, starts)
    step = plant.model.compiled_step(sample_time_s).map(len(starts))
    seen = plant.model.h.map(len(starts))
    _, d, p = plant.nominal
    d, p = (np.tile(v[:, None], len(starts)) for v in (d, p))
    errors = {}
    for h in range(1, longest + 1):
        u = commands[:, starts + h - 1]
        x = result(step, x, u, d, p)
        if h in set(horizons):
            y = result(seen, x, commands[:, starts + h], d, p)
            errors[h] = np.array([rmse(row) for row in measured[:, starts + h] - y])
    return errors


def _whole(found: Followed, plant: Plant, starts: np.ndarray) -> np.ndarray:
    """Full states of the plant at the starts, (n_x, n_s)."""
    from workbench.filtering import consistent_start

    columns = [
        consistent_start(plant, dict(zip(found.names, found.states[:, k], strict=True)))
        for k in starts
    ]
    x = np.array(columns).T
    for name, row in zip(found.names, found.states[:, starts], strict=True):
        if name in plant.model.states:
            x[plant.model.states.index(name)] = row
    return x
