"""Numbers as JSON knows them."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any


def plain(value: float) -> float | None:
    """A float that JSON knows; what is not finite is null."""
    return float(value) if isfinite(value) else None


def plain_all(value: Any) -> Any:
    """The same with every number in it as JSON knows it."""
    if isinstance(value, Mapping):
        return {key: plain_all(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain_all(each) for each in value]
    return plain(value) if isinstance(value, float) else value
