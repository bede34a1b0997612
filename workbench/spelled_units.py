"""Pressures as loggers and gauges spell their units, and how the workbench does."""

from __future__ import annotations

import re

GAUGE = "_gauge"
# Millibar and megapascal only in their own case: to guess would be a factor of 1e9.
_BASE = r"(?P<base>m?(?i:bar)|(?i:psi|[kh]?pa)|MPa)"
_ABSOLUTE = r"[ _]?\(?(?i:a|abs|absolute)\)?"
_SPELLED = re.compile(rf"{_BASE}(?:[ _]?\(?(?P<gauge>(?i:g|gauge))\)?|{_ABSOLUTE})")
_CASES = {each.lower(): each for each in ("bar", "mbar", "psi", "Pa", "hPa", "kPa", "MPa")}


def spelled(unit: str) -> str:
    """The unit as the workbench spells it: bar_gauge of ``barg`` or ``bar(g)``, bar of ``bara``."""
    found = _SPELLED.fullmatch(unit.strip())
    return _CASES[found["base"].lower()] + GAUGE * bool(found["gauge"]) if found else unit


def is_gauge(unit: str) -> bool:
    """Whether a pressure in this unit counts from ambient."""
    return spelled(unit).endswith(GAUGE)
