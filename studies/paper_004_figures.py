"""The figures of study ``soft-joint-mhe`` from its results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.soft_joint import (
    edge_figure,
    event_figure,
    starts_figure,
    trade_off_figure,
)
from studies.soft_joint_fits import PSI_PA, SAMPLE_TIME_S, Data, Fitted, FreeRun
from studies.soft_joint_horizon import Setting, Worth, edges, free_run
from studies.soft_joint_improved import Improved
from workbench.plant import Plant
from workbench.plants.soft_joint import COMMAND, PRESSURE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AROUND_S = (4.0, 6.0)  # before and after the event
EDGE_SPAN_S = (0.2, 1.2)  # before and after an edge
PAPER, SHORT = Setting(), Setting(horizon=40)


def figures(
    data: Data,
    fixed: Plant,
    searches: Mapping[str, list[Fitted]],
    taus: Mapping[Setting, np.ndarray],
    better: Mapping[str, Improved],
    rows: Mapping[str, Worth],
    wanted: np.ndarray,
) -> dict[str, Figure]:
    """All of them by file name."""
    ends = {
        name: [(each.start, each.end, each.rmse_psi) for each in found]
        for name, found in searches.items()
    }
    return {
        "event": _event(data, fixed, taus, better),
        "edges": _edges(data, taus, wanted),
        "trade_off": _trade_off(taus, rows),
        "searches": starts_figure(ends),
    }


def _event(
    data: Data,
    fixed: Plant,
    taus: Mapping[Setting, np.ndarray],
    better: Mapping[str, Improved],
) -> Figure:
    n, tau_s = len(data.judged), fixed.values["valve.time_constant_s"]
    first, last = data.event
    before, after = (round(s / SAMPLE_TIME_S) for s in AROUND_S)
    seen = slice(max(first - before, 0), min(last + after, n))
    constant = np.full(n, tau_s)
    name = "soft_joint"
    pressures = {
        "record": data.judged[PRESSURE],
        "tau fixed": free_run(fixed, data.judged, constant),
        "tau by a horizon of 1 s": free_run(fixed, data.judged, taus[PAPER]),
        "flows, improved": FreeRun(better[name].plant(name), data.judged)(),
    }
    return event_figure(
        data.judged.time_s[seen],
        data.judged[COMMAND][seen],
        {key: values[seen] / PSI_PA for key, values in pressures.items()},
        {"tau fixed": constant[seen], "tau by a horizon of 1 s": taus[PAPER][seen]},
        (first * SAMPLE_TIME_S, last * SAMPLE_TIME_S),
    )


def _edges(data: Data, taus: Mapping[Setting, np.ndarray], wanted: np.ndarray) -> Figure:
    """Of each kind the edge outside the event behind which most is known of what is needed."""
    before, after = (round(s / SAMPLE_TIME_S) for s in EDGE_SPAN_S)
    panels = {}
    for kind, at in edges(data.judged).items():
        whole = [k for k in at if before <= k < len(wanted) - after]
        inside = [k for k in whole if data.nominal[k - before : k + after].all()]
        best = max(inside, key=lambda k: np.isfinite(wanted[k : k + after]).sum())
        seen = slice(best - before, best + after)
        title = f"{kind} edge at {best * SAMPLE_TIME_S:.1f} s"
        panels[title] = {"needed, from the flows": wanted[seen]} | {
            f"horizon {setting.horizon * SAMPLE_TIME_S:g} s": taus[setting][seen]
            for setting in (PAPER, SHORT)
        }
    return edge_figure(np.arange(-before, after) * SAMPLE_TIME_S, panels)


def _trade_off(taus: Mapping[Setting, np.ndarray], rows: Mapping[str, Worth]) -> Figure:
    curves: dict[str, list[tuple[str, float, float]]] = {}
    for setting in sorted(taus, key=lambda each: each.horizon):
        row = rows[setting.name]
        kind = type(setting.loss).__name__.lower()
        low, high = setting.bounds_s
        knobs = f"{kind}, movement {1e3 * setting.movement_s:g} ms, {low:g} to {high:g} s"
        label = f"{setting.horizon * SAMPLE_TIME_S:g} s"
        curves.setdefault(knobs, []).append((label, row.nominal_psi, row.event_psi))
    marked = {
        name: (row.nominal_psi, row.event_psi)
        for name, row in rows.items()
        if name in ("tau fixed", "flows, improved", "tau, improved")
    }
    return trade_off_figure(curves, marked)
