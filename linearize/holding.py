"""What a mode holds, and when it lets go: dry friction at rest, a stop that carries.

Held states come in pairs, a position and its velocity: the velocity is zero and the position
stays.  A mode that holds at a place, a stop or Neutral, says by guards of its own when it ends.  In
any other, the signal whose interval holds is let go upwards when its rate points upwards everywhere
just above the interval, downwards when it points downwards everywhere just below,

    min over s of f_s(x, u; s) > 0,   max over s of f_s(x, u; s) < 0,

with s between the interval and the next point of a mode, and f_s without what is viscous.  Of a
slide with Stribeck friction the least lies at the peak of static friction.  Both are affine in
(x, u), as the modes are: f_s is linearised where it is least.

Source: Karnopp 1985 (a velocity that rests, and the force that ends it).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from linearize.cuts import Interval
from linearize.modes import HybridModel, Mode
from linearize.reduction import DesignModel
from workbench.called import result

PROBES = 40


@dataclass(frozen=True)
class Hold:
    """The two sides on which a holding interval is left, over rows z = (x, u, 1).

    column            place in z of the signal whose interval holds
    below, above      values of it just outside of the interval; ``inside`` is its point
    rates             its rate where it is hindered most, above and below; rows over z, (2, n_z)
    """

    column: int
    below: float
    above: float
    inside: float
    rates: np.ndarray

    @property
    def interval(self) -> tuple[int, float, float, float]:
        """Where it holds: column, just below, just above, inside."""
        return self.column, self.below, self.above, self.inside

    def side(self, z: np.ndarray) -> np.ndarray:
        """1 where it lets go upwards, -1 downwards, 0 where it holds; shape (n,) for rows z."""
        up, down = self.rates @ z.T
        return np.where(up > 0.0, 1, np.where(down < 0.0, -1, 0))


def holds_of(hybrid: HybridModel, mode: Mode) -> tuple[Hold, ...]:
    """How a mode is left in whose box velocities rest; guards say so where a place is held."""
    resting = resting_states(hybrid, mode)
    cut = {s: r for s, r in mode.box.items() if s in resting and isinstance(r, Interval)}
    return tuple(_hold(hybrid, mode, signal, region) for signal, region in cut.items())


def resting_states(hybrid: HybridModel, mode: Mode) -> tuple[str, ...]:
    """Held states that are zero: all but those that are integrals of another one, as x is of v."""
    held = [name for region in mode.box.values() for name in region.holds]
    if not held:
        return ()
    model, point = hybrid.model, whole_point(hybrid, mode)
    n = len(model.states)
    A = model.jacobians(point[:n], point[n:])[0].full()
    rows = [model.states.index(name) for name in held]
    integrals = {i for i in rows for j in rows if A[i, j] == 1.0 and np.count_nonzero(A[i]) == 1}
    return tuple(model.states[i] for i in rows if i not in integrals)


def whole_point(hybrid: HybridModel, mode: Mode) -> np.ndarray:
    """The mode's point with all states and commands of the design model, shape (n_x + n_u,)."""
    model = hybrid.model
    given = {**mode.elsewhere, **{name: region.point for name, region in mode.box.items()}}
    given |= dict(zip(mode.state_names, mode.state, strict=True))
    states = [given.get(n, v) for n, v in zip(model.states, model.initial, strict=True)]
    return np.array([*states, *mode.sent(model, mode.command)])


def _hold(hybrid: HybridModel, mode: Mode, signal: str, interval: Interval) -> Hold:
    others = [name for r in mode.box.values() if r is not interval for name in r.holds]
    model, point = hybrid.model.holding(others), whole_point(hybrid, mode)
    column = model.states.index(signal)
    below, above = float(np.nextafter(interval.lower, -np.inf)), interval.upper
    rates = [
        least_rate(model, point, column, _probes(hybrid, signal, edge, side), side)
        for edge, side in ((above, 1), (below, -1))
    ]
    return Hold(column, below, above, interval.point, np.array(rates))


def _probes(hybrid: HybridModel, signal: str, edge: float, side: int) -> np.ndarray:
    """Values of the signal from the edge of its holding interval to the next point of a mode."""
    points = [mode.box[signal].point for mode in hybrid.modes if signal in mode.box]
    beyond = [point for point in points if side * (point - edge) > 0.0]
    end = min(beyond, key=lambda point: abs(point - edge), default=edge)
    return edge + (end - edge) * np.linspace(0.0, 1.0, PROBES) ** 2


def least_rate(
    model: DesignModel, point: np.ndarray, column: int, probes: np.ndarray, side: int
) -> np.ndarray:
    """The rate of a signal where it points outwards least, as a row over (x, u, 1).

    ``probes``, (n,), are values of the signal in ``column`` that are tried at a point (x, u), shape
    (n_x + n_u,); the side outwards is 1 or -1.  What hinders in proportion to the signal, by its
    slope at the last probe, does not count: viscous friction holds nothing.
    """
    n = len(model.states)
    around = np.tile(point[:, None], len(probes))
    around[column] = probes
    rates = result(model.f.map(len(probes)), around[:n], around[n:])[column]
    last = model.jacobians(around[:n, -1], around[n:, -1])[0].full()[column, column]
    rates = rates - last * (probes - probes[0])
    worst = around[:, np.argmin(side * rates)]
    A, B = (block.full()[column] for block in model.jacobians(worst[:n], worst[n:])[:2])
    row = np.concatenate([A, B])
    row[column] = 0.0
    return np.append(row, side * np.min(side * rates) - row @ worst)
