"""Maximum a posteriori fit of parameters over windows with free start states.

    min over p, X0 of  sum_w |(y_w - yhat_w(p, x0_w)) / noise|^2 + |(p - p0) / s_p|^2
                       + sum_w |(x0_w - guess_w) / s_x|^2

by Gauss-Newton with Levenberg's damping; derivatives from :mod:`workbench.fitting.linearised`.

Source: diagnosis.md 1.2 and 1.4.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from workbench.fitting.beyond_noise import beyond_noise, whole_beyond_noise
from workbench.fitting.costs import (
    Cost,
    Costs,
    best_of_each,
    or_kept_starts,
    points_costs,
)
from workbench.fitting.linearised import (
    Linearised,
    Point,
    linearise,
    normal_equations,
    secant,
    seen_at,
    stopping,
)
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import UNSEEN_PENALTY, Windows
from workbench.plant import Plant

LONGEST_STEP = 4.0  # of a scaled unknown in one step: beyond, the plant may be another one
LONGEST_FREE_STEP = 40.0  # of one without a prior, which is counted in tenths of its typical size
LONGEST_START_STEP = 8.0  # of a start state, in its deviations
DAMPINGS = (0.0, 0.3, 3.0, 30.0)
HALF = 0.5  # of the fall that the quadratic model promises: then a step needs no rivals
ASTRAY = 4.0  # times its cost: so dear a window gets by start states where it keeps them instead
AGAIN = 0.02  # fall, in parts of the misfit, above which derivatives are used once more
CONVERGED = 0.01  # the same, below which a fit has converged
RESCUE_RUNS = 14  # of the plant, at most, for a step to be rescued
CHEAP = 1.0 / 3.0  # of the runs that derivatives take: a rescue that costs less is not put off
WORTH_IT = 0.003  # of the misfit, for a fit to go on from there


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
        False where the last step still brought more than 1 % of the misfit beyond noise, or was
        made with derivatives of a place before it.  True in a dent of a rough cost too, where no
        step leads lower though the linear model promises it.
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
        n_y, n, length = self.windows.measured.shape
        rows = self.derivatives.residual[:, : n_y * length]
        return rows.reshape(n, n_y, length).transpose(1, 0, 2)

    @property
    def squares(self) -> np.ndarray:
        """Sum of the squared residuals of each output and window, (n_y, n_windows)."""
        return np.sum(self.residual**2, axis=2)

    @cached_property
    def misfit(self) -> float:
        """Squared error beyond sensor noise, with the price of the priors, at least 1."""
        return beyond_noise(self.windows, self.squares, self.cost - self.chi2)

    @property
    def unsimulated(self) -> np.ndarray:
        """True for recorded samples that could not be simulated, (n_y, n_windows, L).

        Their residual is a penalty, no error.
        """
        return np.abs(self.residual) == UNSEEN_PENALTY


def fit_windows(
    windows: Windows,
    unknowns: Unknowns,
    start: Point | Cost | None = None,
    iterations: int = 8,
    at: Linearised | None = None,
) -> Fit:
    """Fit the unknowns and the start states; see the module's docstring.

    Every step is taken only if the cost falls.  As long as steps bring more than 2 % of the misfit
    beyond noise, the next uses the same derivatives, corrected by what the step showed: they are
    the dear part.  One that brings less with these is made once more with derivatives taken anew,
    in the same iteration, and is rescued (:func:`_rescued`) with such alone: a rescue is dear too.
    Of a plant with many states and unknowns it costs a fraction of them, and is tried at once.
    Parts of the whole cost would be no measure: most of it is noise that no fit takes away, and
    effects that differ by less would be compared half fitted.
    ``start`` is a point, or what it costs where it was run already.  ``at`` are derivatives to
    begin with, taken near by, with the residual of the start.
    """
    start = start or Point(unknowns.scaled(windows.plant.values), windows.start)
    now = start if isinstance(start, Cost) else points_costs(windows, unknowns, [start]).best
    cheap = len(unknowns) + len(windows.start) >= RESCUE_RUNS / CHEAP
    fresh, converged, stale = False, False, at is None
    for _ in range(iterations):
        if stale or at is None:
            at, fresh = linearise(windows, unknowns, now.point, now.residual), True
        now, fall = _advanced(windows, unknowns, at, now, fresh or cheap)
        if len(unknowns) and not fresh and fall < AGAIN:
            at, fresh = linearise(windows, unknowns, now.point, now.residual), True
            now, fall = _advanced(windows, unknowns, at, now, rescue=True)
        converged = fresh and fall < CONVERGED
        if converged:
            break
        stale, fresh = fall < AGAIN, False
        if not stale:
            at = secant(windows, at, now.point, now.residual)
    at = at or linearise(windows, unknowns, now.point, now.residual)
    at = seen_at(windows, at, now.point, now.residual)
    return Fit(windows, unknowns, now.point, now.chi2, now.cost, converged, at)


def follow(
    windows: Windows, unknowns: Unknowns, start: Cost, at: Linearised, iterations: int
) -> Fit:
    """Steps with derivatives ``at`` taken near by, while they bring more than 2 % of the misfit.

    No derivative is taken anew, which is what makes a fit dear: where it ends may be short of the
    minimum.
    """
    now = start
    for _ in range(iterations):
        now, fall = _advanced(windows, unknowns, at, now, rescue=True)
        if fall < AGAIN:
            break
        at = secant(windows, at, now.point, now.residual)
    at = seen_at(windows, at, now.point, now.residual)
    return Fit(windows, unknowns, now.point, now.chi2, now.cost, False, at)


def _advanced(
    windows: Windows, unknowns: Unknowns, at: Linearised, now: Cost, rescue: bool
) -> tuple[Cost, float]:
    """Where a step leads, or where it began if that costs less; and its fall, of the misfit."""
    found = _stepped(windows, unknowns, at, now, rescue)
    fall = (now.cost - found.cost) / whole_beyond_noise(windows, now.cost)
    return min(now, found, key=lambda each: each.cost), fall


def _stepped(windows: Windows, unknowns: Unknowns, at: Linearised, now: Cost, rescue: bool) -> Cost:
    """The full step where it keeps half of what it promises, else the best of several damped ones.

    Where none brings much, others are tried on request; see :func:`_rescued`.  Start states alone
    need no others: every window has what suits it best already.
    """
    full, *damped = _damped_steps(at, unknowns)
    tried = _costs_after(windows, unknowns, now, [full])
    found, promised = _best(tried, unknowns, now), now.cost - _promised(at, unknowns, full)
    if now.cost - found.cost > HALF * promised > 0:
        return found
    tried = Costs((*tried.rows, *_costs_after(windows, unknowns, now, damped).rows))
    found = _best(tried, unknowns, now)
    much = now.cost - found.cost > AGAIN * whole_beyond_noise(windows, now.cost)
    if much or not rescue or not len(unknowns):
        return found
    return _rescued(windows, unknowns, at, now, tried)


def _best(tried: Costs, unknowns: Unknowns, now: Cost) -> Cost:
    """The cheapest step; where start states alone move, every window takes its own, or stays."""
    return tried.best if len(unknowns) else best_of_each((now, *tried.rows))


def _rescued(windows: Windows, unknowns: Unknowns, at: Linearised, now: Cost, tried: Costs) -> Cost:
    """The best of steps that hardly lower the cost, and of steps from what holds them back.

    Windows that got worse under the full step, the first one tried, are left out of the quadratic
    model, and its steps are tried again: a window that runs across a break-away has slopes that
    hold nowhere.  Where one costs several times what it did, its start states have gone astray, as
    those of an armature next to its stop do by a linear model: then every window may keep its own
    in all of the steps.  And what would go beyond what is believed of it stops there, and others go
    with that: clipped alone, it may be left short of its end, where it does not count as held.
    """
    full = tried.rows[0]
    if stopping := _stopping_steps(at, unknowns):
        tried = Costs((*tried.rows, *_costs_after(windows, unknowns, now, stopping).rows))
    worse = full.by_window > now.by_window
    if worse.any() and not worse.all():
        less = _damped_steps(at, unknowns, ~worse)
        tried = Costs((*tried.rows, *_costs_after(windows, unknowns, now, less).rows))
    if np.any(full.by_window > ASTRAY * now.by_window):
        tried = or_kept_starts(windows, unknowns, tried, now.point.starts)
    return tried.best


def worth_it(cost: float, fit: Fit) -> bool:
    """Whether a place costs so much less than a fit that fitting goes on from there."""
    return cost < fit.cost - WORTH_IT * whole_beyond_noise(fit.windows, fit.cost)


Step = tuple[np.ndarray, np.ndarray]  # of the scaled unknowns, and of the scaled start states


def _costs_after(windows: Windows, unknowns: Unknowns, now: Cost, steps: list[Step]) -> Costs:
    """What steps cost, all run in one batch."""
    points = [_after(windows, unknowns, now.point, step) for step in steps]
    return points_costs(windows, unknowns, points)


def _after(windows: Windows, unknowns: Unknowns, point: Point, step: Step) -> Point:
    """A step from a point, within bounds."""
    dt, dx = step
    return Point(unknowns.clipped(point.t + dt), point.starts + dx * windows.start_deviation)


def _promised(at: Linearised, unknowns: Unknowns, step: Step) -> float:
    """The cost after a step by the quadratic model."""
    dt, dx = step
    moved_by = at.parameters @ dt + (at.basis @ (at.triangle @ dx.T[:, :, None]))[:, :, 0]
    prior = np.sum(unknowns.precision * (at.point.t + dt) ** 2)
    return float(np.sum((at.residual + moved_by) ** 2) + prior)


def _damped_steps(
    at: Linearised, unknowns: Unknowns, counted: np.ndarray | None = None
) -> list[Step]:
    """Gauss-Newton steps of unknowns and start states, one per damping; the first is undamped.

    Parameters follow the ``counted`` windows.
    """
    normal = normal_equations(at, unknowns, counted)
    H, g = normal.hessian, normal.gradient
    longest = np.where(unknowns.with_prior, LONGEST_STEP, LONGEST_FREE_STEP)
    steps = []
    for damping in DAMPINGS:
        dt = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g) if len(g) else np.zeros(0)
        dt = np.clip(dt, -longest, longest)
        steps.append((dt, _starts_with(at, dt, 1.0 / (1.0 + damping))))
    return steps


def _stopping_steps(at: Linearised, unknowns: Unknowns) -> list[Step]:
    """The undamped step that ends where what is believed does; none where nothing goes beyond."""
    if not np.isfinite(unknowns.reach).any():
        return []
    dt = stopping(normal_equations(at, unknowns), unknowns, at.point.t)
    return [] if dt is None else [(dt, _starts_with(at, dt))]


def _starts_with(at: Linearised, dt: np.ndarray, share: float = 1.0) -> np.ndarray:
    """The step of the scaled start states that suits one of the unknowns, (n_x, n_windows)."""
    rest = at.residual + (at.parameters @ dt)
    back = (at.basis.transpose(0, 2, 1) @ rest[:, :, None])[:, :, 0]
    dx = -np.linalg.solve(at.triangle, back[:, :, None])[:, :, 0] if back.shape[1] else back
    return np.clip(share * dx.T, -LONGEST_START_STEP, LONGEST_START_STEP)


def beside(fit: Fit, dt: np.ndarray) -> Point:
    """The point a step (n_p,) of the scaled unknowns away, start states as the linear model has."""
    step = (dt, _starts_with(fit.derivatives, dt))
    return _after(fit.windows, fit.unknowns, fit.point, step)


def leap(fit: Fit) -> Point:
    """Where the linear model has its minimum within the ends, whatever it costs there."""
    at, unknowns = fit.derivatives, fit.unknowns
    step, *_ = _stopping_steps(at, unknowns) or _damped_steps(at, unknowns)
    return _after(fit.windows, unknowns, fit.point, step)
