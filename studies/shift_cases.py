"""Table I of paper 003: deviation by case of a shift, over all recordings of a comparison.

A case is from where to where, such as Neutral to High.  The paper has four, one shift of each, and
averages over them; here a case is the mean of its shifts, and its cases are averaged alike.

Source: paper 003 Table I; physics.md S003-2.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from workbench.comparison.deviation import ShiftDeviation

CASES = ("N to H", "H to N", "N to L", "L to N")  # as the paper lists them


@dataclass(frozen=True)
class CaseDeviation:
    """Number of shifts of a case, and their mean deviation by full output name.

    The mean leaves out shifts where an output has none; NaN where no shift has one.
    """

    case: str
    shifts: int
    deviations: Mapping[str, float]


def case_deviations(shifts: Sequence[ShiftDeviation]) -> tuple[CaseDeviation, ...]:
    """Every case that there is: those of the paper in its order, then any other."""
    there = dict.fromkeys(shift.case for shift in shifts)
    order = [*(case for case in CASES if case in there), *(c for c in there if c not in CASES)]
    parts = [(case, [shift for shift in shifts if shift.case == case]) for case in order]
    return tuple(CaseDeviation(case, len(same), mean_deviations(same)) for case, same in parts)


def mean_deviations(rows: Sequence[ShiftDeviation | CaseDeviation]) -> dict[str, float]:
    """Mean of each output over the rows that have one, by full name; NaN where none has."""
    names = dict.fromkeys(name for row in rows for name in row.deviations)
    return {name: _mean(row.deviations.get(name, nan) for row in rows) for name in names}


def _mean(values: Iterable[float]) -> float:
    known = [value for value in values if isfinite(value)]
    return sum(known) / len(known) if known else nan
