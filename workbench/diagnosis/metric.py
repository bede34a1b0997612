"""The nuisance-free metric M of the projected profile scan; equations in :mod:`.scan`.

Source: diagnosis.md 1.4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from workbench.fitting.linearised import Linearised, Normal, Point, linearise, normal_equations
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows

FEWEST_WINDOWS = 24  # that a scan looks at; half of them where there are more
LARGEST_STEP = 6.0  # prior deviations a nuisance may move in one linear step


@dataclass(frozen=True)
class Metric:
    """The nuisance-free metric M at a fitted point; see the scan's docstring."""

    at: Linearised
    normal: Normal

    @property
    def cost(self) -> float:
        """c(0): the projected cost of the model as it is."""
        return self._value(self.normal.residual, self.normal.gradient)

    def rows(self, residuals: np.ndarray) -> np.ndarray:
        """Residuals (n, n_y, n_windows, L) as projected rows, shape (n, n_windows, rows)."""
        n, n_y, n_w, length = residuals.shape
        flat = residuals.transpose(2, 1, 3, 0).reshape(n_w, n_y * length, n)
        away = self.at.residual[:, n_y * length :, None]
        full = np.concatenate([flat, np.repeat(away, n, axis=2)], axis=1)
        return np.ascontiguousarray(self.at.projected(full).transpose(2, 0, 1))  # read many times

    def explained(self, row: np.ndarray) -> tuple[float, np.ndarray]:
        """(cost, linear step of the scaled unknowns) for projected rows (n_windows, rows)."""
        flat = self._columns
        gradient = flat.T @ row.ravel() + self.normal.precision * self.at.point.t
        step = -np.linalg.solve(self.normal.hessian, gradient) if len(gradient) else gradient
        return self._value(row, gradient), np.clip(step, -LARGEST_STEP, LARGEST_STEP)

    def signature(self, row: np.ndarray) -> tuple[np.ndarray, float]:
        """(what the nuisances cannot imitate of a change, share of it that they can).

        The first is what a least-squares fit of the change by the nuisances leaves, its priors
        among the rows: the products of two of them are d1'M d2, which those of M d1 and M d2 are
        only without priors.
        """
        flat = self._columns
        change = row.ravel()
        if not flat.shape[1]:
            return change, 0.0
        moved = np.linalg.solve(self.normal.hessian, flat.T @ change)
        left, whole = change - flat @ moved, float(change @ change)
        share = 1.0 - float(change @ left) / whole if whole > 0 else 1.0
        priced = np.sqrt(self.normal.precision) * moved
        return np.concatenate([left, priced]), float(np.clip(share, 0.0, 1.0))

    def shown(self, row: np.ndarray) -> float:
        """What a change adds to the projected cost where nothing else is wrong: d'Md."""
        flat, change = self._columns, row.ravel()
        along = flat.T @ change
        imitated = float(along @ np.linalg.solve(self.normal.hessian, along)) if len(along) else 0.0
        return max(float(change @ change) - imitated, 0.0)

    def gram(self, changes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(D'MD, D'Mr) of changes D as rows (n, rows), with the prior's offset in the second.

        An amount a of each costs c(a) = c(0) + 2 a'D'Mr + a'D'MD a.
        """
        flat = self._columns
        along = changes @ flat
        gram, slope = changes @ changes.T, changes @ self.normal.residual.ravel()
        if not flat.shape[1]:
            return gram, slope
        solved = np.linalg.solve(self.normal.hessian, np.c_[along.T, self.normal.gradient])
        return gram - along @ solved[:, :-1], slope - along @ solved[:, -1]

    @property
    def _columns(self) -> np.ndarray:
        J = self.normal.derivatives
        return J.reshape(J.shape[0] * J.shape[1], J.shape[2])

    def _value(self, row: np.ndarray, gradient: np.ndarray) -> float:
        prior = float(np.sum(self.normal.precision * self.at.point.t**2))
        gained = (
            float(gradient @ np.linalg.solve(self.normal.hessian, gradient))
            if len(gradient)
            else 0.0
        )
        return float(row.ravel() @ row.ravel()) + prior - gained


def metric_at(
    windows: Windows,
    unknowns: Unknowns,
    point: Point,
    at: Linearised | None = None,
    each: float = 1.0,
) -> Metric:
    """The metric M at a point, from derivatives there or from one batch of simulations.

    ``each`` is how many windows one stands for: what it says of costs counts as often.
    """
    at = at or linearise(windows, unknowns, point)
    return Metric(at, normal_equations(at, unknowns, each=each))


def every_second(
    windows: Windows,
    unknowns: Unknowns,
    point: Point,
    at: Linearised | None = None,
    each: float = 1.0,
) -> tuple[Windows, Point, Metric, float]:
    """Every second window where there are many: (windows, point, metric, how many each counts).

    ``each`` is how many one of the windows counts before.
    """
    total = len(windows)
    windows, kept = windows.part(max(total // 2, FEWEST_WINDOWS))
    point, at = replace(point, starts=point.starts[:, kept]), at.part(kept) if at else None
    of_all = each * total / len(windows)
    return windows, point, metric_at(windows, unknowns, point, at, of_all), of_all
