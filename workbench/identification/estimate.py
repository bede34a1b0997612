"""A number that was identified, and whether it is a result that a rig should take over."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf, isnan, nan

from workbench.effect import Parameter

AT_BOUND = 1e-3  # of the range, or of the typical size where that is smaller: solvers stop before


@dataclass(frozen=True)
class Estimate:
    """A number that was identified, in SI; its name ends in its unit.

    Its deviation is infinite where the recordings say nothing of it, and NaN where it has none, as
    a value that a rule gives.
    """

    name: str
    value: float
    deviation: float


def estimated(
    names: Iterable[str], values: Iterable[float], deviations: Iterable[float]
) -> tuple[Estimate, ...]:
    """Estimates from columns."""
    rows = zip(names, values, deviations, strict=True)
    return tuple(Estimate(name, float(value), float(spread)) for name, value, spread in rows)


def end_reached(known: Parameter, value: float) -> float:
    """The end of a parameter's range that a value in SI has come to or passed, else NaN."""
    room = AT_BOUND * min(known.upper - known.lower, abs(known.typical) or inf)
    if value <= known.lower + room:
        return known.lower
    return known.upper if value >= known.upper - room else nan


def at_end(known: Parameter, value: float) -> bool:
    """True at an end of the range, where a value is no result; that nothing is there is one."""
    end = end_reached(known, value)
    return not isnan(end) and end != known.null


def says_nothing(known: Parameter, found: Estimate, deviation: float = 0.0) -> bool:
    """True of a value that is known worse than before, and than its size or half its range.

    ``deviation`` is that of the value before, 0 where none is known.
    """
    size = max(0.25 * abs(known.typical), abs(found.value))
    return found.deviation > max(min(0.5 * (known.upper - known.lower), size), deviation)
