"""Laws on the measurement itself, which need no estimator before them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class OnMeasurement:
    """A law on one measured signal as it arrives: its design takes nothing for foreseen."""

    signal: str
