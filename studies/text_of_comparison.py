"""Comparisons as text: errors by horizon, where they are, and gear shifts as in paper 003."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, nan
from typing import TYPE_CHECKING, Protocol, TypeVar

import numpy as np

from studies.shift_cases import case_deviations, mean_deviations
from studies.text import columns, number, percent, shown
from workbench.comparison.gear_shift import PHASES
from workbench.units import public_name

if TYPE_CHECKING:
    from workbench.comparison.compare import Comparison, RecordingComparison, Regime
    from workbench.comparison.deviation import ShiftDeviation

SHOWN_REGIMES = 20
OVERLAP = "regimes overlap: each share is of all samples in it, so rows need not sum to 100 %"


class Named(Protocol):
    """Anything of a regime, by its name."""

    @property
    def name(self) -> str:
        """Name of the regime."""


Row = TypeVar("Row", bound=Named)


def comparison_text(found: Comparison) -> str:
    """Errors by horizon, regimes, worst windows and gear shifts of each recording.

    In the end the gear shifts of all of them by case, as paper 003 prints them.
    """
    shifts = [shift for each in found.recordings for shift in each.shifts]
    parts = (*map(_recording_text, found.recordings), cases_text(shifts))
    return "\n\n".join(filter(None, parts))


def _recording_text(each: RecordingComparison) -> str:
    worst = ", ".join(
        f"{span.start_s:.2f} to {span.end_s:.2f} s ({percent(span.share_of_error, 1)})"
        for span in each.worst
    )
    windows = f", windows of {each.window_s:.3g} s" if np.isfinite(each.window_s) else ""
    parts = [
        f"{each.name}: {each.time_s[-1]:.4g} s{windows}",
        _errors(each),
        _regimes(each.by_regime),
        f"worst: {worst}" if worst else "",
        shifts_text(each.shifts),
        *each.notes,
    ]
    return "\n".join(filter(None, parts))


def _errors(each: RecordingComparison) -> str:
    return columns(
        ("signal", "horizon", "RMSE", "fit %", "noise", "chi2/n"),
        [
            (
                public_name(name),
                horizon,
                shown(error.rmse, name),
                number(error.fit_percent, 3),
                shown(error.noise if isfinite(error.rmse) else nan, name, 2),
                number(error.chi2_per_sample, 3),
            )
            for name in each.measured
            for horizon, row in each.errors.items()
            if (error := row.get(name))
        ],
    )


def shown_regimes(found: Sequence[Row], most: int = SHOWN_REGIMES) -> list[Row]:
    """The first ``most`` regimes, and every phase of a gear shift, in the order they come."""
    return [each for k, each in enumerate(found) if k < most or each.name in PHASES]


def _regimes(found: Sequence[Regime]) -> str:
    kept = shown_regimes(found)
    if not kept:
        return ""
    rows = [(r.name, percent(r.share_of_error), percent(r.share_of_time)) for r in kept]
    rest = len(found) - len(kept)
    more = [f"... and {rest} more, in the JSON"] if rest > 0 else []
    head = ("where the error is", "of the error", "of the time")
    return "\n".join([columns(head, rows), *more, OVERLAP])


def shifts_text(found: Sequence[ShiftDeviation]) -> str:
    """Deviation of each output for each shift, and the mean."""
    if not found:
        return ""
    outputs = list(found[0].deviations)
    rows = [
        (
            shift.case,
            f"{shift.start_s:.3f} s",
            f"{1e3 * (shift.end_s - shift.start_s):.1f} ms",
            *(percent(shift.deviations[name], 2) for name in outputs),
        )
        for shift in found
    ]
    means = mean_deviations(found)
    rows.append(("mean", "-", "-", *(percent(means[name], 2) for name in outputs)))
    head = ("deviation of the shift", "from", "takes", *map(public_name, outputs))
    return columns(head, rows)


def cases_text(found: Sequence[ShiftDeviation]) -> str:
    """Table I of paper 003: mean deviation of each output by case, and the mean of the cases."""
    cases = case_deviations(found)
    if not cases:
        return ""
    means = mean_deviations(cases)
    rows = [
        (each.case, str(each.shifts), *(percent(each.deviations.get(n, nan), 2) for n in means))
        for each in cases
    ]
    rows.append(("mean of the cases", str(len(found)), *(percent(e, 2) for e in means.values())))
    return columns(("mean deviation by case", "shifts", *map(public_name, means)), rows)
