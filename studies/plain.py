"""Numbers as JSON knows them."""

from __future__ import annotations

from math import isfinite


def plain(value: float) -> float | None:
    """A float that JSON knows; what is not finite is null."""
    return float(value) if isfinite(value) else None
