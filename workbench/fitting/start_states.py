"""Fits in which only the start states of windows move."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from workbench.fitting.gauss_newton import Fit, fit_windows, points_costs
from workbench.fitting.linearised import Point, seen_at
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows


def refit_starts(
    windows: Windows,
    values: Mapping[str, float] | None = None,
    near: Fit | None = None,
    iterations: int = 8,
) -> Fit:
    """Only the start states move: how well a plant with given values predicts a recording.

    ``near`` is a fit of a plant with fewer effects, or other values, on the same windows: where
    to begin, and where the states are the same with its derivatives.
    """
    nothing = Unknowns((), *(np.zeros(0) for _ in range(5)), held=values or {})
    if near is None:
        return fit_windows(windows, nothing, iterations=iterations)
    point = Point(np.zeros(0), carried(near.point.starts, near.windows, windows))
    start, at = points_costs(windows, nothing, [point]).best, None
    states, theirs = (list(each.plant.state_list) for each in (windows, near.windows))
    if near.windows.scale is windows.scale and theirs == states:
        at = seen_at(windows, near.derivatives, point, start.residual)
    return fit_windows(windows, nothing, start, iterations, at)


def carried(starts: np.ndarray, near: Windows, windows: Windows) -> np.ndarray:
    """Start states of windows for those of a plant with more states, shape (n_x, n_windows)."""
    found = windows.start.copy()
    names = list(windows.plant.state_list)
    for row, name in enumerate(near.plant.state_list):
        found[names.index(name)] = starts[row]
    return found
