"""A comparison as rows to draw and as tables of a page."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from studies.page.look import html_table
from studies.text import number, percent, shown
from studies.text_of_comparison import shown_regimes
from workbench.units import display_scale, public_name

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

    from studies.page.drivers import RegimeErrors
    from workbench.comparison.compare import RecordingComparison

SHOWN_REGIMES = 14


def trace_rows(each: RecordingComparison, horizon: str) -> dict[str, np.ndarray]:
    """Measured, simulated and error of every output, (n,), in the units that people read."""
    rows = {}
    for name, measured in each.measured.items():
        to_people, simulated = display_scale(name).from_si, each.simulated[horizon][name]
        rows[f"m:{name}"], rows[f"s:{name}"] = to_people(measured), to_people(simulated)
        rows[f"e:{name}"] = (measured - simulated) / display_scale(name).factor
    return rows


def errors_table(each: RecordingComparison) -> str:
    """Fit and RMSE by output and horizon."""
    return html_table(
        ("signal", "horizon", "fit %", "RMSE", "noise", "chi2/n"),
        [
            (public_name(name), horizon, number(error.fit_percent, 3), shown(error.rmse, name, 3),
             shown(error.noise, name, 2), number(error.chi2_per_sample, 3))
            for name in each.measured
            for horizon, found in each.errors.items()
            if (error := found.get(name))
        ],
        numbers=2,
        names=(0, 1),
    )  # fmt: skip


def regimes_html(found: Sequence[RegimeErrors], horizon: str) -> str:
    """Share of the error, RMSE and fit of every output, by regime, worst first."""
    if not found:
        return ""
    names = [*found[0].errors]
    head = ["regime", "of the time", "of the error"]
    for name in names:
        head += [f"{public_name(name)} RMSE", "fit %"]
    rows = []
    for each in shown_regimes(found, SHOWN_REGIMES):
        line = [each.name, percent(each.share_of_time), percent(each.share_of_error)]
        for name in names:
            error = each.errors[name]
            line += [shown(error.rmse, name, 3), number(error.fit_percent, 3)]
        rows.append(line)
    return f"<h2>By regime, {escape(horizon)}; regimes overlap</h2>" + html_table(head, rows)
