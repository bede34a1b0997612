"""All plans of one switching valve over a horizon, blocked to a few instants of switching.

A valve switches at most twice in a plan.  With a new plan at every sample that is no limit on what
it does, only on what it foresees.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np

from linearize.valve_response import ValveResponse, packed

INSTANTS = (0, 1, 2, 4, 7, 10, 14)  # samples ahead, fine where a plan is about to be carried out
NEVER = 1e6  # switches of what only fills up a set: it is never chosen


@dataclass(frozen=True)
class Plans:
    """Plans of one valve, filled up to the size of the largest set with plans that count as none.

    commands    shape (n, N)
    packed      the same as integers, see :func:`linearize.valve_response.packed`
    switches    of each, shape (n,)
    """

    commands: np.ndarray
    packed: np.ndarray
    switches: np.ndarray


@cache
def plans(level: int, wait: int, hold: int, horizon: int) -> Plans:
    """Plans of a valve whose command is ``level``, and may first change after ``wait`` samples."""
    times, size = switching_times(wait, hold), len(switching_times(0, hold))
    commands = _commands(level, [*times, *[()] * (size - len(times))], horizon)
    switches = np.array([float(len(t)) for t in times] + [NEVER] * (size - len(times)))
    return Plans(commands, packed(commands), switches)


@cache
def every_plan(level: int, wait: int, hold: int, horizon: int) -> np.ndarray:
    """The same without blocking: two switches at most, at any sample, shape (n, N)."""
    return _commands(level, switching_times(wait, hold, range(horizon)), horizon)


def _commands(level: int, times: Iterable[tuple[int, ...]], horizon: int) -> np.ndarray:
    """Commands that begin at ``level`` and change at these times, shape (n, N)."""
    first, second = np.array([(*t, horizon, horizon)[:2] for t in times]).T[:, :, None]
    ahead = np.arange(horizon)
    return ((ahead >= first) ^ (ahead >= second)).astype(int) ^ level


def switching_times(
    wait: int, hold: int, instants: Iterable[int] = INSTANTS
) -> list[tuple[int, ...]]:
    """No switch, one, and two at least ``hold`` samples apart; none before ``wait``."""
    allowed = sorted({max(k, wait) for k in instants})
    twice = [(first, then) for first in allowed for then in allowed if then - first >= hold]
    return [(), *((k,) for k in allowed), *twice]


def moved(
    responses: tuple[ValveResponse, ValveResponse], sent: tuple[int, int], plan: np.ndarray
) -> np.ndarray:
    """A plan of both valves with one switch a sample or two earlier or later, shape (n, 2, N)."""
    found = []
    for valve, (response, s) in enumerate(zip(responses, sent, strict=True)):
        flipped = plan[valve] ^ flips(plan.shape[1])
        rows = flipped[response.keeps(s, packed(flipped))]
        plans_of_both = np.repeat(plan[None], len(rows), axis=0)
        plans_of_both[:, valve] = rows
        found.append(plans_of_both)
    return np.concatenate(found)


@cache
def flips(horizon: int) -> np.ndarray:
    """One command and two following ones, 1 where they change, shape (2 N - 1, N)."""
    one = np.eye(horizon, dtype=int)
    return np.concatenate([one, one[:-1] + one[1:]])
