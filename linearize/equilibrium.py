"""Operating points: values that make chosen rates vanish, and how far from rest they are.

Source: Newton's method with ever shorter steps, Dennis and Schnabel 1983, "Numerical Methods for
Unconstrained Optimization and Nonlinear Equations", Ch. 6.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from linearize.reduction import DesignModel
from workbench.errors import listed
from workbench.plant import require

STEPS, TOLERANCE = 60, 1e-9
STARTS = (0.5, 0.75, 0.25)  # of the ranges, tried where the usual start leads nowhere
SMALLEST = 1e-14  # relative, of a step and of a slope: what is left decides
PRESSURE = ".pressure_pa"


class NoOperatingPointError(ValueError):
    """What is asked of an operating point cannot be had."""


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
    nearby: bool = False,
) -> OperatingPoint:
    """The point with the given values, and with the free ones such that the named rates vanish.

    Damped Newton in scaled variables, at most so many steps; where that leads nowhere, from other
    starts too, unless a point is wanted to which the start itself leads (``nearby``).  Names are
    states and commands; what is neither given nor free keeps its initial or nominal value, and is
    where the search for a free one starts.

    Raises
    ------
    ValueError
        If there are not as many free values as rates.
    NoOperatingPointError
        If no solution is found.
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

    search = _Search(model, columns, rows, size, steps)
    values, left = search.newton(values)
    if not search.solved(left) and not nearby:
        values, left = search.elsewhere(values, left, names)
    if not search.solved(left):
        at = listed([f"{name} {value:.4g}" for name, value in given.items()]) or "any state"
        still = " and ".join(part for part in (", ".join(vanish[:-1]), vanish[-1]) if part)
        what = f"{model.plant.name}: no operating point at {at} where {still} stand still"
        raise NoOperatingPointError(what)
    rates = search.residual(values)
    return OperatingPoint(values[:n], values[n:], rates * model.scale, float(np.abs(rates).max()))


@dataclass(frozen=True)
class _Search:
    """Free values of a model, by column of (x, u), that bring rates to zero, by row of x.

    ``size`` are those of the free values, shape (n_free,); ``steps`` is the most of Newton's.
    """

    model: DesignModel
    columns: list[int]
    rows: list[int]
    size: np.ndarray
    steps: int

    def residual(self, at: np.ndarray) -> np.ndarray:
        """Rates over the scales of their states, (n_x,)."""
        n = len(self.model.states)
        return self.model.f(at[:n], at[n:])[0].full().ravel() / self.model.scale

    def slope(self, at: np.ndarray) -> np.ndarray:
        """How the rates over their scales answer the free values in their sizes."""
        n, scale = len(self.model.states), self.model.scale[self.rows, None]
        A, B, _, _ = (block.full() for block in self.model.jacobians(at[:n], at[n:]))
        return np.hstack([A, B])[np.ix_(self.rows, self.columns)] / scale * self.size

    def solved(self, left: np.ndarray) -> bool:
        """True where what is left of the rates is nothing."""
        return bool(np.abs(left).max(initial=0.0) <= 1e3 * TOLERANCE)

    def newton(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values after damped Newton steps, and what is left of the rates."""
        left = self.residual(values)[self.rows]
        for _ in range(self.steps):
            if np.abs(left).max(initial=0.0) < TOLERANCE:
                break
            move = -np.linalg.lstsq(self.slope(values), left, rcond=None)[0]
            move = np.clip(move, -1.0, 1.0) * self.size
            values, left = self._shortened(values, move, left)
        return values, left

    def _shortened(
        self, values: np.ndarray, move: np.ndarray, left: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The first of ever shorter moves that brings the rates down, else the shortest."""
        for share in 0.5 ** np.arange(12):
            trial = values.copy()
            trial[self.columns] += share * move
            found = self.residual(trial)[self.rows]
            if np.linalg.norm(found) < np.linalg.norm(left):
                break
        return trial, found

    def elsewhere(
        self, values: np.ndarray, left: np.ndarray, names: tuple[str, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same within the ranges of the free values, by a trust region from inside; the best.

        A spool that has shut leaves Newton nothing to go by, and a supply of another pressure
        brings it there from a start that served the usual one.  Values stay where they are if one
        has no range, as a pressure where the supply's is the ambient one.

        Source: Branch, Coleman and Li 1999, as in SciPy's ``least_squares``.
        """
        ends = [_ends(self.model, names[k], values[k]) for k in self.columns]
        low, high = np.array(ends).T / self.size
        if not np.less(low, high).all():
            return values, left

        def at(scaled: np.ndarray) -> np.ndarray:
            trial = values.copy()
            trial[self.columns] = scaled * self.size
            return trial

        def rates(scaled: np.ndarray) -> np.ndarray:
            return self.residual(at(scaled))[self.rows]

        for share in STARTS:
            found = least_squares(
                rates, low + share * (high - low), lambda z: self.slope(at(z)), (low, high),
                ftol=None, xtol=SMALLEST, gtol=SMALLEST,
            )  # fmt: skip
            after = rates(found.x)
            if np.linalg.norm(after) < np.linalg.norm(left):
                values, left = at(found.x), after
            if self.solved(left):
                break
        return values, left


def _ends(model: DesignModel, name: str, value: float) -> tuple[float, float]:
    """Where a free value is looked for: a command in its range, a pressure up to the supply's."""
    if name in model.commands:
        k = model.commands.index(name)
        signal, usual = model.plant.commands[k], model.command_scale[k]
        if np.isfinite(signal.upper - signal.lower):
            return signal.lower, signal.upper
        return value - usual, value + usual
    known = [v for n, v in model.plant.values.items() if n.endswith(PRESSURE)]
    if name.endswith(PRESSURE) and len(known) > 1:
        return min(known), max(known)
    usual = model.scale[model.states.index(name)]
    return value - usual, value + usual
