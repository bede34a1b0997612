"""Operating points: values that make chosen rates vanish, and how far from rest they are.

Source: Newton's method with ever shorter steps, Dennis and Schnabel 1983, "Numerical Methods for
Unconstrained Optimization and Nonlinear Equations", Ch. 6.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from linearize.reduction import DesignModel
from workbench.errors import listed
from workbench.plant import require

STEPS, TOLERANCE = 60, 1e-9


@dataclass(frozen=True)
class OperatingPoint:
    """A state and a command of a design model, with what is left of its rates.

    state, command     shapes (n_x,) and (n_u,)
    rates              dx/dt there, shape (n_x,)
    unrest             largest rate over the scale of its state, in 1/s; 0 at an equilibrium
    """

    state: np.ndarray
    command: np.ndarray
    rates: np.ndarray
    unrest: float


def operating_point(
    model: DesignModel,
    given: Mapping[str, float],
    free: tuple[str, ...] = (),
    vanish: tuple[str, ...] = (),
    steps: int = STEPS,
) -> OperatingPoint:
    """The point with the given values, and with the free ones such that the named rates vanish.

    Damped Newton in scaled variables, at most so many steps.  Names are states and commands; what
    is neither given nor free keeps its initial or nominal value, and is where the search for a free
    one starts.

    Raises
    ------
    ValueError
        If there are not as many free values as rates, or no solution is found.
    UnknownNameError
        If a name is neither a state nor a command.
    """
    if len(free) != len(vanish):
        raise ValueError(f"{len(free)} free values for {len(vanish)} rates that vanish")
    names = (*model.states, *model.commands)
    require((*given, *free, *vanish), names, model.plant.name)
    values = np.concatenate([model.initial, model.plant.nominal[0]])
    values = np.array([given.get(n, v) for n, v in zip(names, values, strict=True)])
    n, rows = len(model.states), [model.states.index(name) for name in vanish]
    columns = [names.index(name) for name in free]
    size = np.concatenate([model.scale, np.ones(len(model.commands))])[columns]

    def residual(at: np.ndarray) -> np.ndarray:
        return model.f(at[:n], at[n:])[0].full().ravel() / model.scale

    left = residual(values)[rows]
    for _ in range(steps):
        if np.abs(left).max(initial=0.0) < TOLERANCE:
            break
        A, B, _, _ = (block.full() for block in model.jacobians(values[:n], values[n:]))
        slope = np.hstack([A, B])[np.ix_(rows, columns)] / model.scale[rows, None] * size
        move = np.clip(-np.linalg.lstsq(slope, left, rcond=None)[0], -1.0, 1.0) * size
        values, left = _shortened(values, columns, move, left, residual, rows)
    if np.abs(left).max(initial=0.0) > 1e3 * TOLERANCE:
        at = listed([f"{name} {value:.4g}" for name, value in given.items()]) or "any state"
        still = " and ".join(part for part in (", ".join(vanish[:-1]), vanish[-1]) if part)
        raise ValueError(
            f"{model.plant.name}: no operating point at {at} where {still} stand still"
        )
    rates = residual(values)
    return OperatingPoint(values[:n], values[n:], rates * model.scale, float(np.abs(rates).max()))


def _shortened(values, columns, move, left, residual, rows):
    """The first of ever shorter moves that brings the residual down."""
    for share in 0.5 ** np.arange(12):
        trial = values.copy()
        trial[columns] += share * move
        found = residual(trial)[rows]
        if np.linalg.norm(found) < np.linalg.norm(left):
            break
    return trial, found
