"""Where a mode may be trusted: how far from its point it predicts within a tolerance.

The mode and the full plant start at the same state under the same held command and run over a
horizon; the error of a state counts in units of its scale.  Each signal is moved alone to both
sides, in steps that grow from a thousandth of its scale, until the error passes the tolerance.
Then all are moved together, to random places of the box so found and of smaller ones like it: a
product of half-widths holds together only in part, since errors add.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.stats import qmc

from linearize.holding import whole_point
from linearize.hybrid_simulation import whole_step
from linearize.modes import HybridModel, Mode
from workbench.called import result

HORIZON_S = 0.05
TOLERANCE = 0.05  # of a state's scale
SAMPLE_TIME_S = 1e-3
GROWTH = np.geomspace(1e-3, 1.0, 19)  # of a signal's scale
SHARES = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0])  # of the half-widths found alone
PLACES = 5  # binary logarithm of the random places tried for each share
SEED = 11


@dataclass(frozen=True)
class Validity:
    """The region around a mode's point in which it predicts within a tolerance, by signal.

    at_point      error at the point itself, over the scale: what the reduction leaves out
    alone         half-width when only this signal is off the point
    together      half-width of a box in which all signals may be off the point
    """

    name: str
    horizon_s: float
    tolerance: float
    at_point: float
    alone: Mapping[str, float]
    together: Mapping[str, float]


def validity(
    hybrid: HybridModel,
    mode: Mode,
    horizon_s: float = HORIZON_S,
    tolerance: float = TOLERANCE,
    sample_time_s: float = SAMPLE_TIME_S,
) -> Validity:
    """The region of validity of one mode; half-widths are 0 where the point itself is off.

    Samples are as near to ``sample_time_s`` as a whole number of them in the horizon can be.
    """
    names = (*mode.state_names, *mode.command_names)
    driven = [hybrid.model.commands.index(name) for name in mode.command_names]
    size = np.concatenate([mode.scale, hybrid.model.command_scale[driven]])
    samples = max(round(horizon_s / sample_time_s), 1)
    sample_time_s = horizon_s / samples
    errors_of = partial(_errors, hybrid, mode, samples=samples, sample_time_s=sample_time_s)
    signed = np.concatenate([GROWTH, -GROWTH])
    axes = (signed[:, None, None] * np.diag(size)).transpose(1, 0, 2).reshape(-1, len(size))
    errors = errors_of(np.vstack([0.0 * size, axes]))
    at_point, moved = errors[0], errors[1:].reshape(len(size), 2, len(GROWTH)).max(axis=1)
    good = (moved <= tolerance) & (at_point <= tolerance)
    alone = size * _last(GROWTH, good)
    cube = 2.0 * qmc.Sobol(len(size), seed=SEED).random_base2(PLACES) - 1.0
    corners = np.where(np.abs(cube).max(axis=1, keepdims=True) > 0.0, cube, 1.0)
    corners = corners / np.abs(corners).max(axis=1, keepdims=True)  # onto the faces of the box
    tried = (SHARES[:, None, None] * corners * alone).reshape(-1, len(size))
    held = errors_of(tried).reshape(len(SHARES), -1).max(axis=1)
    share = float(_last(SHARES, (held <= tolerance)[None])[0])
    return Validity(
        mode.name,
        horizon_s,
        tolerance,
        float(at_point),
        dict(zip(names, map(float, alone), strict=True)),
        dict(zip(names, map(float, share * alone), strict=True)),
    )


def _errors(
    hybrid: HybridModel, mode: Mode, moved: np.ndarray, *, samples: int, sample_time_s: float
) -> np.ndarray:
    """Largest error over the horizon of starts and commands off the point by ``moved``, (n,).

    The plant is that of the design model with all of its states, as it is behind the dead zone.
    """
    model, plant, n = hybrid.model, hybrid.model.plant, len(moved)
    names = (*model.states, *model.commands)
    z = np.tile(whole_point(hybrid, mode), (n, 1))
    z[:, [names.index(name) for name in (*mode.state_names, *mode.command_names)]] += moved
    x, u = z[:, : len(model.states)].T, z[:, len(model.states) :].T
    step, now, linear = whole_step(hybrid, mode, sample_time_s), x, []
    for _ in range(samples):
        now = step @ np.vstack([now, u, np.ones((1, n))])
        linear.append(now)
    full = result(model.full_under.map(n), x, u)
    _, d, p = plant.nominal
    run = plant.model.run(sample_time_s, samples).map(n)
    inputs = (np.repeat(u, samples, axis=1), np.tile(d[:, None], n * samples))
    later = result(run, full, *inputs, np.tile(p[:, None], n))
    rows = [plant.model.states.index(name) for name in model.states]
    true = later[rows].reshape(len(rows), n, samples).transpose(2, 0, 1)
    return np.abs((np.array(linear) - true) / model.scale[:, None]).max(axis=(0, 1))


def _last(steps: np.ndarray, good: np.ndarray) -> np.ndarray:
    """For each row of ``good``, (n, n_steps), the last step before the first that is not; or 0."""
    count = np.where(good.all(axis=1), len(steps), np.argmin(good, axis=1))
    return np.concatenate([[0.0], steps])[count]
