"""Steps without a finite estimate, as after a lost sensor: the last command holds, then it shuts.

A few missing samples are bridged by what was sent; for longer nobody knows where an open valve
leads to.  What the controller remembers is kept as it was, so the loop goes on from there.  Only
what a step reads counts: a position controller does not miss a pressure that it never asks for.
Valves that may not switch at any moment send what they may of this, and remember it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import wraps
from math import isfinite
from typing import Any

import numpy as np

from workbench.contracts import Command, Controller, Estimate

HELD_S = 0.02  # at 0.5 m/s a piston moves 10 mm in it

Step = Callable[[Any, Command, np.ndarray, Estimate], Command]
Sent = Callable[[np.ndarray, Any], tuple[np.ndarray, Any]]


class UnseenError(ValueError):
    """A state that a step reads is not finite."""


@dataclass(frozen=True)
class Unseen:
    """The memory of a controller that waits, and for how many samples it has waited."""

    memory: Any
    samples: int


@dataclass(frozen=True)
class Watched(Estimate):
    """An estimate that gives finite states only."""

    def pick(self, names: Iterable[str]) -> np.ndarray:
        """As that of an estimate.

        Raises
        ------
        UnseenError
            If one of them is not finite.
        """
        found = super().pick(names)
        if not np.isfinite(found).all():
            raise UnseenError("a state that is read is not finite")
        return found


def as_wanted(wanted: np.ndarray, memory: Any) -> tuple[np.ndarray, Any]:
    """The command of a valve that follows at once, and the memory as it was."""
    return wanted, memory


def waiting(step: Step, sent: Sent = as_wanted) -> Step:
    """The step of a controller, which waits where the estimate is not finite: see the module.

    ``sent`` makes of a wanted command and a memory what is really sent, and the memory after it.
    """

    @wraps(step)
    def waits(self: Controller, last: Command, reference: np.ndarray, seen: Estimate) -> Command:
        before, waited = last, last.memory
        if isinstance(waited, Unseen):
            before = Command(last.value, waited.memory, last.notes)
        if all(map(isfinite, seen.state.tolist())):  # for few numbers quicker than an array
            return step(self, before, reference, seen)
        waited = waited if isinstance(waited, Unseen) else Unseen(waited, 0)
        try:
            return step(self, before, reference, Watched(**vars(seen)))
        except UnseenError:
            samples = waited.samples + 1
            holds = samples * self.sample_time_s <= HELD_S
            value, memory = sent(last.value if holds else self.start().value, waited.memory)
            return Command(value, Unseen(memory, samples), {"fallback": 1.0})

    return waits
