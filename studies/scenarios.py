"""What a closed loop is asked to follow: references of the position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

SAMPLE_TIME_S = 1e-3
LATE_S = 0.4  # the end of a run, where a limit cycle is looked for
AFTER_S = 1.0  # a moving reference goes on for so long, for controllers that look ahead


@dataclass(frozen=True)
class Scenario:
    """A reference of the position, shape (n,), on the plant's clock; it starts at rest there.

    ``begins_s`` is when it begins to move, ``judged_s`` from when on tracking is judged;
    ``afterwards_m`` is how it would go on after the run, shape (m,).
    """

    name: str
    reference_m: np.ndarray
    begins_s: float
    judged_s: float
    afterwards_m: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def ends_at_rest(self) -> bool:
        """True where the reference stands still at the end: only then is there an end to reach."""
        return bool(np.ptp(self.reference_m[-round(LATE_S / SAMPLE_TIME_S) :]) == 0.0)


def step_scenario(stroke_m: float) -> Scenario:
    """A step of 100 mm about the middle of the stroke, after 0.1 s, watched for 1.2 s."""
    time_s = SAMPLE_TIME_S * np.arange(1300)
    start_m = stroke_m / 2 - 0.05
    return Scenario("step", start_m + 0.1 * (time_s >= 0.1), 0.1, 0.1)


def sine_scenario(stroke_m: float) -> Scenario:
    """A 0.5 Hz sine of 80 mm about the middle, two periods, judged after half a period."""
    n = 4000
    time_s = SAMPLE_TIME_S * np.arange(n + round(AFTER_S / SAMPLE_TIME_S))
    wanted_m = stroke_m / 2 + 0.08 * np.sin(np.pi * time_s)
    return Scenario("sine", wanted_m[:n], 0.0, 1.0, wanted_m[n:])


SCENARIOS: dict[str, Callable[[float], Scenario]] = {
    "step": step_scenario,
    "sine": sine_scenario,
}
