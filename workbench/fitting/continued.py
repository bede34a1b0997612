"""A way out of wrong start states: a window begins where the one before it ended.

What no sensor shows at the start of a window is guessed: armatures at rest, no current, no speed
of a mass behind a joint.  A window that begins while a valve switches is then up to a hundred
samples off in its pressures, and Gauss-Newton does not lead an armature from one stop to the other.
The fit bends parameters instead.  The run of the window before knows better: its last state, for
all that is not measured, is tried as the start of the next, kept by the windows which it suits
better, and the fit goes on.  What one window learns its successor has in the next round.

Source: the continuity of multiple shooting (Bock 1983), as a guess and not as a constraint: a model
that lacks something does not hold it.
"""

from __future__ import annotations

import numpy as np

from workbench.fitting.costs import best_of_each, points_costs
from workbench.fitting.gauss_newton import Fit, fit_windows, worth_it
from workbench.fitting.linearised import Point, plant_at
from workbench.fitting.windows import Windows

ROUNDS = 6


def continued(fit: Fit, iterations: int) -> Fit:
    """The same fit, or a lower one from starts that earlier windows give.

    ``iterations`` bound the fit of each round.
    """
    windows, unknowns = fit.windows, fit.unknowns
    for _ in range(ROUNDS):
        starts = ends_before(fit)
        if not np.any(starts != fit.point.starts):
            break
        points = [fit.point, Point(fit.point.t, starts)]
        begun = best_of_each(points_costs(windows, unknowns, points).rows)
        if not worth_it(begun.cost, fit):
            break
        fit = fit_windows(windows, unknowns, begun, iterations)
    return fit


def ends_before(fit: Fit) -> np.ndarray:
    """Start states (n_x, n_windows), those that are not measured from the window before.

    Where there is none, a gap between, or no finite end, all stay as they are.
    """
    windows, starts = fit.windows, fit.point.starts
    names = windows.plant.state_list
    hidden = np.array([name not in windows.plant.measured for name in names], dtype=bool)
    place = np.flatnonzero(_follows(windows))
    if not hidden.any() or not len(place):
        return starts
    ends = windows.ends(plant_at(windows, fit.unknowns, fit.point.t), starts)
    place = place[np.isfinite(ends[:, place - 1]).all(axis=0)]
    found = starts.copy()
    found[np.ix_(hidden, place)] = ends[np.ix_(hidden, place - 1)]
    return found


def _follows(windows: Windows) -> np.ndarray:
    """True for windows that begin where the one before ended, shape (n_windows,)."""
    rows = []
    for recording, firsts in zip(windows.recordings, windows.firsts, strict=True):
        own = np.array(firsts, dtype=int)
        gap = np.isin(own, recording.starts)
        rows.append((np.diff(own, prepend=-2 * windows.length) == windows.length) & ~gap)
    return np.concatenate(rows)
