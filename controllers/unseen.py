"""Steps without a finite estimate, as after a lost sensor: the last command holds, then it shuts.

A few missing samples are bridged by what was sent; for longer nobody knows where an open valve
leads to.  What the controller remembers is kept as it was, so the loop goes on from there.  Only
what a step reads counts: a position controller does not miss a pressure that it never asks for.
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


def waiting(step: Step) -> Step:
    """The step of a controller, which waits where the estimate is not finite: see the module."""

    @wraps(step)
    def waits(self: Controller, last: Command, reference: np.ndarray, seen: Estimate) -> Command:
        before, waited = last, last.memory
        if isinstance(waited, Unseen):
            before = Command(last.value, waited.memory, last.notes)
        else:
            waited = Unseen(last.memory, 0)
        if all(map(isfinite, seen.state.tolist())):  # for few numbers quicker than an array
            return step(self, before, reference, seen)
        try:
            return step(self, before, reference, Watched(**vars(seen)))
        except UnseenError:
            longer = Unseen(waited.memory, waited.samples + 1)
            holds = longer.samples * self.sample_time_s <= HELD_S
            value = last.value if holds else self.start().value
            return Command(value, longer, {"fallback": 1.0})

    return waits
