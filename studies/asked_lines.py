"""The lines that a specification may have, by the figure of a run that answers each of them."""

from __future__ import annotations

from math import inf
from typing import Any

from studies.following import FOLLOWING_LINES, STEP_LINES

OVERSHOOT = "overshoot"

SLIDE_LINES = {
    "rise_time": "rise_s",
    "settling_time": "settling_s",
    OVERSHOOT: "overshoot_m",
    "final_error": "final_error_m",
    "limit_cycle": "limit_cycle_m",
    "tracking_error": "rmse_m",
    "air": "air_kg",
    "switches": "switches",
}
"""Field of :class:`studies.closed_loop_metrics.Metrics` by the line that asks for it."""

SHIFT_LINES = {
    "rise_time": "rise_s",
    "settling_time": "settling_s",
    OVERSHOOT: "overshoot_m",
    "final_error": "final_error_m",
    "impact_speed": "impact_m_s",
    "air": "air_kg",
    "switches": "switches",
}
"""Likewise of :class:`studies.shift_check.Shift`."""

ALL_LINES = {*SLIDE_LINES, *SHIFT_LINES, *FOLLOWING_LINES, *STEP_LINES}
EVERYWHERE = ("air_kg", "switches")  # all else asks for an end at rest, or for none
LONGEST_S = 3600.0  # no run is nearly as long
ARRIVED = (OVERSHOOT, "limit_cycle")  # of a step that never rose there is none to speak of
MOVING = ("rmse_m", "rmse_rad", "largest_error_m", "largest_error_rad")
ROUNDING = 1e-9  # of a bound: 51 samples of 1 ms are more than 51 ms in the last digit


def within(found: Any, most: float, least: float = -inf) -> Any:
    """Whether a figure, or each of an array of them, is as asked, to within rounding."""
    return (found <= most + ROUNDING * abs(most)) & (found >= least - ROUNDING * abs(least))
