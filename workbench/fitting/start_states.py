"""Fits in which only the start states of windows move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from workbench.fitting.continued import continued
from workbench.fitting.costs import best_of_each, points_costs
from workbench.fitting.gauss_newton import Fit, fit_windows
from workbench.fitting.linearised import Point, seen_at
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows

ITERATIONS = 8


def refit_starts(
    windows: Windows,
    values: Mapping[str, float] | None = None,
    near: Fit | None = None,
    iterations: int = ITERATIONS,
    others: Sequence[np.ndarray] = (),
) -> Fit:
    """Only the start states move: how well a plant with given values predicts a recording.

    ``near`` is a fit of a plant with fewer effects, or other values, on the same windows: where
    to begin, and where the states are the same with its derivatives.  ``others`` are start states,
    (n_x, n_windows) each, for the windows which they suit better than the guess: from far away a
    window may not find its way.
    """
    nothing = Unknowns((), *(np.zeros(0) for _ in range(5)), held=values or {})
    guess = windows.start if near is None else carried(near.point.starts, near.windows, windows)
    points = [Point(np.zeros(0), starts) for starts in (guess, *others)]
    start, at = best_of_each(points_costs(windows, nothing, points).rows), None
    if near is not None and near.windows.scale is windows.scale and _same_states(near, windows):
        at = seen_at(windows, near.derivatives, start.point, start.residual)
    return fit_windows(windows, nothing, start, iterations, at)


def as_it_came(base: Fit, held_out: Fit | None) -> tuple[Fit, Fit | None]:
    """A plant before a fit moved its parameters, on the windows of that fit and of its validation.

    Only start states are fitted, with the weights of the fit; they may begin where the fit has
    them, or where the window before ends, so that the plant as it came is not worse for a start
    that was not found.
    """
    values = base.windows.plant.values
    came, theirs = (
        fit and continued(refit_starts(fit.windows, values, others=[fit.point.starts]), ITERATIONS)
        for fit in (base, held_out)
    )
    return came, theirs


def _same_states(near: Fit, windows: Windows) -> bool:
    return list(near.windows.plant.state_list) == list(windows.plant.state_list)


def carried(starts: np.ndarray, near: Windows, windows: Windows) -> np.ndarray:
    """Start states (n_x, n_windows) of windows from those of a plant with other states.

    What that one does not have begins as guessed.
    """
    found = windows.start.copy()
    names = list(windows.plant.state_list)
    for row, name in enumerate(near.plant.state_list):
        if name in names:
            found[names.index(name)] = starts[row]
    return found
