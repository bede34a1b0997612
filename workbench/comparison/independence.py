"""Whether a one-step error still holds something of an input: the second residual test.

Where model and noise are right, the error e knows nothing of the input u.  Then their correlation
at lag k, r(k) = sum e(t + k) u(t) / (n s_e s_u), stays within +-1.96 sqrt(P / n) for 95 % of all
lags, with P = sum over k of R_e(k) R_u(k), both as correlations.  Lags below zero show feedback.
Where samples are missing, or a piece ends, each sum has fewer terms than it would have: r(k) is
scaled up by that, the band by its root.

Source: Ljung, System Identification, 2nd ed., 16.6, Eq. 16.64 to 16.66.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.comparison.compare import RecordingComparison
from workbench.comparison.horizons import ONE_STEP, PLAIN
from workbench.comparison.residuals import NORMAL_95
from workbench.recording import Recording
from workbench.rig import Rig


@dataclass(frozen=True)
class Independence:
    """Correlation of an output's error with an input: lags (n,) from negative on, and its bands.

    All are empty where it is not known: without samples, or where error or input never change.
    """

    against: str
    lag_s: np.ndarray
    correlation: np.ndarray
    bands: np.ndarray

    @property
    def outside(self) -> float:
        """Share of the lags from 0 on outside the band; 0.05 is chance.  NaN without any."""
        causal = (np.abs(self.correlation) > self.bands)[self.lag_s >= 0.0]
        return float(np.mean(causal)) if len(causal) else float("nan")


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
            recording.starts,
        )
        for name in compared.measured
    }


def independence(
    error: np.ndarray,
    values: np.ndarray,
    against: str,
    sample_time_s: float,
    lags: int,
    starts: Sequence[int] = (0,),
) -> Independence:
    """Correlation of an error (n,), NaN where there is none, with an input (n,) at +-lags.

    ``starts`` are the first samples of pieces: no pair reaches from one into another.
    """
    seen = np.isfinite(error) & np.isfinite(values)
    count = int(seen.sum())
    if not count or np.ptp(error[seen]) == 0.0 or np.ptp(values[seen]) == 0.0:
        return Independence(against, *np.zeros((3, 0)))
    lags = max(min(lags, count - 1), 0)
    rows = (np.where(seen, each - each[seen].mean(), 0.0) for each in (error, values))
    e, u, known = (_apart(row, starts, lags) for row in (*rows, 1.0 * seen))
    steps = np.arange(-lags, lags + 1)
    pairs = _sums(known, known, steps)
    steps, pairs = steps[pairs > 0], pairs[pairs > 0]
    kept = pairs / (count * (1.0 - np.abs(steps) / len(error)))  # of the pairs without a hole

    def correlation(one: np.ndarray, other: np.ndarray) -> np.ndarray:
        return _sums(one, other, steps) / kept / np.sqrt((one @ one) * (other @ other))

    spread = float(np.sum(kept * correlation(e, e) * correlation(u, u)))
    bands = NORMAL_95 * np.sqrt(max(spread, 1.0) / count / kept)
    return Independence(against, sample_time_s * steps, correlation(e, u), bands)


def _apart(values: np.ndarray, starts: Sequence[int], lags: int) -> np.ndarray:
    """Values (n,) with so many zeros behind each piece."""
    return np.concatenate([np.pad(piece, (0, lags)) for piece in np.split(values, starts[1:])])


def _sums(one: np.ndarray, other: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Sums of one(t + k) other(t) at so many samples, shape of ``steps``."""
    n = len(one)
    pairs = ((one[max(k, 0) : n + min(k, 0)], other[max(-k, 0) : n - max(k, 0)]) for k in steps)
    return np.array([float(a @ b) for a, b in pairs])
