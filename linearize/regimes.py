"""Where the flow into a chamber is choked and where not, read off the plant's own flow paths.

Source: ISO 6358 and the nozzle, physics.md 1.1; regimes by mode, physics.md 4.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

import casadi as ca
import numpy as np

from linearize.cuts import Interval
from linearize.reduction import DesignModel

GRID = 401
CHOKED = 1.0 - 1e-13  # of the choked flow
HALVINGS = 40


def flow_regimes(
    model: DesignModel, pressure: str, commands: Mapping[str, float]
) -> tuple[Interval, ...]:
    """Intervals of a chamber's pressure in which its widest open path is choked or subsonic.

    Between ambient and supply pressure, with the valve at ``commands``; each interval has its point
    in the middle, and the outer ones have no end.  None where the regime does not change.  A path
    is choked where psi(p_d/p_u) = 1 (physics.md 1.1).
    """
    chamber = pressure.rpartition(".")[0]
    choked = _choking(model, pressure, commands, chamber)
    supply = model.quantities("supply.pressure_pa", "atmosphere.pressure_pa")
    high_pa, low_pa = supply(model.initial, model.plant.nominal[0]).full().ravel()
    grid = np.linspace(low_pa, high_pa, GRID)
    there = choked(grid)
    changes = np.flatnonzero(there[1:] != there[:-1])
    edges = [low_pa, *(_edge(choked, *grid[k : k + 2]) for k in changes), high_pa]
    names = _named(there[[*changes, -1]])
    parts = [
        Interval(f"{chamber.replace('_', ' ')} {name}", low, high, 0.5 * (low + high))
        for name, low, high in zip(names, edges, edges[1:], strict=False)
    ]
    if len(parts) < 2:
        return ()
    first, last = parts[0], parts[-1]
    parts[0] = Interval(first.label, -inf, first.upper, first.point)
    parts[-1] = Interval(last.label, last.lower, inf, last.point)
    return tuple(parts)


def _named(choked: np.ndarray) -> list[str]:
    """Names of regimes by rising pressure; gas flows in at the lowest one, out at the highest."""
    ends = ("choked in", "choked out") if choked.sum() > 1 else ("choked", "choked")
    names = ["choked" if each else "subsonic" for each in choked]
    for place, name in zip((0, -1), ends, strict=True):
        if choked[place]:
            names[place] = name
    return names


def _choking(model: DesignModel, pressure: str, commands: Mapping[str, float], chamber: str):
    """Pressures, shape (n,) -> where the path that passes most is choked, shape (n,)."""
    paths = [path for path in model.plant.model.paths if path.balance == chamber]
    read = [ca.vertcat(*(p.flow_kg_s for p in paths)), ca.vertcat(*(p.choked_share for p in paths))]
    f = ca.Function("paths", [*model.symbols], model.reduced(read))
    row = model.states.index(pressure)
    nominal = zip(model.commands, model.plant.nominal[0], strict=True)
    u = np.array([commands.get(name, value) for name, value in nominal])

    def choked(pressures_pa: np.ndarray) -> np.ndarray:
        x = np.tile(model.initial[:, None], len(pressures_pa))
        x[row] = pressures_pa
        flows, shares = (v.full() for v in f(x, np.tile(u[:, None], len(pressures_pa))))
        return shares[np.abs(flows).max(axis=1).argmax()] >= CHOKED

    return choked


def _edge(choked, low_pa: float, high_pa: float) -> float:
    """Where the regime changes between two pressures, by halving."""
    before = choked(np.array([low_pa]))[0]
    for _ in range(HALVINGS):
        middle_pa = 0.5 * (low_pa + high_pa)
        if choked(np.array([middle_pa]))[0] == before:
            low_pa = middle_pa
        else:
            high_pa = middle_pa
    return float(high_pa)
