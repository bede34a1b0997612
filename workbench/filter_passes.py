"""Passes of a Kalman filter over a recording.

The smoothed unknown input of a :class:`PlantFilter` is what a model lacks in that balance, sample
by sample; the innovations are its one-step errors.  A pass runs in blocks of samples, without
Python in the loop over them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.called import called
from workbench.filtering import (
    consistent_start,
    smoothed,
    smoothed_covariances,
    smoothed_covariances_behind,
)
from workbench.plant import Plant
from workbench.plant_filter import PlantFilter
from workbench.recording import Recording
from workbench.simulation import inputs

BLOCK = 100  # samples of one call: longer graphs take longer to build than to run


@dataclass(frozen=True)
class FilterResult:
    """One pass over a recording, in SI units, one column per filtered sample.

    Attributes
    ----------
    states
        Estimate, shape (n_x, n).
    unknown, unknown_deviation
        Unknown inputs in the unit of the state rate and their standard deviations, shape (n_w, n).
    innovations, normalised
        Measured minus predicted output, and the same over its predicted standard deviation,
        shape (n_y, n); NaN where nothing was received.
    log_likelihood
        Of all received measurements, natural logarithm.
    """

    time_s: np.ndarray
    state_names: tuple[str, ...]
    measured: tuple[str, ...]
    states: np.ndarray
    unknown: np.ndarray
    unknown_deviation: np.ndarray
    innovations: np.ndarray
    normalised: np.ndarray
    log_likelihood: float

    def watched(self, reach: int) -> np.ndarray:
        """True where an output was received within so many samples, before or after; (n,)."""
        received = np.flatnonzero(np.isfinite(self.innovations).any(axis=0))
        if not len(received):
            return np.zeros(self.states.shape[1], dtype=bool)
        samples = np.arange(self.states.shape[1])
        after = np.searchsorted(received, samples).clip(max=len(received) - 1)
        nearest = np.minimum(
            np.abs(received[after] - samples), np.abs(received[np.maximum(after - 1, 0)] - samples)
        )
        return nearest <= reach


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
    """:func:`filter_pass` and back again: every estimate knows the whole recording.

    ``factor`` multiplies the intensities of the unknown inputs.
    """
    passes = (_run(found, piece, factor=factor) for piece in recording.pieces)
    return _joined(found, [_smoothed(found, one) for one in passes])


def blocks(
    columns: Sequence[np.ndarray], span: slice, size: int
) -> Iterator[tuple[np.ndarray, ...]]:
    """Columns of a span of samples, so many at a time; u and d have several for a sample."""
    samples = columns[-1].shape[1]
    for first in range(span.start, span.stop, size):
        yield tuple(
            each[:, first * each.shape[1] // samples : (first + size) * each.shape[1] // samples]
            for each in columns
        )


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
    gains: np.ndarray
    Q: np.ndarray
    innovations: np.ndarray
    deviation: np.ndarray
    log_likelihood: float


def posed(found: PlantFilter, piece: Recording) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
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


def covariances(found: PlantFilter, factors: np.ndarray) -> tuple[np.ndarray, ...]:
    """Start and step covariance with the intensities of the unknown inputs times (n_w,)."""
    size = np.pad(factors, (len(found.scale) - len(factors), 0), constant_values=1.0)
    return tuple(np.outer(size, size) * c for c in (found.start_covariance, found.step_covariance))


def _run(
    found: PlantFilter, piece: Recording, guessed: np.ndarray | None = None, factor: float = 1.0
) -> _Pass:
    """The filter over one gap-free piece, from a guessed state, (n_x,), where there is one."""
    start, columns = posed(found, piece)
    P0, Q = covariances(found, np.full(len(found.unknown_inputs), factor))
    if guessed is not None:
        start[: len(guessed)] = guessed / found.plant.scale
    received = columns[-1]
    rows = zip(*_passed(found, start, P0, Q, columns), strict=True)
    F, X, P, e, deviation, likely, said, weights, left, gains = map(np.hstack, rows)
    return _Pass(
        X=X.T,
        P=_stacked(P),
        F=_stacked(F),
        said=said.T,
        weights=_stacked(weights),
        left=_stacked(left),
        gains=_apart(gains, 2 * len(found.plant.measured)),
        Q=Q,
        innovations=np.where(received, e, np.nan),
        deviation=deviation,
        log_likelihood=float(likely.sum()),
    )


def _passed(
    found: PlantFilter,
    X: np.ndarray,
    P: np.ndarray,
    Q: np.ndarray,
    columns: tuple[np.ndarray, ...],
) -> list[tuple[np.ndarray, ...]]:
    """What the filter tells of every sample, block by block: long graphs build slowly."""
    many = found.sample.mapaccum("filter", BLOCK, 2)
    samples, size, Q = columns[-1].shape[1], len(X), np.tile(Q, BLOCK)
    rows = []
    for part in blocks([_filled(each, samples) for each in columns], slice(0, samples), BLOCK):
        every_X, every_P, *told = called(many, X, P, *part, Q)
        X, P = every_X[:, -1], every_P[:, -size:]
        rows.append(tuple(told))
    beyond = len(rows) * BLOCK - samples
    rows[-1] = tuple(each[:, : each.shape[1] // BLOCK * (BLOCK - beyond)] for each in rows[-1])
    return rows


def _filled(columns: np.ndarray, samples: int) -> np.ndarray:
    """Columns up to the end of the last block, the last ones held."""
    each = columns.shape[1] // samples
    return np.pad(columns, ((0, 0), (0, -samples % BLOCK * each)), mode="edge")


def _stacked(wide: np.ndarray) -> np.ndarray:
    """Square matrices that stand side by side, as an array (n, size, size)."""
    return _apart(wide, wide.shape[0])


def _apart(wide: np.ndarray, width: int) -> np.ndarray:
    """Matrices of so many columns that stand side by side, as an array (n, rows, width)."""
    return wide.reshape(wide.shape[0], -1, width).transpose(1, 0, 2)


def _smoothed(found: PlantFilter, one: _Pass) -> _Pass:
    known = (one.P, one.F, one.weights, one.left)
    if found.corrected.all():
        P = smoothed_covariances(*known)
    else:
        P = smoothed_covariances_behind(one.gains, *known, one.Q)
    X = smoothed(one.X, one.P, one.F, one.said, one.left)
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
        measured=found.plant.measured,
        states=X[:n],
        unknown=X[n:],
        unknown_deviation=deviation[n:],
        innovations=innovation,
        normalised=innovation / np.hstack([one.deviation for one in passes]),
        log_likelihood=sum(one.log_likelihood for one in passes),
    )
