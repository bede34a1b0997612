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

from controllers.with_lanes import WithLanes
from workbench.called import prepared
from workbench.compiled import compiled
from workbench.lanes import address, lane_library

DRIVER = Path(__file__).with_name("judging.c")
AT_ONCE = 8  # plans of one call without lanes


@dataclass(frozen=True)
class Judging(WithLanes):
    """Costs of plans over N samples.

    A memory is (state (4,), what is left of the way, cost so far); a query that of
    :class:`controllers.shift_prediction.ShiftPrediction`.

    sample     (memory, share (2,), query, weight) -> memory a sample later
    last       (memory, query) -> cost of the whole
    weights    of the samples, shape (N,)
    """

    sample: ca.Function
    last: ca.Function
    weights: np.ndarray

    def costs(self, x: np.ndarray, shares: np.ndarray, query: np.ndarray) -> np.ndarray:
        """Costs in samples, shape (n,), of shares (n, N, 2) from a state (4,)."""
        given = [np.ascontiguousarray(each, dtype=float) for each in (x, shares, query)]
        if self._lanes is None:
            return self._one_by_one(*given)
        costs = np.empty(len(shares))
        rows = (*given, self.weights, costs)
        self._lanes.judge(len(shares), *map(address, rows))
        return costs

    def _one_by_one(self, x: np.ndarray, shares: np.ndarray, query: np.ndarray) -> np.ndarray:
        missing = -len(shares) % AT_ONCE
        filled = np.concatenate([shares, np.repeat(shares[-1:], missing, axis=0)])
        parts = filled.reshape(-1, AT_ONCE * len(self.weights) * 2)
        costs = np.concatenate([self._by_casadi(x, part, query)[0] for part in parts])
        return costs[: len(shares)]

    @cached_property
    def _by_casadi(self) -> Callable[..., list[np.ndarray]]:
        """(x, shares (2, N AT_ONCE), query) -> costs (AT_ONCE,), by CasADi alone."""
        horizon = len(self.weights)
        start, shares = ca.MX.sym("x", 4), ca.MX.sym("shares", 2, horizon)
        asked = ca.MX.sym("query", 3)
        begun = ca.vertcat(start, asked[1] * (asked[0] - start[2]), 0.0)
        weights = ca.DM(self.weights).T
        done = self.sample.fold(horizon)(begun, shares, ca.repmat(asked, 1, horizon), weights)
        plan = ca.Function("plan", [start, shares, asked], [self.last(done, asked)])
        many = plan.map("plans", "serial", AT_ONCE, [0, 2], [])
        inputs = [start, ca.MX.sym("all", 2, horizon * AT_ONCE), asked]
        return prepared(compiled(ca.Function("judged", inputs, [many(*inputs).T])))

    @cached_property
    def _lanes(self) -> ctypes.CDLL | None:
        library = lane_library(
            DRIVER, {"HORIZON": len(self.weights)}, {"sample": self.sample, "last": self.last}
        )
        if library is not None:
            library.judge.argtypes = [ctypes.c_longlong, *[ctypes.c_void_p] * 5]
            library.judge.restype = None
        return library
