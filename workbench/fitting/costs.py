"""What points of a fit cost: all run in one batch, and window by window.

Windows share the parameters alone.  Of points with the same parameters each window can therefore
have the start states under which it costs least.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.fitting.linearised import Point, plant_at
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows


@dataclass(frozen=True)
class Cost:
    """What a point costs: squared residuals, and with priors.

    by_window   share of each window, (n_windows,)
    residual    weighted, (n_y, n_windows, L)
    """

    point: Point
    chi2: float
    cost: float
    by_window: np.ndarray
    residual: np.ndarray


@dataclass(frozen=True)
class Costs:
    """Costs of a batch of points."""

    rows: tuple[Cost, ...]

    @property
    def best(self) -> Cost:
        """The cheapest."""
        return min(self.rows, key=lambda each: each.cost)


def best_of_each(costs: Sequence[Cost]) -> Cost:
    """The start states of each window from where they cost least.

    ``costs`` belong to points that differ in their start states alone: windows share no others.
    """
    chosen = np.argmin([each.by_window for each in costs], axis=0)
    starts, residual = costs[0].point.starts.copy(), costs[0].residual.copy()
    by_window = costs[0].by_window.copy()
    for k, each in enumerate(costs):
        own = chosen == k
        starts[:, own], residual[:, own] = each.point.starts[:, own], each.residual[:, own]
        by_window[own] = each.by_window[own]
    chi2, prior = float(np.sum(residual**2)), costs[0].cost - float(costs[0].by_window.sum())
    point = replace(costs[0].point, starts=starts)
    return Cost(point, chi2, float(by_window.sum()) + prior, by_window, residual)


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
        rows.append(Cost(point, float(squares.sum()), float(own.sum()) + prior, own, residual))
    return Costs(tuple(rows))


def costs_of_best_starts(
    windows: Windows, unknowns: Unknowns, points: list[Point], starts: np.ndarray
) -> Costs:
    """Costs of points whose windows begin as the point says or with ``starts``, as suits each.

    ``starts``, (n_x, n_windows), are those of a place near by.
    """
    return or_kept_starts(windows, unknowns, points_costs(windows, unknowns, points), starts)


def or_kept_starts(windows: Windows, unknowns: Unknowns, costs: Costs, starts: np.ndarray) -> Costs:
    """The same points where each window may begin with ``starts`` too; none is run again.

    Where a valve opens or a piston hits, the linear model of a start state holds nowhere.  One
    window that followed it would make a whole step dear, however well the others take it.
    """
    kept = points_costs(windows, unknowns, [Point(row.point.t, starts) for row in costs.rows])
    pairs = zip(costs.rows, kept.rows, strict=True)
    return Costs(tuple(best_of_each(pair) for pair in pairs))
