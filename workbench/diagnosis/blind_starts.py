"""Start states that a model does not show and a candidate would.

The temperature of a gas that gives off no heat is such a state: no pressure depends on it.  With a
candidate heat flow the pressure does, and by derivatives of the model as it is no start state would
take part in what the candidate explains: the chamber that was filled warm would never be found.  So
the derivatives in these start states are taken anew with each candidate in place.

Only where nothing moves: there states are few, and windows long enough for a start to matter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.fitting.linearised import START_STEP, Linearised, Point
from workbench.fitting.start_states import refit_starts
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.window_length import moves
from workbench.fitting.windows import Windows
from workbench.plant import Plant

UNSEEN = 1e-6  # of what one deviation of a start state adds to its own prior's residual


def blind_starts(plant: Plant, at: Linearised) -> list[int]:
    """Rows of the states whose start no output shows; none where something moves."""
    if moves(plant):
        return []
    n_x = at.triangle.shape[1]
    shown = np.abs((at.basis @ at.triangle)[:, : at.residual.shape[1] - n_x])
    return [k for k in range(n_x) if shown[:, :, k].max() < UNSEEN]


def settled(windows: Windows, unknowns: Unknowns, point: Point) -> Point:
    """The point with the start states that suit its parameters best.

    From start states that were blind so far a step in all unknowns at once would lead back: with
    the gas as warm as the wall nothing answers a coefficient of heat, and only its prior pulls.
    """
    return replace(point, starts=refit_starts(windows, unknowns.values(point.t)).point.starts)


def freed(
    at: Linearised,
    base: Plant,
    windows: Windows,
    plants: list[Plant],
    starts: np.ndarray,
    residuals: np.ndarray,
) -> list[Linearised]:
    """For each of the plants the derivatives at the base with those in blind start states its own.

    ``windows`` belong to the plants, ``starts`` (n_x, n_windows) to their states, and ``residuals``
    (n_plants, n_y, n_windows, L) are theirs.
    """
    n_out = residuals.shape[1] * residuals.shape[3]
    J_x = np.repeat((at.basis @ at.triangle)[None], len(plants), axis=0)
    theirs, ours = list(windows.plant.state_list), list(base.state_list)
    for k in blind_starts(base, at):
        row = theirs.index(ours[k])
        stepped = starts.copy()
        stepped[row] += START_STEP * windows.start_deviation[row]
        change = (windows.residuals(plants, stepped) - residuals) / START_STEP
        J_x[:, :, :n_out, k] = change.transpose(0, 2, 1, 3).reshape(len(plants), -1, n_out)
    return [replace(at, basis=Q, triangle=R) for Q, R in map(np.linalg.qr, J_x)]
