"""A design as text: the margins of each mode, and what is known beyond the modes."""

from __future__ import annotations

from collections.abc import Iterable
from math import degrees, isinf
from typing import TYPE_CHECKING

from studies.text import columns, number

if TYPE_CHECKING:
    from controllers.margins import Margins

HEAD = ("mode", "gain down to", "gain up to", "phase deg", "delay ms", "distance", "loop")
NO_CERTIFICATE = (
    "no certificate across modes: none is made; the margins hold inside each mode, for the sampled "
    "loop without limits"
)
UNSTABLE = (
    "unstable: an oscillation grows in the sampled loop of that mode, where dry friction is a "
    "constant and takes no energy; `workbench check` says what the whole plant makes of it"
)


def margins_text(found: Iterable[Margins]) -> str:
    """One line per mode; a dash where the loop has no such margin."""
    found = [*found]
    lines = [columns(HEAD, [_row(each) for each in found])]
    lines += [] if all(each.stable for each in found) else [UNSTABLE]
    return "\n".join([*lines, NO_CERTIFICATE])


def _row(each: Margins) -> tuple[str, ...]:
    if not each.stable:
        return (each.mode, *["-"] * 5, "unstable")
    low, high = each.gain
    numbers = (degrees(each.phase_rad), 1e3 * each.delay_s, each.distance)
    ends = (number(low, 3), "any" if isinf(high) else number(high, 3))
    return (each.mode, *ends, *(number(value, 3) for value in numbers), "stable")
