"""How well modes predict over a horizon, and the best that one linear model can do.

Every window starts at the plant's true state and gets its commands.  The error of a state counts
in units of its scale.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from linearize.equilibrium import OperatingPoint
from linearize.holding import whole_point
from linearize.hybrid_simulation import SampledHybrid, sampled_hybrid
from linearize.modes import HybridModel, Mode, linearised
from linearize.visits import Windows

FITTED = 5  # every so many samples of a window count in the fit of the single model


@dataclass(frozen=True)
class PredictionError:
    """RMS over all windows and their samples behind the start.

    by_state     in units of the state's scale, shape (n_x,)
    """

    by_state: np.ndarray

    @property
    def total(self) -> float:
        """RMS over the states too."""
        return float(np.sqrt(np.mean(self.by_state**2)))


def prediction_of(modes: SampledHybrid, windows: Windows) -> PredictionError:
    """The error of sampled modes that switch by their boxes and guards."""
    found = modes.run(windows.states[:, 0], windows.commands).states
    size = modes.hybrid.model.scale[:, None, None]
    relative = (found - windows.states)[:, 1:] / size
    return PredictionError(np.sqrt(np.mean(relative**2, axis=(1, 2))))


def single_of(hybrid: HybridModel, mode: Mode, sample_time_s: float) -> SampledHybrid:
    """The linear model at the point of a mode taken alone: valid everywhere, nothing held."""
    model, n = hybrid.model, len(hybrid.model.states)
    at = whole_point(hybrid, mode)
    rates = model.f(at[:n], at[n:])[0].full().ravel()
    unrest = float(np.abs(rates / model.scale).max())
    alone = replace(
        linearised(model, {}, OperatingPoint(at[:n], at[n:], rates, unrest)), name=mode.name
    )
    return sampled_hybrid(HybridModel(hybrid.plant, model, (alone,)), sample_time_s)


def fitted_single(hybrid: HybridModel, windows: Windows) -> SampledHybrid:
    """The one affine model that predicts these very windows best, physics or not.

    One step ahead by linear least squares, then over the whole horizon by Gauss-Newton steps from
    there.  It is judged on what it was fitted to, so no other single model is treated as well.

    Source: prediction error method, Ljung 1999, "System Identification", Sec. 7.
    """
    single = single_of(hybrid, hybrid.modes[0], windows.sample_time_s)
    n, m = len(windows.states), len(windows.commands)
    middle = np.concatenate([windows.states.mean(axis=(1, 2)), windows.commands.mean(axis=(1, 2))])
    size = np.concatenate([hybrid.model.scale, np.ones(m)])
    x, u = (
        (v - middle[part, None, None]) / size[part, None, None]
        for v, part in ((windows.states, slice(0, n)), (windows.commands, slice(n, n + m)))
    )
    ones = np.ones((1, *x.shape[1:]))
    z = np.concatenate([x, u, ones])
    per_step = np.linalg.lstsq(z[:, :-1].reshape(n + m + 1, -1).T, x[:, 1:].reshape(n, -1).T)[0].T

    def residual(change: np.ndarray) -> np.ndarray:
        step, now, found = per_step + change.reshape(per_step.shape), x[:, 0], []
        for k in range(x.shape[1] - 1):
            now = step @ np.vstack([now, z[n:, k]])
            found.append(now - x[:, k + 1])
        return np.ravel(found[FITTED - 1 :: FITTED])

    change = 1e-3 * np.ones(per_step.size)
    best = least_squares(residual, np.zeros(per_step.size), x_scale=change, method="lm")
    return replace(single, steps=_unscaled(per_step + best.x.reshape(per_step.shape), middle, size))


def _unscaled(step: np.ndarray, middle: np.ndarray, size: np.ndarray) -> np.ndarray:
    """[F G offset] of scaled deviations from the middle as one of absolute values, (1, n, n_z)."""
    n = len(step)
    rows = step[:, :-1] * size[:n, None] / size
    offset = middle[:n] + step[:, -1] * size[:n] - rows @ middle
    return np.column_stack([rows, offset])[None]
