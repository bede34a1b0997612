"""Maximum a posteriori fit of parameters over windows with free start states.

    min over p, X0 of  sum_w |(y_w - yhat_w(p, x0_w)) / noise|^2 + |(p - p0) / s_p|^2
                       + sum_w |(x0_w - guess_w) / s_x|^2

by Gauss-Newton with Levenberg's damping.  Derivatives are forward differences over one large
batched simulation: at kinks they are the better ones, and with a dozen columns they are cheaper
than derivatives carried through the integrator (diagnosis.md 4.4).  The start states of a window
appear in that window alone, so they are eliminated window by window (an orthogonal projection).

Source: diagnosis.md 1.2 and 1.4; Golub and Pereyra's separable least squares in structure.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows
from workbench.plant import Plant

PARAMETER_STEP = 0.25  # of the scale of an unknown
START_STEP = 0.25  # of the deviation of a start state
LONGEST_STEP = 4.0  # of a scaled unknown in one step: beyond, the plant may be another one
LONGEST_START_STEP = 8.0  # of a start state, in its deviations
DAMPINGS = (0.0, 0.3, 3.0, 30.0)
AGAIN = 0.02  # relative fall of the cost above which derivatives are used once more
CONVERGED = 5e-3  # relative fall of the cost below which a fit has converged


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


@dataclass(frozen=True)
class Fit:
    """A fitted plant over windows.

    Attributes
    ----------
    windows, unknowns, point
        What was fitted, what was free, and where it ended.
    chi2
        Sum of the squared weighted residuals of the recorded samples, without priors.
    cost
        The same with the priors of parameters and start states.
    converged
        False where the last step still brought more than 0.5 %.
    derivatives
        Those that the last step used, with the residual of where the fit ended.
    """

    windows: Windows
    unknowns: Unknowns
    point: Point
    chi2: float
    cost: float
    converged: bool
    derivatives: Linearised = field(repr=False)

    @property
    def plant(self) -> Plant:
        """The plant at the fitted values."""
        return self.windows.plant.with_values(self.unknowns.values(self.point.t))

    @property
    def residual(self) -> np.ndarray:
        """Weighted residuals of the recorded samples, shape (n_y, n_windows, L)."""
        return self.windows.residuals([self.plant], self.point.starts)[0]


def fit_windows(
    windows: Windows,
    unknowns: Unknowns,
    start: Point | None = None,
    iterations: int = 8,
    at: Linearised | None = None,
) -> Fit:
    """Fit the unknowns and the start states; see the module's docstring.

    Every step is taken only if the cost falls; a batch of damped steps is tried at once.  As long
    as steps bring more than 2 %, the next uses the same derivatives again: they are the dear part.
    ``at`` are derivatives to begin with, taken near by.
    """
    point = start or Point(unknowns.scaled(windows.plant.values), windows.start)
    now = points_costs(windows, unknowns, [point]).best
    fresh, converged, stale = False, False, at is None
    for _ in range(iterations):
        if stale or at is None:
            at, fresh = linearise(windows, unknowns, point), True
        found = _stepped(windows, unknowns, at, point, now)
        fall = (now.cost - found.cost) / max(now.cost, 1e-12)
        if fall > 0:
            now = found
            point = found.point
        converged = fall < CONVERGED
        if converged and fresh:
            break
        stale, fresh = fall < AGAIN, False
        if not stale:
            at = moved(windows, unknowns, at, point)
    at = moved(windows, unknowns, at, point) if at else linearise(windows, unknowns, point)
    return Fit(windows, unknowns, point, now.chi2, now.cost, converged, at)


def _stepped(windows: Windows, unknowns: Unknowns, at: Linearised, point: Point, now: Cost) -> Cost:
    """The best of a batch of damped steps.

    Where none brings much, the windows that got worse under the full step are left out of the
    quadratic model, and its steps are tried again: a window that runs across a break-away has
    slopes that hold nowhere, and would hold all others back.
    """
    batch = points_costs(windows, unknowns, _trials(windows, unknowns, at, point))
    best = batch.best
    if now.cost - best.cost > AGAIN * now.cost:
        return best
    worse = batch.full.by_window > now.by_window
    if not worse.any() or worse.all():
        return best
    others = _trials(windows, unknowns, at, point, ~worse)
    again = points_costs(windows, unknowns, others).best
    return min(best, again, key=lambda each: each.cost)


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
    away = ((point.starts - windows.start) / windows.start_deviation).T
    residual = np.concatenate([r[-1], away], axis=1)
    return replace(near, point=point, residual=residual, parameters=J)


def _trials(
    windows: Windows,
    unknowns: Unknowns,
    at: Linearised,
    point: Point,
    counted: np.ndarray | None = None,
) -> list[Point]:
    """Damped steps from a point, within bounds; parameters follow the counted windows."""
    return [
        Point(unknowns.clipped(point.t + dt), point.starts + dx * windows.start_deviation)
        for dt, dx in _damped_steps(at, unknowns, counted)
    ]


def moved(windows: Windows, unknowns: Unknowns, at: Linearised, point: Point) -> Linearised:
    """The same derivatives with the residual of another point.

    ``at`` may belong to other values of the same unknowns, or to a plant with other values.
    """
    r = windows.residuals([plant_at(windows, unknowns, point.t)], point.starts)[0]
    away = ((point.starts - windows.start) / windows.start_deviation).T
    rows = r.transpose(1, 0, 2).reshape(len(windows), -1)
    return replace(at, point=point, residual=np.concatenate([rows, away], axis=1))


def best_start(windows: Windows, unknowns: Unknowns, points: list[Point]) -> Point:
    """The point of least cost, all run in one batch."""
    return points_costs(windows, unknowns, points).best.point


def linearise(windows: Windows, unknowns: Unknowns, point: Point) -> Linearised:
    """Residuals and derivatives by one batch of simulations; see :class:`Linearised`."""
    n_x, n_p = windows.start.shape[0], len(unknowns)
    h_x = START_STEP * windows.start_deviation
    plants = [plant_at(windows, unknowns, point.t)] * (1 + n_x)
    starts = [point.starts] * (1 + n_x + n_p)
    for k in range(n_x):
        moved = point.starts.copy()
        moved[k] += h_x[k]
        starts[1 + k] = moved
    h_p = parameter_steps(unknowns, point.t)
    plants += [plant_at(windows, unknowns, point.t + h_p[k] * unit(n_p, k)) for k in range(n_p)]
    r = windows.residuals(plants, np.array(starts)).transpose(0, 2, 1, 3)
    n = len(windows)
    r = r.reshape(len(plants), n, -1)
    away = ((point.starts - windows.start) / windows.start_deviation).T
    residual = np.concatenate([r[0], away], axis=1)
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


def unit(n: int, k: int) -> np.ndarray:
    """Unit vector k of n."""
    return np.eye(n)[k]


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


def _damped_steps(
    at: Linearised, unknowns: Unknowns, counted: np.ndarray | None = None
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Gauss-Newton steps of unknowns and start states, one per damping."""
    normal = normal_equations(at, unknowns, counted)
    H, g = normal.hessian, normal.gradient
    steps = []
    for damping in DAMPINGS:
        dt = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g) if len(g) else np.zeros(0)
        dt = np.clip(dt, -LONGEST_STEP, LONGEST_STEP)
        rest = at.residual + (at.parameters @ dt)
        back = (at.basis.transpose(0, 2, 1) @ rest[:, :, None])[:, :, 0]
        dx = -np.linalg.solve(at.triangle, back[:, :, None])[:, :, 0] if back.shape[1] else back
        dx = np.clip(dx.T / (1.0 + damping), -LONGEST_START_STEP, LONGEST_START_STEP)
        steps.append((dt, dx))
    return steps


@dataclass(frozen=True)
class Cost:
    """What a point costs: squared residuals, and with priors; ``by_window`` has (n_windows,)."""

    point: Point
    chi2: float
    cost: float
    by_window: np.ndarray


@dataclass(frozen=True)
class Costs:
    """Costs of a batch of points."""

    rows: tuple[Cost, ...]

    @property
    def best(self) -> Cost:
        """The cheapest."""
        return min(self.rows, key=lambda each: each.cost)

    @property
    def full(self) -> Cost:
        """The first of the batch: of damped steps the undamped one."""
        return self.rows[0]


def points_costs(windows: Windows, unknowns: Unknowns, points: list[Point]) -> Costs:
    """Costs of points, all run in one batch."""
    plants = [plant_at(windows, unknowns, point.t) for point in points]
    r = windows.residuals(plants, np.array([point.starts for point in points]))
    rows = []
    for point, residual in zip(points, r, strict=True):
        squares = np.sum(residual**2, axis=(0, 2))
        away = (point.starts - windows.start) / windows.start_deviation
        own = squares + np.sum(away**2, axis=0)
        prior = float(np.sum(unknowns.precision * point.t**2))
        rows.append(Cost(point, float(squares.sum()), float(own.sum()) + prior, own))
    return Costs(tuple(rows))


def plant_at(windows: Windows, unknowns: Unknowns, t: np.ndarray) -> Plant:
    return windows.plant.with_values(unknowns.values(t))


def parameter_steps(unknowns: Unknowns, t: np.ndarray) -> np.ndarray:
    """Steps of the scaled unknowns, turned round where they would leave the bounds."""
    room = (unknowns.upper - unknowns.prior) / unknowns.scale - t
    return np.where(room > PARAMETER_STEP, PARAMETER_STEP, -PARAMETER_STEP)
