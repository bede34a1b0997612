"""What an unstable loop does, by its poles: it oscillates, runs away, or hardly moves at all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, log, tau

import numpy as np

from studies.text import number

SLOW_S = 10.0  # a run is over before something that grows by e in this time is seen
FRICTION = (
    "dry friction is a constant in a mode and takes no energy; `workbench check` says what the "
    "whole plant makes of it"
)
UNSTABLE = f"unstable: the sampled loop of that mode does not settle; {FRICTION}"


@dataclass(frozen=True)
class Growth:
    """What grows in one loop, by its largest pole in the plane of z.

    grows_s     time in which it grows by e, infinite at a pole of one
    swings_hz   its frequency, 0 where it does not oscillate
    """

    grows_s: float
    swings_hz: float

    @property
    def words(self) -> str:
        """In one clause."""
        turns = self.swings_hz * SLOW_S >= 1.0  # a slower swing is seen as a drift
        if self.grows_s > SLOW_S and turns:
            return f"an oscillation of {number(self.swings_hz, 3)} Hz hardly grows, {self._in_time}"
        if self.grows_s > SLOW_S:
            return f"it drifts, nothing brings it back in time ({self._in_time})"
        if self.swings_hz == 0.0:
            return f"it runs away without oscillating, {self._in_time}"
        return f"an oscillation of {number(self.swings_hz, 3)} Hz grows, {self._in_time}"

    @property
    def _in_time(self) -> str:
        if self.grows_s == inf:
            return "poles of size one" if self.swings_hz else "a pole at one"
        return f"by e in {number(self.grows_s, 3)} s"


def growth_of(closed: np.ndarray, sample_time_s: float) -> Growth | None:
    """What grows in x[k+1] = A x[k], A of shape (n, n); none in a stable loop."""
    poles = np.linalg.eigvals(closed)
    pole = max(poles, key=abs)
    if abs(pole) < 1.0:
        return None
    per_sample = log(abs(pole))
    grows_s = sample_time_s / per_sample if per_sample > 0.0 else inf
    turn = abs(float(np.angle(pole)))  # pi for a pole that changes its sign with every sample
    return Growth(grows_s, turn / (tau * sample_time_s))


def unstable_text(growth: Mapping[str, Growth]) -> str:
    """A line for each unstable mode under its own law, and how far to trust it."""
    lines = [f"unstable: {name}: {each.words}" for name, each in growth.items()]
    return "\n".join([*lines, FRICTION]) if lines else UNSTABLE
