"""What every pair of plans of two valves costs under affine modes, in which their effects add up.

In lanes of the vector unit where there is a compiler (:mod:`workbench.lanes`), else by CasADi; both
give the same to the last bit.
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

DRIVER = Path(__file__).with_name("ranking.c")


@dataclass(frozen=True)
class Ranking(WithLanes):
    """Costs of all pairs of ``plans`` of each valve.

    ``pair`` is (way with the first (2 N,), what the second changes (2 N,), query) -> cost, where
    the query is that of :func:`controllers.shift_prediction.query`.
    """

    pair: ca.Function
    plans: int

    def costs(self, way: np.ndarray, moves: list[np.ndarray], query: np.ndarray) -> np.ndarray:
        """Cost of plan i of the first and j of the second valve at n i + j, shape (n^2,).

        ``way`` are positions and velocities (2 N,) along one plan, ``moves`` what each plan of each
        valve changes of them, one array (n, 2 N) for each valve.

        Raises
        ------
        ValueError
            If a shape is another one.
        """
        rows = self.pair.numel_in(0)
        shapes = ((rows,), (self.plans, rows), (self.plans, rows), (self.pair.numel_in(2),))
        given = filled((way, *moves, query), shapes)
        if self._lanes is None:
            return self._by_casadi(*(each.ravel() for each in given))[0]
        costs = np.empty(self.plans**2)
        self._lanes(*map(address, (*given, costs)))
        return costs

    @cached_property
    def _by_casadi(self) -> Callable[..., list[np.ndarray]]:
        n, plans = self.pair.numel_in(0), self.plans
        # one map within the other: neither copies the plans of a valve for each of the other's
        row = self.pair.map("row", "serial", plans, [0, 2], [])
        every = row.map("every", "serial", plans, [1, 2], [])
        sizes = ((n, 1), (n, plans), (n, plans), (self.pair.numel_in(2), 1))
        way, first, *others = inputs = [ca.MX.sym(f"i{k}", *size) for k, size in enumerate(sizes)]
        costs = every(ca.repmat(way, 1, plans) + first, *others)
        return prepared(compiled(ca.Function("ranked", inputs, [costs.T])))

    @cached_property
    def _lanes(self) -> Callable[..., None] | None:
        sizes = {"ROWS": self.pair.numel_in(0), "PLANS": self.plans}
        library = lane_library(DRIVER, sizes, {"pair": self.pair})
        return library and declared(library.rank, [ctypes.c_void_p] * 5)
