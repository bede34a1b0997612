"""The plans with which shifts from rest begin, searched when the design is made.

Launched by a poor plan a shift stalls half-way, and valves that answer milliseconds late cannot
mend that.  What one sample has time for ends in poor plans at rest: the pulse that pushes and the
one that brakes must change together.  So every pair of them is tried beforehand, one pulse of each
valve at every second sample and of every second length, one of the two at once, since waiting is
no use at rest.  The best are then changed sample by sample as long as that lowers the cost.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from itertools import permutations

import numpy as np

from controllers.plan_search import PlanSearch
from controllers.shift_prediction import query
from controllers.switching_plans import moved
from linearize.shifting import POSITION, STATES

COARSE = 2  # samples between instants of the first search
BEGUN = 4  # plans of the first search that are changed further
RELEASED = (0, 0)  # valves that have been so for long

Launches = dict[tuple[float, float], np.ndarray]


def launches(search: PlanSearch, rest: np.ndarray, places_m: Iterable[float]) -> Launches:
    """By where a shift begins and ends the plans to begin with, the best first, (k, 2, N).

    ``rest`` is a state at rest with valves that are long released.
    """
    found = {}
    for start_m, target_m in permutations(places_m, 2):
        start = rest.astype(float)
        start[STATES.index(POSITION)] = start_m
        found[start_m, target_m] = _launches(search, start, query(target_m, start_m, start_m))
    return found


def _launches(search: PlanSearch, start: np.ndarray, asked_for: np.ndarray) -> np.ndarray:
    asked = pulse_pairs(search.responses[0].hold, search.horizon)
    best = np.argsort(search.costs(start, asked_for, RELEASED, asked), kind="stable")[:BEGUN]
    ended = [_descended(search, start, asked_for, plan) for plan in asked[best]]
    ended.sort(key=lambda found: found[0])
    return np.array([plan for _, plan in ended])


@cache
def pulse_pairs(hold: int, horizon: int) -> np.ndarray:
    """One pulse of each valve or none, at least one of them at once, shape (n, 2, N)."""
    ahead = np.arange(horizon)
    rows = [ahead < 0]
    for start in range(0, horizon - hold, COARSE):
        ends = (*range(start + hold, horizon, COARSE), horizon)
        rows += [(ahead >= start) & (ahead < end) for end in ends]
    pairs = [(a, b) for a in rows for b in rows if a[0] or b[0]]
    return np.array(pairs, dtype=int)


def _descended(
    search: PlanSearch, start: np.ndarray, asked_for: np.ndarray, plan: np.ndarray
) -> tuple[float, np.ndarray]:
    """Cost and plan where no switch that is moved, made or taken out is cheaper."""
    cost = float(search.costs(start, asked_for, RELEASED, plan[None])[0])
    while True:
        near = moved(search.responses, RELEASED, plan)
        costs = search.costs(start, asked_for, RELEASED, near)
        best = int(np.argmin(costs))
        if not costs[best] < cost:
            return cost, plan
        cost, plan = float(costs[best]), near[best]
