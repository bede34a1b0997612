"""A moving horizon on the time constant of the soft joint, and what its estimate is worth.

The estimate of every sample stands in for the time constant in a free run of the model (paper 004,
Figs. 9 and 10), and in predictions of one second from the recorded pressure.

Source: paper 004 (horizon of 1 s, squared error with a small penalty on movement, bounds); S004-5
of physics.md 5.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from estimators.losses import Loss, Squared
from estimators.moving_horizon import MovingHorizon
from studies.soft_joint_fits import PSI_PA, SAMPLE_TIME_S, TAU, Data
from workbench.called import result
from workbench.plant import Plant
from workbench.plants.soft_joint import COMMAND, PRESSURE
from workbench.recording import Recording

NOISE_PA, START_PA = 1e3, 1e5  # of the sensor; of a window's start, by root of a second
AHEAD, EVERY = 400, 40  # samples of a prediction, and from one to the next
MOVING_PA_S = 5e4  # above which a rate tells a time constant
SMOOTHED = 9  # samples whose mean stands for the pressure there
LONGEST_LAG_S, EDGE_S = 1.2, 1.0  # of a shift tried; how much after an edge counts


@dataclass(frozen=True)
class Setting:
    """The knobs: samples of the horizon, movement from sample to sample in s, bounds in s, loss."""

    horizon: int = 400
    movement_s: float = 1e-3
    bounds_s: tuple[float, float] = (0.01, 1.0)
    loss: Loss = field(default_factory=Squared)

    @property
    def name(self) -> str:
        low, high = self.bounds_s
        return (
            f"{self.horizon * SAMPLE_TIME_S:g} s, movement {1e3 * self.movement_s:g} ms, "
            f"{type(self.loss).__name__.lower()}, {low:g} to {high:g} s"
        )

    @property
    def slug(self) -> str:
        """The name as part of a file name."""
        return "_".join("".join(c if c.isalnum() or c == "." else " " for c in self.name).split())


@dataclass(frozen=True)
class Worth:
    """Errors in psi on the judged record: largest in the event, RMS of it and of all else.

    The last two are predictions of one second, RMS in the event and elsewhere.
    """

    event_psi: float
    event_rmse_psi: float
    nominal_psi: float
    ahead_event_psi: float
    ahead_nominal_psi: float


def estimator(plant: Plant, setting: Setting) -> MovingHorizon:
    """The estimator; the start of a window is known from the measurement rather than the model."""
    return MovingHorizon(
        plant=plant,
        sample_time_s=SAMPLE_TIME_S,
        measurement_noise={PRESSURE: NOISE_PA},
        process_noise={},
        constants={TAU: setting.movement_s},
        bounds={TAU: setting.bounds_s},
        arrival_noise={PRESSURE: START_PA},
        loss=setting.loss,
        horizon=setting.horizon,
        coarsest_s=SAMPLE_TIME_S,
    )


def tracked(plant: Plant, recording: Recording, setting: Setting) -> tuple[np.ndarray, int]:
    """The time constant at every sample, (n,), and how often the filter had to take over."""
    horizon, u, y = estimator(plant, setting), recording[COMMAND], recording[PRESSURE]
    estimate, taus, lost = horizon.start(y[:1]), [], 0
    for k in range(len(y)):
        last = max(k - 1, 0)
        estimate = horizon.update(estimate, u[last : last + 1], y[k : k + 1])
        taus.append(estimate.notes[f"estimated {TAU}"])
        lost += int(estimate.notes["fallback"])
    return np.array(taus), lost


def free_run(plant: Plant, recording: Recording, taus: np.ndarray) -> np.ndarray:
    """Pressure of the model from the first recorded one, with a time constant at every sample."""
    n = len(recording) - 1
    run = plant.model.compiled_step(SAMPLE_TIME_S).mapaccum(n)
    u, none = recording[COMMAND][None, :-1], np.zeros((0, n))
    later = result(run, recording[PRESSURE][:1], u, none, _values(plant, taus[:-1]))
    return np.hstack([recording[PRESSURE][0], later[0]])


def ahead(plant: Plant, recording: Recording, taus: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Samples at which predictions of a second end, and their errors in Pa.

    Each starts from the recorded pressure with the time constant estimated there.
    """
    starts = np.arange(0, len(recording) - AHEAD, EVERY)
    run = plant.model.compiled_step(SAMPLE_TIME_S).mapaccum(AHEAD).map(len(starts))
    columns = (starts[:, None] + np.arange(AHEAD)).ravel()
    u, p = recording[COMMAND][None, columns], _values(plant, np.repeat(taus[starts], AHEAD))
    later = result(run, recording[PRESSURE][None, starts], u, np.zeros((0, len(columns))), p)
    ends = starts + AHEAD
    return ends, later[0, AHEAD - 1 :: AHEAD] - recording[PRESSURE][ends]


def _values(plant: Plant, taus: np.ndarray) -> np.ndarray:
    p = np.tile(plant.nominal[2][:, None], len(taus))
    p[plant.model.parameters.index(TAU)] = taus
    return p


def worth(plant: Plant, data: Data, taus: np.ndarray) -> Worth:
    """What the time constants are worth on the judged record."""
    return worth_of(data, free_run(plant, data.judged, taus), *ahead(plant, data.judged, taus))


def worth_of(data: Data, pressure: np.ndarray, ends: np.ndarray, errors: np.ndarray) -> Worth:
    """The errors of a free run and of predictions, in the event and elsewhere."""
    first, last = data.event
    off = (pressure - data.judged[PRESSURE]) / PSI_PA
    inside = (ends - AHEAD // 2 >= first) & (ends < last)
    return Worth(
        event_psi=float(np.abs(off[first:last]).max()),
        event_rmse_psi=_rms(off[first:last]),
        nominal_psi=_rms(off[data.nominal]),
        ahead_event_psi=_rms(errors[inside] / PSI_PA),
        ahead_nominal_psi=_rms(errors[data.nominal[ends]] / PSI_PA),
    )


def _rms(values: np.ndarray) -> float:
    """Root mean square; NaN of nothing."""
    if not len(values):
        return float("nan")
    return float(np.sqrt(np.mean(values**2)))


def needed(plant: Plant, physical: Plant, recording: Recording) -> np.ndarray:
    """The time constant with which the model has the rate of the physical one, shape (n,).

    NaN where that moves too slowly to tell, or the other way.
    """
    x = np.convolve(recording[PRESSURE], np.full(SMOOTHED, 1.0 / SMOOTHED), "same")[None]
    u = recording[COMMAND][None]

    def rates(of: Plant) -> np.ndarray:
        n = x.shape[1]
        p = np.tile(of.nominal[2][:, None], n)
        return result(of.model.f.map(n), x, u, np.zeros((0, n)), p)[0]

    own, wanted = rates(plant), rates(physical)
    moving = (np.abs(wanted) > MOVING_PA_S) & (own * wanted > 0.0)
    tau = plant.values[TAU] * own / np.where(moving, wanted, 1.0)
    return np.where(moving, tau, np.nan)


def edges(recording: Recording) -> Mapping[str, np.ndarray]:
    """Samples at which the command goes above the centre, and below it."""
    u = recording[COMMAND]
    side = np.sign(np.where(np.abs(u - 0.5) < 0.021, 0.0, u - 0.5))
    turned = np.flatnonzero(np.diff(side)) + 1
    return {"rising": turned[side[turned] > 0], "falling": turned[side[turned] < 0]}


def lags(data: Data, taus: np.ndarray, wanted: np.ndarray) -> dict[str, float]:
    """Shift in s by which the estimates come after what is needed, by kind of edge.

    The shift that brings the logarithms nearest to each other over the second after the edges,
    those of the event left out.
    """
    found, n = {}, len(taus)
    for kind, at in edges(data.judged).items():
        spans = [np.arange(k, min(k + round(EDGE_S / SAMPLE_TIME_S), n)) for k in at]
        seen = np.concatenate([s for s in spans if data.nominal[s].all()])
        seen = seen[np.isfinite(wanted[seen])]
        tried = np.arange(0, round(LONGEST_LAG_S / SAMPLE_TIME_S), 4)
        misfit = []
        for shift in tried:
            later = seen + shift
            inside = later < n
            ratio = taus[later[inside]] / wanted[seen[inside]]
            misfit.append(np.mean(np.log(ratio) ** 2))
        found[kind] = float(tried[int(np.argmin(misfit))] * SAMPLE_TIME_S)
    return found
