"""How well modes predict over a horizon, and the best that one linear model can do.

Every window starts at the plant's true state and gets its commands.  The error of a state counts
in units of its scale.

Source: prediction error method, Ljung 1999, "System Identification", Sec. 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

from linearize.equilibrium import OperatingPoint
from linearize.holding import whole_point
from linearize.hybrid_simulation import SampledHybrid, sampled_hybrid
from linearize.modes import HybridModel, Mode, linearised
from linearize.visits import Visited, Windows, joined, windows
from workbench.called import result

ENOUGH = 1e-5  # of the sum of squares: a step that gains less ends the fit
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


def error_along(hybrid: HybridModel, manoeuvres: Sequence[Visited]) -> float:
    """RMS error of modes over all windows of manoeuvres, each sampled as it was recorded.

    Raises
    ------
    ValueError
        If those of one sample time have no window.
    """
    squares, sizes = [], []
    for clock in dict.fromkeys(each.sample_time_s for each in manoeuvres):
        judged = windows(joined([each for each in manoeuvres if each.sample_time_s == clock]))
        squares.append(prediction_of(sampled_hybrid(hybrid, clock), judged).total ** 2)
        sizes.append(judged.states[:, 1:].size)
    return float(np.sqrt(np.average(squares, weights=sizes)))


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

    One step ahead by linear least squares, then over the whole horizon by damped Gauss-Newton steps
    from there, with exact derivatives of the run over the horizon.  It is judged on what it was
    fitted to, so no other single model is treated as well.
    """
    single = single_of(hybrid, hybrid.modes[0], windows.sample_time_s)
    n, m = len(windows.states), len(windows.commands)
    middle = np.concatenate([windows.states.mean(axis=(1, 2)), windows.commands.mean(axis=(1, 2))])
    size = np.concatenate([hybrid.model.scale, hybrid.model.command_scale])
    x, u = (
        (v - middle[part, None, None]) / size[part, None, None]
        for v, part in ((windows.states, slice(0, n)), (windows.commands, slice(n, n + m)))
    )
    z = np.concatenate([x, u, np.ones((1, *x.shape[1:]))])
    per_step = np.linalg.lstsq(z[:, :-1].reshape(n + m + 1, -1).T, x[:, 1:].reshape(n, -1).T)[0].T
    found = _over_the_horizon(per_step, x, z[n:, :-1])
    return replace(single, steps=_unscaled(found, middle, size))


def _over_the_horizon(step: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """The step [F G offset], (n, n_z), from which the runs from x[:, 0] miss x least.

    ``x`` has shape (n, n_samples + 1, n_w); ``inputs`` u and 1, shape (n_z - n, n_samples, n_w).
    """
    n, _, n_w = x.shape
    run, slopes = (f.map(n_w) for f in _runs(n, *inputs.shape[:2]))
    given = inputs.transpose(0, 2, 1).reshape(len(inputs), -1)
    true = x[:, FITTED::FITTED].transpose(0, 2, 1).reshape(n, -1)

    def at(values: np.ndarray) -> tuple[np.ndarray, ...]:
        return np.tile(values.reshape(step.shape), n_w), x[:, 0], given

    best = least_squares(
        lambda values: (result(run, *at(values)) - true).ravel(),
        step.ravel(),
        lambda values: _rows(result(slopes, *at(values)), n),
        method="lm",
        ftol=ENOUGH,
    )
    return best.x.reshape(step.shape)


def _runs(n: int, n_inputs: int, samples: int) -> tuple[ca.Function, ca.Function]:
    """(step, start, inputs) -> every FITTED-th state, and its slopes by the step's entries.

    The slopes S, (n, n n_z), go along with the state: S+ = F S + d(step z)/dstep.  Of both results
    a column is a sample; one of the second holds the columns of its S.
    """
    step, x, u = ca.SX.sym("step", n, n + n_inputs), ca.SX.sym("x", n), ca.SX.sym("u", n_inputs)
    S = ca.SX.sym("S", n, step.numel())
    later = step @ ca.vertcat(x, u)
    moved = step[:, :n] @ S + ca.jacobian(later, ca.vec(step.T))
    once = ca.Function("once", [step, x, u, S], [later, moved])
    shapes = {"step": step.shape, "start": x.shape, "given": (n_inputs, samples)}
    entries, start, given = (ca.MX.sym(name, *shape) for name, shape in shapes.items())
    now, slopes, states, rows = start, ca.MX(*S.shape), [], []
    for k in range(samples):
        now, slopes = once(entries, now, given[:, k], slopes)
        states.append(now)
        rows.append(ca.vec(slopes))
    counted = slice(FITTED - 1, None, FITTED)
    inputs = [entries, start, given]
    return tuple(ca.Function("run", inputs, [ca.horzcat(*row[counted])]) for row in (states, rows))


def _rows(slopes: np.ndarray, n: int) -> np.ndarray:
    """Slopes as :func:`_runs` gives them, a row for each state and sample, a column each entry."""
    by_entry = slopes.reshape(-1, n, slopes.shape[1])
    return by_entry.transpose(1, 2, 0).reshape(n * slopes.shape[1], -1)


def _unscaled(step: np.ndarray, middle: np.ndarray, size: np.ndarray) -> np.ndarray:
    """[F G offset] of scaled deviations from the middle as one of absolute values, (1, n, n_z)."""
    n = len(step)
    rows = step[:, :-1] * size[:n, None] / size
    offset = middle[:n] + step[:, -1] * size[:n] - rows @ middle
    return np.column_stack([rows, offset])[None]
