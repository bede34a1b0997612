"""Fits with less or more freedom: start states alone, and a search along each unknown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from workbench.fitting.gauss_newton import (
    CONVERGED,
    Fit,
    Point,
    fit_windows,
    moved,
    points_cost,
    unit,
)
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows

SEARCHES = 3
SEARCH_MOVES = (-0.8, -0.3, 0.3, 0.8)  # of the scale of an unknown


def searched(fit: Fit, iterations: int) -> Fit:
    """A fit that also looks along each unknown alone, and goes on from there.

    Near break-aways the cost is rough: a Gauss-Newton step in all unknowns at once may find no way
    down where a step in one of them does.
    """
    for _ in range(SEARCHES):
        points = [fit.point, *_neighbours(fit)]
        costs = points_cost(fit.windows, fit.unknowns, points)[1]
        best = int(np.argmin(costs))
        if not costs[best] < (1.0 - CONVERGED) * fit.cost:
            return fit
        fit = fit_windows(fit.windows, fit.unknowns, points[best], iterations)
    return fit


def _neighbours(fit: Fit) -> list[Point]:
    """Points that differ from a fit in one unknown."""
    t = fit.point.t
    moves = [move * unit(len(t), k) for k in range(len(t)) for move in SEARCH_MOVES]
    return [replace(fit.point, t=fit.unknowns.clipped(t + move)) for move in moves]


def refit_starts(
    windows: Windows,
    values: Mapping[str, float] | None = None,
    near: Fit | None = None,
    iterations: int = 8,
) -> Fit:
    """Only the start states move: how well a plant with given values predicts a recording.

    ``near`` is a fit of a plant with fewer effects, or other values, on the same windows: where
    to begin.
    """
    nothing = Unknowns((), *(np.zeros(0) for _ in range(5)), held=values or {})
    start, at = None, None
    if near is not None:
        start = Point(np.zeros(0), carried(near, windows))
        at = near.derivatives if near.windows.plant is windows.plant else None
        at = moved(windows, nothing, at, start) if at else None
    return fit_windows(windows, nothing, start, iterations, at)


def carried(near: Fit, windows: Windows) -> np.ndarray:
    """Start states of a fit for windows of a plant with more states, shape (n_x, n_windows)."""
    starts = windows.start.copy()
    names = list(windows.plant.state_list)
    for row, name in enumerate(near.windows.plant.state_list):
        starts[names.index(name)] = near.point.starts[row]
    return starts
