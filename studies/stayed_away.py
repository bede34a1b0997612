"""Which loops never came near what they were to reach or to follow, whatever their figures say.

What stays where it is takes no air, switches no valve and keeps all limits: a specification of such
lines alone does not tell it from a loop that works.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite, isnan, nan
from typing import Any

from studies.asked_lines import MOVING
from studies.closed_loop_metrics import LOST_SHARE
from studies.specification import Asked


def stayed_away(scenario: str, metrics: Mapping[str, Any], asked: Iterable[Asked]) -> bool:
    """True for a step that never rose, and for a moving reference that a slide lost.

    The latter where no line says how closely it is to be followed.
    """
    amplitude_m = metrics.get("amplitude_m", nan)
    if not isfinite(amplitude_m):
        return isnan(metrics.get("figures", metrics).get("rise_s", 0.0))
    told = any(line.figure in MOVING and scenario in line.scenarios for line in asked)
    return not told and metrics["rmse_m"] > LOST_SHARE * amplitude_m
