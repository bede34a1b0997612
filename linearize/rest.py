"""Where in its region a mode could rest under the command of its point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from linearize.equilibrium import operating_point
from linearize.holding import holds_of, resting_states, whole_point
from linearize.modes import HybridModel, Mode

STEPS = 15  # of a search; one that takes longer ends in another region


@dataclass(frozen=True)
class Rest:
    """An equilibrium of the plant inside a mode's region; of what slides, a steady slide.

    state     of the design model, shape (n_x,)
    away      how far off the mode's point, largest share of a state's scale; 0 at the point
    """

    state: np.ndarray
    away: float


def rest_of(hybrid: HybridModel, mode: Mode) -> Rest | None:
    """The equilibrium under a mode's own command, or none where its region has none.

    A rest that static friction does not carry is none.  The search is that of
    :func:`linearize.equilibrium.operating_point`, from the mode's point on and nowhere else, in all
    states that the mode keeps.  A position whose rate is a velocity that is not held may go on: a
    steady slide.
    """
    held = [name for region in mode.box.values() for name in region.holds]
    model, point = hybrid.model.holding(held), whole_point(hybrid, mode)
    names, n = (*model.states, *model.commands), len(model.states)
    A = model.jacobians(point[:n], point[n:])[0].full()
    sliding = {model.states[k] for k in range(n) if np.count_nonzero(A[k]) == 1 and 1.0 in A[k]}
    free = tuple(name for name in mode.state_names if name not in sliding)
    try:
        at_point = dict(zip(names, point, strict=True))
        found = operating_point(model, at_point, free, free, STEPS, nearby=True)
    except ValueError:
        return None
    at = dict(zip(names, (*found.state, *found.command), strict=True))
    inside = mode.holds(at | dict.fromkeys(resting_states(hybrid, mode), 0.0))
    z = np.concatenate([found.state, found.command, [1.0]])[None]
    if not inside or any(hold.side(z)[0] for hold in holds_of(hybrid, mode)):
        return None
    return Rest(found.state, float(np.abs((found.state - point[:n]) / model.scale).max()))
