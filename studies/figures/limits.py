"""What a specification limits, drawn over the runs that were held against it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from studies.figures.panels import Line, Panel, panels_figure
from studies.figures.style import PAGE_IN, kind_of_line, literal
from studies.specification import Limit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from studies.specification import Asked
    from workbench.closed_loop import LoopRecord
    from workbench.recording import Recording

PANEL_IN, LEGEND_IN = 1.5, 0.7
ROOM = 0.1  # of the range shown, above and below


def limit_figures(
    asked: Sequence[Asked], rows: Sequence[Any], records: Sequence[LoopRecord]
) -> dict[str, Figure]:
    """One figure per scenario, by file name without ending, of the limited states if there are any.

    ``rows`` and ``records`` are those of a check, one of each for every loop.
    """
    limits = [each for each in asked if isinstance(each, Limit)]
    runs: dict[str, list[tuple[str, Recording]]] = {}
    for row, record in zip(rows, records, strict=True):
        estimator = getattr(row, "estimator", "")
        name = ", ".join(part for part in (row.design, estimator) if part)
        runs.setdefault(row.scenario, []).append((name, record.recording))
    return {
        f"limits_{name}": limits_figure(limits, of_it) for name, of_it in runs.items() if limits
    }


def limits_figure(limits: Sequence[Limit], runs: Sequence[tuple[str, Recording]]) -> Figure:
    """One panel per limited state, in the unit in which the limit was typed.

    Parameters
    ----------
    runs
        What each run is called, and its recording, which has every limited state.
    """
    rows = [[_panel(limit, runs, limit is limits[-1])] for limit in limits]
    return panels_figure(rows, PAGE_IN, LEGEND_IN + PANEL_IN * len(limits))


def _panel(limit: Limit, runs: Sequence[tuple[str, Recording]], last: bool) -> Panel:
    def shown(value):
        return limit.scale.from_si(value)

    lines = [
        Line(run.time_s, shown(run[limit.figure]), literal(name), kind_of_line(k), f"C{k}")
        for k, (name, run) in enumerate(runs)
    ]
    ends = sorted({shown(end) for end in limit.ends})
    values = [*ends, *(end for line in lines for end in (line.y.min(), line.y.max()))]
    room = ROOM * (max(values) - min(values))
    state = limit.name.partition(".")[2]
    return Panel(
        x="time (s)" if last else "",
        y=f"{state} ({limit.unit})",
        lines=lines,
        levels={("limit" if k == 0 else "_other limit"): end for k, end in enumerate(ends)},
        y_range=(min(values) - room, max(values) + room),
    )
