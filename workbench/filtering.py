"""Kalman filtering and smoothing: functions of matrices, and passes over a recording.

The smoothed unknown input of a :class:`PlantFilter` is what a model lacks in that balance, sample
by sample; the innovations are its one-step errors.  A pass runs without Python in the loop.

Source: Särkkä 2013, "Bayesian filtering and smoothing", algorithms 5.4 and 8.2.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from workbench.plant import Plant
from workbench.plant_filter import PlantFilter
from workbench.recording import Recording
from workbench.simulation import inputs

TEMPERATURE, MASS = "temperature_k", "mass_kg"


def predict(
    state: np.ndarray, covariance: np.ndarray, F: np.ndarray, Q: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """State and covariance one sample later: F x, F P F' + Q."""
    return F @ state, F @ covariance @ F.T + Q


def correct(
    state: np.ndarray,
    covariance: np.ndarray,
    innovation: np.ndarray,
    H: np.ndarray,
    R: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """State and covariance after a measurement; NaN in ``innovation`` (n_y,) was not received.

    K = P H' (H P H' + R)^-1; the covariance in Joseph form, which stays symmetric.
    """
    received = np.isfinite(innovation)
    H, R, innovation = H[received], R[np.ix_(received, received)], innovation[received]
    K = np.linalg.solve(H @ covariance @ H.T + R, H @ covariance).T
    rest = np.eye(len(state)) - K @ H
    return state + K @ innovation, rest @ covariance @ rest.T + K @ R @ K.T


def smoothed(
    states: np.ndarray,
    covariances: np.ndarray,
    F: np.ndarray,
    said: np.ndarray,
    weights: np.ndarray,
    left: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Smoothed states (n, n_x) and covariances (n, n_x, n_x) from the filtered ones.

    The Rauch-Tung-Striebel smoother in the adjoint form of Bryson and Frazier, which inverts no
    covariance: a state without noise, or one that friction holds, does no harm.

    ``F[k]`` leads from sample k to k + 1; ``said`` = H' S^-1 e, ``weights`` = H' S^-1 H and
    ``left`` = I - K H belong to the measurement of sample k.

    Source: Bierman 1973, "Fixed interval smoothing with discrete measurements".
    """
    smooth, P = states.copy(), covariances.copy()
    adjoint, information = np.zeros(states.shape[1]), np.zeros(covariances.shape[1:])
    for k in range(len(states) - 1, -1, -1):
        smooth[k] += covariances[k] @ adjoint
        P[k] -= covariances[k] @ information @ covariances[k]
        if k:
            adjoint = F[k - 1].T @ (said[k] + left[k].T @ adjoint)
            information = F[k - 1].T @ (weights[k] + left[k].T @ information @ left[k]) @ F[k - 1]
    return smooth, P


def consistent_start(plant: Plant, known: Mapping[str, float]) -> np.ndarray:
    """The plant's initial state with the known states set, shape (n_x,).

    Gas masses follow, so that each chamber keeps its initial temperature at the new pressure and
    volume.  Names that are no states, and values that are not finite, are passed over.
    """
    model, (u, d, p) = plant.model, plant.nominal
    x = plant.initial
    chambers = [n.rpartition(".")[0] for n in model.states if n.endswith("." + MASS)]
    temperatures = model.quantities(*(f"{c}.{TEMPERATURE}" for c in chambers))
    before = temperatures(x, u, d, p).full().ravel()
    for i, name in enumerate(model.states):
        if np.isfinite(known.get(name, np.nan)):
            x[i] = known[name]
    after = temperatures(x, u, d, p).full().ravel()
    for chamber, was, now in zip(chambers, before, after, strict=True):
        x[model.states.index(f"{chamber}.{MASS}")] *= now / was
    return x


@dataclass(frozen=True)
class FilterResult:
    """One pass over a recording, in SI units, one column per filtered sample.

    Attributes
    ----------
    states, state_deviation
        Estimate and its standard deviation, shape (n_x, n).
    unknown, unknown_deviation
        Unknown inputs in the unit of the state rate, shape (n_w, n).
    innovations, normalised
        Measured minus predicted output, and the same over its predicted standard deviation,
        shape (n_y, n); NaN where nothing was received.
    log_likelihood
        Of all received measurements, natural logarithm.
    """

    time_s: np.ndarray
    state_names: tuple[str, ...]
    unknown_names: tuple[str, ...]
    measured: tuple[str, ...]
    states: np.ndarray
    state_deviation: np.ndarray
    unknown: np.ndarray
    unknown_deviation: np.ndarray
    innovations: np.ndarray
    normalised: np.ndarray
    log_likelihood: float


def filter_pass(
    found: PlantFilter, recording: Recording, guessed: np.ndarray | None = None
) -> FilterResult:
    """Extended Kalman filter over a recording.

    NaN samples are skipped; each piece starts from its own first sample, or from the ``guessed``
    state there, shape (n_x, n), where there is one for every sample.
    """
    starts: list[np.ndarray | None] = [None] * len(recording.starts)
    if guessed is not None:
        starts = [guessed[:, first] for first in recording.starts]
    pairs = zip(recording.pieces, starts, strict=True)
    return _joined(found, [_run(found, piece, start) for piece, start in pairs])


def smooth(found: PlantFilter, recording: Recording, factor: float = 1.0) -> FilterResult:
    """:func:`filter_pass` and back again, with the unknown inputs' intensities times a factor."""
    return _joined(found, [_smoothed(_run(found, p, factor=factor)) for p in recording.pieces])


def log_likelihoods(found: PlantFilter, recording: Recording, factors: np.ndarray) -> np.ndarray:
    """Log-likelihoods, (n,), at several intensities of the unknown inputs, side by side.

    ``factors`` (n_w, n) multiply those of ``found``; 0 is none.  Not finite where a run was lost.
    """
    n = factors.shape[1]
    pairs = zip(*(_covariances(found, column) for column in factors.T), strict=True)
    P, Q = (np.array([each.ravel() for each in several]).T for several in pairs)
    total = np.zeros((1, n))
    for piece in recording.pieces:
        start, columns = _posed(found, piece)
        run = found.likelihood.fold(columns[-1].shape[1])
        runs = run.map(n, "thread", min(n, os.cpu_count() or 1))
        now = np.vstack([np.tile(start[:, None], n), P, Q, total])
        total = runs(now, *(np.tile(each, n) for each in columns)).full()[-1:]
    return total.ravel()


def recording_filter(
    plant: Plant,
    recording: Recording,
    unknown_inputs: Mapping[str, float] | None = None,
    measurement_noise: Mapping[str, float] | None = None,
    process_noise: Mapping[str, float] | None = None,
    decimate: int = 1,
    initial_deviation: Mapping[str, float] | None = None,
) -> PlantFilter:
    """The filter of a plant for the outputs and the clock of a recording.

    Outputs that the recording does not hold are left out.  Measurement noise defaults to that of
    the recording; see :class:`PlantFilter` for the other arguments.  Keep it to run several
    recordings or parameter values: its functions are built once.

    Raises
    ------
    ValueError
        If the recording holds no output of the plant, or an output has no noise.
    """
    present = [name for name in plant.measured if name in recording.channels]
    if not present:
        raise ValueError(f"{recording.name} holds no output of {plant.name}; it has "
                         f"{', '.join(recording.channels)}")  # fmt: skip
    return PlantFilter(
        plant=plant.with_measured(*present),
        sample_time_s=recording.sample_time_s,
        decimate=decimate,
        measurement_noise={**recording.noise, **(measurement_noise or {})},
        process_noise=process_noise or {},
        initial_deviation=initial_deviation or {},
        unknown_inputs=unknown_inputs or {},
    )


@dataclass(frozen=True)
class _Pass:
    """One piece, scaled, sample first: estimates, and what the smoother needs."""

    X: np.ndarray
    P: np.ndarray
    F: np.ndarray
    said: np.ndarray
    weights: np.ndarray
    left: np.ndarray
    innovations: np.ndarray
    deviation: np.ndarray
    log_likelihood: float


def _posed(found: PlantFilter, piece: Recording) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Start, and by sample of the filter the columns u, d, p, y and received."""
    plant, m = found.plant, found.decimate
    u, d = inputs(plant, piece)
    n = max(len(piece) // m, 1)
    short = n * m - len(piece)
    u, d = (np.pad(v, ((0, 0), (0, max(short, 0))), mode="edge")[:, : n * m] for v in (u, d))
    y = piece.rows(plant.measured)[:, : n * m : m]
    received = np.isfinite(y)
    first = {
        name: row[seen][0]
        for name, row, seen in zip(plant.measured, y, received, strict=True)
        if seen.any() and seen.argmax() == 0
    }
    start = np.zeros(len(found.scale))
    start[: len(plant.scale)] = consistent_start(plant, first) / plant.scale
    values = np.tile(plant.nominal[2][:, None], n)
    return start, (u, d, values, np.where(received, y, 0.0), received)


def _covariances(found: PlantFilter, factors: np.ndarray) -> tuple[np.ndarray, ...]:
    """Start and step covariance with the intensities of the unknown inputs times (n_w,)."""
    size = np.pad(factors, (len(found.scale) - len(factors), 0), constant_values=1.0)
    return tuple(np.outer(size, size) * c for c in (found.start_covariance, found.step_covariance))


def _run(
    found: PlantFilter, piece: Recording, guessed: np.ndarray | None = None, factor: float = 1.0
) -> _Pass:
    """The filter over one gap-free piece, from a guessed state, (n_x,), where there is one."""
    start, columns = _posed(found, piece)
    P0, Q = _covariances(found, np.full(len(found.unknown_inputs), factor))
    if guessed is not None:
        start[: len(guessed)] = guessed / found.plant.scale
    received = columns[-1]
    many = found.sample.mapaccum("filter", received.shape[1], 2)
    results = many(start, P0, *columns, Q)
    _, _, F, X, P, e, deviation, likely, said, weights, left = (v.full() for v in results)
    return _Pass(
        X=X.T,
        P=_stacked(P),
        F=_stacked(F),
        said=said.T,
        weights=_stacked(weights),
        left=_stacked(left),
        innovations=np.where(received, e, np.nan),
        deviation=deviation,
        log_likelihood=float(likely.sum()),
    )


def _stacked(wide: np.ndarray) -> np.ndarray:
    """Square matrices that stand side by side, as an array (n, size, size)."""
    size = wide.shape[0]
    return wide.reshape(size, -1, size).transpose(1, 0, 2)


def _smoothed(one: _Pass) -> _Pass:
    X, P = smoothed(one.X, one.P, one.F, one.said, one.weights, one.left)
    return replace(one, X=X, P=P)


def _joined(found: PlantFilter, passes: list[_Pass]) -> FilterResult:
    """Pieces one after the other, in SI units."""
    n, scale = len(found.plant.scale), found.scale[:, None]
    X = np.vstack([one.X for one in passes]).T * scale
    variance = np.vstack([one.P.diagonal(axis1=1, axis2=2) for one in passes]).T
    deviation = np.sqrt(np.maximum(variance, 0.0)) * scale
    step_s = found.sample_time_s * found.decimate
    innovation = np.hstack([one.innovations for one in passes])
    return FilterResult(
        time_s=step_s * np.arange(X.shape[1]),
        state_names=found.plant.model.states,
        unknown_names=tuple(found.unknown_inputs),
        measured=found.plant.measured,
        states=X[:n],
        state_deviation=deviation[:n],
        unknown=X[n:],
        unknown_deviation=deviation[n:],
        innovations=innovation,
        normalised=innovation / np.hstack([one.deviation for one in passes]),
        log_likelihood=sum(one.log_likelihood for one in passes),
    )
