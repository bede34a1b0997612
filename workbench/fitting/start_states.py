"""Fits in which only the start states of windows move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from workbench.fitting.gauss_newton import Fit, best_of_each, fit_windows, points_costs
from workbench.fitting.linearised import Point, moved
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows


def refit_starts(
    windows: Windows,
    values: Mapping[str, float] | None = None,
    near: Fit | None = None,
    iterations: int = 8,
    others: Sequence[np.ndarray] = (),
) -> Fit:
    """Only the start states move: how well a plant with given values predicts a recording.

    ``near`` is a fit of a plant with fewer effects, or other values, on the same windows: where
    to begin.  ``others`` are start states, (n_x, n_windows) each, for the windows which they suit
    better than the guess: from far away a window may not find its way.
    """
    nothing = Unknowns((), *(np.zeros(0) for _ in range(5)), held=values or {})
    start, at = None, None
    if others:
        points = [Point(np.zeros(0), starts) for starts in (windows.start, *others)]
        start = best_of_each(points_costs(windows, nothing, points).rows).point
    if near is not None:
        start = Point(np.zeros(0), carried(near.point.starts, near.windows, windows))
        at = near.derivatives if near.windows is windows else None
        at = moved(windows, nothing, at, start) if at else None
    return fit_windows(windows, nothing, start, iterations, at)


def carried(starts: np.ndarray, near: Windows, windows: Windows) -> np.ndarray:
    """Start states of windows for those of a plant with more states, shape (n_x, n_windows)."""
    found = windows.start.copy()
    names = list(windows.plant.state_list)
    for row, name in enumerate(near.plant.state_list):
        found[names.index(name)] = starts[row]
    return found
