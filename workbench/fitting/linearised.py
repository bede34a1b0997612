"""Residuals and derivatives of windows at a point, with the start states projected out.

Derivatives are forward differences over one large batched simulation: at kinks they are the
better ones, and with a dozen columns they are cheaper than derivatives carried through the
integrator (diagnosis.md 4.4).  The start states of a window appear in that window alone, so they
are eliminated window by window by an orthogonal projection.

Source: diagnosis.md 1.2; Golub and Pereyra's separable least squares in structure.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows
from workbench.plant import Plant

PARAMETER_STEP = 0.25  # of the scale of an unknown
START_STEP = 0.25  # of the deviation of a start state


@dataclass(frozen=True)
class Point:
    """Where a fit stands.

    t        scaled unknowns, shape (n_p,)
    starts   start states, shape (n_x, n_windows)
    """

    t: np.ndarray
    starts: np.ndarray


@dataclass(frozen=True)
class Linearised:
    """Residuals and derivatives at a point with the start states projected out.

    Attributes
    ----------
    residual
        Weighted residuals per window, shape (n_windows, rows); the prior rows of the start states
        come last.
    parameters
        Derivatives of the residual in the scaled unknowns, (n_windows, rows, n_p).
    basis
        Orthonormal basis of what the start states can do, (n_windows, rows, n_x).
    triangle
        Triangular factor that belongs to the basis, (n_windows, n_x, n_x).
    """

    point: Point
    residual: np.ndarray
    parameters: np.ndarray
    basis: np.ndarray
    triangle: np.ndarray

    def projected(self, rows: np.ndarray) -> np.ndarray:
        """What the start states cannot explain of columns (n_windows, rows, ...)."""
        flat = rows.reshape(*rows.shape[:2], int(np.prod(rows.shape[2:])))
        left = flat - self.basis @ (self.basis.transpose(0, 2, 1) @ flat)
        return left.reshape(rows.shape)


def linearise(windows: Windows, unknowns: Unknowns, point: Point) -> Linearised:
    """Residuals and derivatives by one batch of simulations; see :class:`Linearised`."""
    n_x, n_p = windows.start.shape[0], len(unknowns)
    h_x = START_STEP * windows.start_deviation
    plants = [plant_at(windows, unknowns, point.t)] * (1 + n_x)
    starts = [point.starts] * (1 + n_x + n_p)
    for k in range(n_x):
        stepped = point.starts.copy()
        stepped[k] += h_x[k]
        starts[1 + k] = stepped
    h_p = parameter_steps(unknowns, point.t)
    plants += [plant_at(windows, unknowns, point.t + h_p[k] * unit(n_p, k)) for k in range(n_p)]
    r = windows.residuals(plants, np.array(starts)).transpose(0, 2, 1, 3)
    n = len(windows)
    r = r.reshape(len(plants), n, -1)
    residual = _with_priors(windows, point, r[0])
    J_x = np.concatenate(
        [
            (r[1 : 1 + n_x] - r[0]).transpose(1, 2, 0) / START_STEP,
            np.broadcast_to(np.eye(n_x), (n, n_x, n_x)),
        ],
        axis=1,
    )
    J_p = (r[1 + n_x :] - r[0]).transpose(1, 2, 0) / h_p
    J_p = np.concatenate([J_p, np.zeros((n, n_x, n_p))], axis=1)
    basis, triangle = (
        np.linalg.qr(J_x) if n_x else (np.zeros((*residual.shape, 0)), np.zeros((n, 0, 0)))
    )
    return Linearised(point, residual, J_p, basis, triangle)


def moved(windows: Windows, unknowns: Unknowns, at: Linearised, point: Point) -> Linearised:
    """The same derivatives with the residual of another point.

    ``at`` may belong to other values of the same unknowns, or to a plant with other values.
    """
    r = windows.residuals([plant_at(windows, unknowns, point.t)], point.starts)[0]
    rows = r.transpose(1, 0, 2).reshape(len(windows), -1)
    return replace(at, point=point, residual=_with_priors(windows, point, rows))


def _with_priors(windows: Windows, point: Point, rows: np.ndarray) -> np.ndarray:
    """Residuals (n_windows, rows) with the prior rows of the start states behind them."""
    away = ((point.starts - windows.start) / windows.start_deviation).T
    return np.concatenate([rows, away], axis=1)


def rescaled(at: Linearised, before: Windows, after: Windows) -> Linearised:
    """The same derivatives on windows that differ in their scales alone."""
    ratio = np.repeat((before.scale / after.scale).T, before.length, axis=1)
    ratio = np.concatenate([ratio, np.ones((len(ratio), at.triangle.shape[1]))], axis=1)
    basis, triangle = at.basis, at.triangle
    if triangle.shape[1]:
        basis, triangle = np.linalg.qr(ratio[:, :, None] * (basis @ triangle))
    residual, parameters = ratio * at.residual, ratio[:, :, None] * at.parameters
    return Linearised(at.point, residual, parameters, basis, triangle)


def borrowed(
    near: Linearised, known: Unknowns, windows: Windows, unknowns: Unknowns, point: Point
) -> Linearised:
    """Derivatives at a point from those near by, with columns of their own for what is new there.

    ``near`` belongs to the unknowns ``known`` on windows with the same states.
    """
    h, t = parameter_steps(unknowns, point.t), point.t
    new = [k for k, name in enumerate(unknowns.names) if name not in known.names]
    plants = [plant_at(windows, unknowns, t + h[k] * unit(len(t), k)) for k in new]
    plants.append(plant_at(windows, unknowns, t))
    r = windows.residuals(plants, point.starts).transpose(0, 2, 1, 3)
    r = r.reshape(len(plants), len(windows), -1)
    J = np.zeros((*near.residual.shape, len(unknowns)))
    for k, name in enumerate(unknowns.names):
        if name in known.names:
            J[:, :, k] = near.parameters[:, :, known.names.index(name)]
    for row, k in enumerate(new):
        J[:, : r.shape[2], k] = (r[row] - r[-1]) / h[k]
    residual = _with_priors(windows, point, r[-1])
    return replace(near, point=point, residual=residual, parameters=J)


@dataclass(frozen=True)
class Normal:
    """The quadratic model of the cost with the start states projected out.

    H = J'J + Lambda and g = J'r + Lambda t in the scaled unknowns.  An unknown that sits at a
    bound and would go beyond it takes no part: its column is zero.

    Attributes
    ----------
    hessian, gradient
        H (n_p, n_p) and g (n_p,).
    residual, derivatives
        r (n_windows, rows) and J (n_windows, rows, n_p), projected.
    precision
        Prior weights, zero for the unknowns that take no part, (n_p,).
    """

    hessian: np.ndarray
    gradient: np.ndarray
    residual: np.ndarray
    derivatives: np.ndarray
    precision: np.ndarray


def normal_equations(
    at: Linearised, unknowns: Unknowns, counted: np.ndarray | None = None
) -> Normal:
    """The quadratic model at a point, of all windows or of those ``counted``; see the class."""
    r, J = at.projected(at.residual[:, :, None])[:, :, 0], at.projected(at.parameters)
    if counted is not None:
        r, J = r * counted[:, None], J * counted[:, None, None]
    flat = J.reshape(J.shape[0] * J.shape[1], J.shape[2])
    gradient = flat.T @ r.ravel() + unknowns.precision * at.point.t
    free = ~unknowns.pinned(at.point.t, gradient)
    flat = flat * free
    hessian = flat.T @ flat + np.diag(np.where(free, unknowns.precision, 1.0))
    return Normal(hessian, gradient * free, r, flat.reshape(J.shape), unknowns.precision * free)


def plant_at(windows: Windows, unknowns: Unknowns, t: np.ndarray) -> Plant:
    return windows.plant.with_values(unknowns.values(t))


def parameter_steps(unknowns: Unknowns, t: np.ndarray) -> np.ndarray:
    """Steps of the scaled unknowns, turned round where they would leave the bounds."""
    room = (unknowns.upper - unknowns.prior) / unknowns.scale - t
    return np.where(room > PARAMETER_STEP, PARAMETER_STEP, -PARAMETER_STEP)


def unit(n: int, k: int) -> np.ndarray:
    """Unit vector k of n."""
    return np.eye(n)[k]
