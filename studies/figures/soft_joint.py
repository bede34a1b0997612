"""Figures of the moving horizon on the soft joint: event, lag at edges, trade-off, searches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PAGE_IN,
    PURPLE,
    RED,
    SKY,
    new_figure,
    styled,
    thinned,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOKS = ((BLACK, "-"), (RED, "--"), (BLUE, "-"), (GREEN, "-."))
MARKS = ("o", "s", "^", "D", "v")


def event_figure(
    time_s: np.ndarray,
    command: np.ndarray,
    pressures_psi: Mapping[str, np.ndarray],
    taus_s: Mapping[str, np.ndarray],
    event_s: tuple[float, float],
) -> Figure:
    """Pressures, time constants and command before, in and after the event."""
    with styled():
        figure = new_figure(PAGE_IN, 4.4)
        top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 1))
        for (name, values), (colour, line) in zip(pressures_psi.items(), LOOKS, strict=False):
            top.plot(*thinned(time_s, values), line, color=colour, label=name)
        for (name, values), (colour, line) in zip(taus_s.items(), LOOKS[1:], strict=False):
            middle.plot(*thinned(time_s, values), line, color=colour, label=name)
        bottom.plot(*thinned(time_s, command), color=BLACK)
        for axes in (top, middle, bottom):
            axes.axvspan(*event_s, color="0.9", zorder=0)
        top.set_ylabel("absolute pressure (psi)")
        middle.set_ylabel("time constant (s)")
        middle.set_yscale("log")
        middle.yaxis.set_major_formatter("{x:g}")
        bottom.set_ylabel("command (-)")
        bottom.set_xlabel("time (s); grey: the spool sticks")
        for axes in (top, middle):
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def edge_figure(time_s: np.ndarray, panels_s: Mapping[str, Mapping[str, np.ndarray]]) -> Figure:
    """Time constants before and after an edge, by the title of a panel and the name of a curve."""
    with styled():
        figure = new_figure(PAGE_IN, 2.6)
        panels = figure.subplots(1, len(panels_s), sharey=True)
        for axes, (title, curves) in zip(panels, panels_s.items(), strict=True):
            for (name, values), (colour, line) in zip(curves.items(), LOOKS, strict=False):
                axes.plot(time_s, values, line, color=colour, label=name)
            axes.axvline(0.0, color="0.7", linewidth=0.6, zorder=0)
            axes.set_title(title)
            axes.set_xlabel("time after the edge (s)")
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:g}")
            axes.yaxis.set_minor_formatter("")
        panels[0].set_ylabel("time constant (s)")
        handles = panels[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=4)
    return figure


def trade_off_figure(
    curves: Mapping[str, Sequence[tuple[str, float, float]]],
    points: Mapping[str, tuple[float, float]],
) -> Figure:
    """Error in the event over the nominal one: a curve by setting of the other knobs, and points.

    Each point of a curve has a label: the horizon.
    """
    colours = (BLUE, ORANGE, GREEN, PURPLE, SKY)
    with styled():
        figure = new_figure(PAGE_IN, 3.4)
        axes = figure.subplots()
        for (name, row), colour, mark in zip(curves.items(), colours, MARKS, strict=False):
            labels, nominal, event = zip(*row, strict=True)
            axes.plot(nominal, event, "-", marker=mark, markersize=3, color=colour, label=name)
            if len(row) == 1:  # only a curve needs to say which point is which
                continue
            for label, x, y in zip(labels, nominal, event, strict=True):
                axes.annotate(
                    label, (x, y), xytext=(3, 3), textcoords="offset points", fontsize=6,
                    color=colour,
                )  # fmt: skip
        for (name, at), mark in zip(points.items(), "*PX", strict=False):
            axes.plot(*at, mark, color=RED, markersize=7, linestyle="none", label=name)
        axes.set_xlabel("RMS error of the free run outside the event (psi)")
        axes.set_ylabel("largest error in the event (psi)")
        axes.margins(0.08)
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        figure.legend(*axes.get_legend_handles_labels(), loc="outside right center")
    return figure


def starts_figure(
    ends: Mapping[str, Sequence[tuple[tuple[float, ...], tuple[float, ...], float]]],
) -> Figure:
    """Where searches start and end, kappa over the coefficient of filling, by model and record.

    Each search is (start, end, RMSE in psi).
    """
    with styled():
        figure = new_figure(PAGE_IN, 2.6)
        panels = figure.subplots(1, len(ends), sharex=True, sharey=True)
        for axes, (name, searches) in zip(np.atleast_1d(panels), ends.items(), strict=True):
            for start, end, _ in searches:
                axes.plot([start[1], end[1]], [start[0], end[0]], "-", color="0.8", linewidth=0.6)
            axes.plot([s[1] for s, *_ in searches], [s[0] for s, *_ in searches], "o",
                      color="0.6", markersize=3, label="start")  # fmt: skip
            axes.plot([e[1] for _, e, _ in searches], [e[0] for _, e, _ in searches], "s",
                      color=RED, markersize=4, label="end")  # fmt: skip
            best, worst = (pick(r for *_, r in searches) for pick in (min, max))
            axes.set_title(f"{name}\nRMS error {best:.3g} to {worst:.3g} psi")
            axes.set_xlabel("coefficient of filling (-)")
        np.atleast_1d(panels)[0].set_ylabel("kappa (-)")
        handles = np.atleast_1d(panels)[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=2)
    return figure
