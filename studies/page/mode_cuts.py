"""The cuts of modes as values that can be moved, and as the file that `workbench modes` reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isfinite

from linearize.cuts import Interval
from linearize.modes import HybridModel
from workbench.rig_text import quoted
from workbench.units import public_name, written


@dataclass(frozen=True)
class Boundary:
    """An end that two neighbouring intervals of a signal share, and how far it may be moved."""

    signal: str
    number: int
    value: float
    lower: float
    upper: float


def cuts_of(hybrid: HybridModel) -> dict[str, tuple[Interval, ...]]:
    """The intervals of every cut signal in order.

    Empty where modes are no product of intervals: levels of switches, guards, stops.
    """
    found: dict[str, list[Interval]] = {}
    for mode in hybrid.modes:
        if mode.guards or not all(isinstance(each, Interval) for each in mode.box.values()):
            return {}
        for signal, region in mode.box.items():
            if region not in found.setdefault(signal, []):
                found[signal].append(region)
    product = 1
    for regions in found.values():
        product *= len(regions)
    if product != len(hybrid.modes):
        return {}
    return {name: tuple(sorted(each, key=lambda r: r.lower)) for name, each in found.items()}


def boundaries(cuts: dict[str, tuple[Interval, ...]]) -> tuple[Boundary, ...]:
    """What may be moved, between the points of the two intervals that it parts."""
    return tuple(
        Boundary(signal, k, right.lower, left.point, right.point)
        for signal, regions in cuts.items()
        for k, (left, right) in enumerate(pairwise(regions))
        if isfinite(right.lower) and left.point < right.lower < right.point
    )


def moved(
    cuts: dict[str, tuple[Interval, ...]], changes: Sequence[tuple[Boundary, float]]
) -> dict[str, tuple[Interval, ...]]:
    """The cuts with boundaries at other values."""
    found = {signal: list(regions) for signal, regions in cuts.items()}
    for boundary, value in changes:
        regions, k = found[boundary.signal], boundary.number
        regions[k] = replace(regions[k], upper=value)
        regions[k + 1] = replace(regions[k + 1], lower=value)
    return {signal: tuple(regions) for signal, regions in found.items()}


def cuts_text(cuts: dict[str, tuple[Interval, ...]]) -> str:
    """The file of cuts: see :mod:`studies.cuts_file`."""
    lines = ["[cuts]"]
    for signal, regions in cuts.items():
        lines.append(f"{quoted(public_name(signal))} = [")
        for each in regions:
            keys = [f"label = {quoted(each.label)}"]
            ends = {"lower": each.lower, "upper": each.upper, "point": each.point}
            keys += [f"{k} = {quoted(written(v, signal))}" for k, v in ends.items() if isfinite(v)]
            if each.holds:
                names = ", ".join(quoted(public_name(name)) for name in each.holds)
                keys.append(f"holds = [{names}]")
            lines.append(f"    {{ {', '.join(keys)} }},")
        lines.append("]")
    return "\n".join(lines) + "\n"
