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
END_REACHED = 1e-9  # of a scaled unknown


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

    def part(self, kept: np.ndarray) -> Linearised:
        """The same of some of the windows."""
        point = Point(self.point.t, self.point.starts[:, kept])
        rows = (self.residual, self.parameters, self.basis, self.triangle)
        return Linearised(point, *(each[kept] for each in rows))

    def projected(self, rows: np.ndarray) -> np.ndarray:
        """What the start states cannot explain of columns (n_windows, rows, ...)."""
        flat = rows.reshape(*rows.shape[:2], int(np.prod(rows.shape[2:])))
        left = flat - self.basis @ (self.basis.transpose(0, 2, 1) @ flat)
        return left.reshape(rows.shape)


def linearise(
    windows: Windows, unknowns: Unknowns, point: Point, residual: np.ndarray | None = None
) -> Linearised:
    """Residuals and derivatives by one batch of simulations; see :class:`Linearised`.

    ``residual`` is that of the point, (n_y, n_windows, L), where it was run already.
    """
    n_x, n_p = windows.start.shape[0], len(unknowns)
    plants = [plant_at(windows, unknowns, point.t)] * n_x
    starts = [_stepped_start(windows, point, k) for k in range(n_x)]
    starts += [point.starts] * n_p
    h_p = parameter_steps(unknowns, point.t)
    plants += [plant_at(windows, unknowns, point.t + h_p[k] * unit(n_p, k)) for k in range(n_p)]
    here = _run_once(windows, unknowns, point) if residual is None else residual
    n, change = len(windows), windows.residuals(plants, np.array(starts)) - here
    columns = change.transpose(2, 1, 3, 0).reshape(n, here[:, 0].size, n_x + n_p)
    own = np.broadcast_to(np.eye(n_x), (n, n_x, n_x))
    J_x = np.concatenate([columns[:, :, :n_x] / START_STEP, own], axis=1)
    J_p = np.concatenate([columns[:, :, n_x:] / h_p, np.zeros((n, n_x, n_p))], axis=1)
    return Linearised(point, _with_priors(windows, point, _rows(here)), J_p, *_factors(J_x))


def _run_once(windows: Windows, unknowns: Unknowns, point: Point) -> np.ndarray:
    """Weighted residuals of a point, (n_y, n_windows, L)."""
    return windows.residuals([plant_at(windows, unknowns, point.t)], point.starts)[0]


def _rows(residual: np.ndarray) -> np.ndarray:
    """Residuals (n_y, n_windows, L) window by window, (n_windows, n_y L)."""
    return residual.transpose(1, 0, 2).reshape(residual.shape[1], -1)


def seen_at(windows: Windows, at: Linearised, point: Point, residual: np.ndarray) -> Linearised:
    """The same derivatives with the residual (n_y, n_windows, L) of another point.

    ``at`` may belong to other values of the same unknowns, or to a plant with other values.
    """
    return replace(at, point=point, residual=_with_priors(windows, point, _rows(residual)))


def secant(windows: Windows, at: Linearised, point: Point, residual: np.ndarray) -> Linearised:
    """Derivatives corrected by a step: they give the change of the residual it brought.

    With s the step of a window in scaled unknowns and start states, and d what its residual
    changed beyond J s, the smallest such correction is J + d s' / s's, window by window.

    Source: Broyden 1965, "A class of methods for solving nonlinear simultaneous equations".
    """
    after = seen_at(windows, at, point, residual)
    dt = point.t - at.point.t
    dx = ((point.starts - at.point.starts) / windows.start_deviation).T
    length = np.sum(dx**2, axis=1) + dt @ dt
    J_x = at.basis @ at.triangle
    beyond = after.residual - at.residual - at.parameters @ dt - (J_x @ dx[:, :, None])[:, :, 0]
    share = beyond / np.maximum(length, 1e-12)[:, None]
    parameters = at.parameters + share[:, :, None] * dt
    factors = _factors(J_x + share[:, :, None] * dx[:, None, :])
    return Linearised(point, after.residual, parameters, *factors)


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
    near: Linearised,
    known: tuple[Windows, Unknowns],
    windows: Windows,
    unknowns: Unknowns,
    point: Point,
    residual: np.ndarray | None = None,
) -> Linearised:
    """Derivatives at a point from those near by, with columns of their own for what is new there.

    ``near`` belongs to the windows and unknowns ``known``, of a plant with fewer states or effects.
    ``residual`` is that of the point, (n_y, n_windows, L), where it was run already.
    """
    h, t, n_p = parameter_steps(unknowns, point.t), point.t, len(unknowns)
    ours, theirs = list(windows.plant.state_list), list(known[0].plant.state_list)
    new_p = [k for k, name in enumerate(unknowns.names) if name not in known[1].names]
    new_x = [k for k, name in enumerate(ours) if name not in theirs]
    plants = [plant_at(windows, unknowns, t)] * len(new_x)
    plants += [plant_at(windows, unknowns, t + h[k] * unit(n_p, k)) for k in new_p]
    starts = [_stepped_start(windows, point, k) for k in new_x] + [point.starts] * len(new_p)
    here = _run_once(windows, unknowns, point) if residual is None else residual
    change = [_rows(each - here) for each in windows.residuals(plants, np.array(starts))]
    n, n_out, n_x = len(windows), here[:, 0].size, len(ours)
    J_x, J_p = np.zeros((n, n_out + n_x, n_x)), np.zeros((n, n_out + n_x, n_p))
    J_x[:, n_out:] = np.eye(n_x)
    before = near.basis @ near.triangle
    for k, name in enumerate(theirs):
        J_x[:, :n_out, ours.index(name)] = before[:, :n_out, k]
    for k, column in zip(new_x, change, strict=False):
        J_x[:, :n_out, k] = column / START_STEP
    for k, name in enumerate(unknowns.names):
        if name in known[1].names:
            j = known[1].names.index(name)
            unit_ratio = unknowns.scale[k] / known[1].scale[j]
            J_p[:, :n_out, k] = unit_ratio * near.parameters[:, :n_out, j]
    for k, column in zip(new_p, change[len(new_x) :], strict=True):
        J_p[:, :n_out, k] = column / h[k]
    return Linearised(point, _with_priors(windows, point, _rows(here)), J_p, *_factors(J_x))


def _stepped_start(windows: Windows, point: Point, k: int) -> np.ndarray:
    """Start states with state k one difference step away."""
    stepped = point.starts.copy()
    stepped[k] += START_STEP * windows.start_deviation[k]
    return stepped


def _factors(J_x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(basis, triangle) of derivatives in the start states, of which there may be none."""
    n, _, n_x = J_x.shape
    return np.linalg.qr(J_x) if n_x else (J_x, np.zeros((n, 0, 0)))


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
    at: Linearised, unknowns: Unknowns, counted: np.ndarray | None = None, each: float = 1.0
) -> Normal:
    """The quadratic model at a point, of all windows or of those ``counted``; see the class.

    Where ``each`` stands for so many windows the priors count as much less beside it.
    """
    precision = unknowns.precision / each
    r, J = at.projected(at.residual[:, :, None])[:, :, 0], at.projected(at.parameters)
    if counted is not None:
        r, J = r * counted[:, None], J * counted[:, None, None]
    flat = J.reshape(J.shape[0] * J.shape[1], J.shape[2])
    gradient = flat.T @ r.ravel() + precision * at.point.t
    free = ~unknowns.pinned(at.point.t, gradient)
    flat = flat * free
    hessian = flat.T @ flat + np.diag(np.where(free, precision, 1.0))
    return Normal(hessian, gradient * free, r, flat.reshape(J.shape), precision * free)


def stopping(normal: Normal, unknowns: Unknowns, t: np.ndarray) -> np.ndarray | None:
    """The step (n_p,) to the minimum within the ends; None where none would go beyond one.

    What would go beyond stops at its end, and the others follow by the quadratic model of those
    that are left, until none goes beyond.
    """
    left, dt = np.ones(len(t), dtype=bool), np.zeros(len(t))
    while left.any():
        g = normal.gradient + normal.hessian @ np.where(left, 0.0, dt)
        dt[left] = -np.linalg.solve(normal.hessian[np.ix_(left, left)], g[left])
        within = unknowns.clipped(t + dt) - t
        beyond = left & (np.abs(within - dt) > END_REACHED)
        if not beyond.any():
            break
        dt, left = np.where(beyond, within, dt), left & ~beyond
    return None if left.all() else dt


def plant_at(windows: Windows, unknowns: Unknowns, t: np.ndarray) -> Plant:
    return windows.plant.with_values(unknowns.values(t))


def parameter_steps(unknowns: Unknowns, t: np.ndarray) -> np.ndarray:
    """Steps of the scaled unknowns, turned round where they would leave the bounds.

    As long as the longer way to a bound where both are nearer.
    """
    below, above = t - unknowns.ends[0], unknowns.ends[1] - t
    up = (above > PARAMETER_STEP) | (above > below)
    return np.where(up, np.minimum(above, PARAMETER_STEP), -np.minimum(below, PARAMETER_STEP))


def unit(n: int, k: int) -> np.ndarray:
    """Unit vector k of n."""
    return np.eye(n)[k]
