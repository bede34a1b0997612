"""What plans cost by the nonlinear model, all of a sample's plans side by side.

In lanes of the vector unit where there is a compiler (:mod:`workbench.lanes`), else one after the
other by CasADi; both give the same to the last bit.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import casadi as ca
import numpy as np

from controllers.with_lanes import WithLanes, filled
from workbench.called import prepared
from workbench.compiled import compiled
from workbench.lanes import address, declared, lane_library

DRIVER = Path(__file__).with_name("judging.c")
AT_ONCE = 8  # plans of one call without lanes


@dataclass(frozen=True)
class Judging(WithLanes):
    """Costs of plans over N samples.

    A memory is (state (4,), what is left of the way, cost so far); a query that of
    :func:`controllers.shift_prediction.query`, at whose last entry the way begins.

    sample     (memory, shares (4,), query, weight) -> memory a sample later
    last       (memory, query) -> cost of the whole
    weights    of the samples, shape (N,)
    """

    sample: ca.Function
    last: ca.Function
    weights: np.ndarray

    def costs(self, x: np.ndarray, shares: np.ndarray, query: np.ndarray) -> np.ndarray:
        """Costs in samples, shape (n,), of n >= 1 shares (n, N, 4) from a state (4,).

        Raises
        ------
        ValueError
            If a shape is another one.
        """
        begun = np.array([*x, query[-1], 0.0])
        shapes = ((6,), (max(len(shares), 1), len(self.weights), 4), (4,))
        given = filled((begun, shares, query), shapes)
        if self._lanes is None:
            return self._one_by_one(*given)
        costs = np.empty(len(shares))
        rows = (*given, np.ascontiguousarray(self.weights, dtype=float), costs)
        self._lanes(len(shares), *map(address, rows))
        return costs

    def _one_by_one(self, begun: np.ndarray, shares: np.ndarray, query: np.ndarray) -> np.ndarray:
        missing = -len(shares) % AT_ONCE
        whole = np.concatenate([shares, np.repeat(shares[-1:], missing, axis=0)])
        parts = whole.reshape(-1, AT_ONCE * len(self.weights) * 4)
        costs = np.concatenate([self._by_casadi(begun, part, query)[0] for part in parts])
        return costs[: len(shares)]

    @cached_property
    def _by_casadi(self) -> Callable[..., list[np.ndarray]]:
        """(memory, shares (4, N AT_ONCE), query) -> costs (AT_ONCE,), by CasADi alone."""
        horizon = len(self.weights)
        begun, shares = ca.MX.sym("begun", 6), ca.MX.sym("shares", 4, horizon)
        asked = ca.MX.sym("query", 4)
        weights = ca.DM(self.weights).T
        done = self.sample.fold(horizon)(begun, shares, ca.repmat(asked, 1, horizon), weights)
        plan = ca.Function("plan", [begun, shares, asked], [self.last(done, asked)])
        many = plan.map("plans", "serial", AT_ONCE, [0, 2], [])
        inputs = [begun, ca.MX.sym("all", 4, horizon * AT_ONCE), asked]
        return prepared(compiled(ca.Function("judged", inputs, [many(*inputs).T])))

    @cached_property
    def _lanes(self) -> Callable[..., None] | None:
        library = lane_library(
            DRIVER, {"HORIZON": len(self.weights)}, {"sample": self.sample, "last": self.last}
        )
        return library and declared(library.judge, [ctypes.c_longlong, *[ctypes.c_void_p] * 5])
