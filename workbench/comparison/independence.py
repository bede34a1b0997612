"""Whether a one-step error still holds something of an input: the second residual test.

Where model and noise are right, the error e knows nothing of the input u.  Then their correlation
at lag k, r(k) = sum e(t + k) u(t) / (n s_e s_u), stays within +-1.96 sqrt(P / n) for 95 % of all
lags, with P = sum over k of R_e(k) R_u(k), both as correlations.  Lags below zero show feedback.

Source: Ljung, System Identification, 2nd ed., 16.6, Eq. 16.64 to 16.66.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.comparison.compare import RecordingComparison
from workbench.comparison.horizons import ONE_STEP, PLAIN
from workbench.comparison.residuals import NORMAL_95, autocorrelation
from workbench.recording import Recording
from workbench.rig import Rig


@dataclass(frozen=True)
class Independence:
    """Correlation of an output's error with an input: lags (n,) from negative on, and its band."""

    against: str
    lag_s: np.ndarray
    correlation: np.ndarray
    band: float

    @property
    def outside(self) -> float:
        """Share of the lags from 0 on outside the band; 0.05 is chance.  NaN without any."""
        causal = np.abs(self.correlation[self.lag_s >= 0.0])
        return float(np.mean(causal > self.band)) if len(causal) else float("nan")


def independence_of(
    rig: Rig, recording: Recording, compared: RecordingComparison
) -> Mapping[str, Independence]:
    """The test of every output against the first command or measured input, by full name.

    Empty where the plant has no input.
    """
    plant = rig.fit_for(recording)
    against = next((s.name for s in (*plant.commands, *plant.measured_inputs)), None)
    if against is None:
        return {}
    ahead = compared.simulated.get(ONE_STEP) or compared.simulated[PLAIN]
    return {
        name: independence(
            compared.measured[name] - ahead[name],
            recording[against],
            against,
            recording.sample_time_s,
            len(compared.residuals[name].lag_s),
        )
        for name in compared.measured
    }


def independence(
    error: np.ndarray, values: np.ndarray, against: str, sample_time_s: float, lags: int
) -> Independence:
    """Correlation of an error (n,), NaN where there is none, with an input (n,) at +-lags."""
    seen = np.isfinite(error) & np.isfinite(values)
    count = int(seen.sum())
    lags = max(min(lags, count - 1), 0)
    steps = np.arange(-lags, lags + 1)
    if not count:
        return Independence(against, sample_time_s * steps, np.zeros(1), 0.0)
    e, u = (np.where(seen, each - each[seen].mean(), 0.0) for each in (error, values))
    size = float(np.sqrt((e @ e) * (u @ u)))
    if size == 0.0:
        return Independence(against, sample_time_s * steps, np.zeros(len(steps)), 0.0)
    n = len(e)
    sums = [float(e[max(k, 0) : n + min(k, 0)] @ u[max(-k, 0) : n - max(k, 0)]) for k in steps]
    own, other = (autocorrelation([each], lags)[0] for each in (e, u))
    spread = float(own[0] * other[0] + 2.0 * (own[1:] @ other[1:]))
    band = NORMAL_95 * np.sqrt(max(spread, 1.0) / count)
    return Independence(against, sample_time_s * steps, np.array(sums) / size, band)
