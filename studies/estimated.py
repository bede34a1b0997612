"""What comes out of estimators side by side on a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimators.observed import Observed
from estimators.tuning import TunedNoise
from studies.estimator_runs import Followed
from workbench.recording import Recording


@dataclass(frozen=True)
class Estimated:
    """One estimator on one recording.

    Attributes
    ----------
    horizons
        RMS error of each output, (n_y,), so many seconds after an estimate.
    nis
        Mean innovation squared over its covariance, per received output: 1 if it is consistent.
    coloured
        Share of lags at which innovations are correlated, by output, (n_y,).
    state_rmse, hidden_rmse
        By state of the plant in the simulation, and with the effect hidden in it.
    disturbed
        RMS error of each output of the simulation, (n_y,), by what the data lack.
    simulated
        The run on the simulation.
    """

    name: str
    horizons: Mapping[float, np.ndarray]
    nis: float
    coloured: np.ndarray
    median_s: float
    p99_s: float
    state_rmse: Mapping[str, float]
    hidden_rmse: Mapping[str, float]
    disturbed: Mapping[str, np.ndarray]
    simulated: Followed


@dataclass(frozen=True)
class EstimatedRecording:
    """All estimators on one recording, with what they were told and what is true.

    ``observed`` tells how well the outputs determine the states of the simulation, ``lost`` why
    estimators have no row.
    """

    name: str
    outputs: tuple[str, ...]
    sample_time_s: float
    noise: Mapping[str, float]
    tuned: TunedNoise
    hidden: str
    truth: Recording
    observed: Observed
    rows: tuple[Estimated, ...]
    lost: Mapping[str, str]
