"""Figures of an improvement: the error after each accepted effect, and errors before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLACK, BLUE, COLUMN_IN, GREY, ORANGE, PAGE_IN, new_figure, styled
from workbench.diagnosis.improvement import Change, Stage
from workbench.units import display_scale, display_unit, public_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from workbench.fitting.errors import SignalError

WIDE_FROM = 3  # bars that one column holds
HEADROOM = 0.15  # of the height of the axis, above the highest bar
NEAR = 0.14  # of that height: what a number above a bar takes
LETTER_IN = 0.055  # width of one in a label
LOOKS = ((GREY, ""), (ORANGE, "////"), (BLUE, ""))  # of the states of a rig, the last one best
SLANT = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"}


def budget_figure(budget: Sequence[Stage]) -> Figure:
    """The falling error as a waterfall: what is left after each step, and what the step took.

    The axis is logarithmic, or the last steps could not be seen beside the first, and bars rise
    from 1, where nothing but sensor noise is left, if none falls so low.  Outlines reach up to the
    step before (or down, where an effect was dropped).  Shifts of what was there, what the backward
    and the swap pass did, and empirical terms stand on a grey ground with a word.
    """
    wide = len(budget) > WIDE_FROM
    with styled():
        width_in = PAGE_IN if wide else COLUMN_IN
        labels = [_broken(stage.label) for stage in budget]
        longest = max(len(line) for label in labels for line in label.split("\n"))
        crowded = longest * LETTER_IN > 0.85 * width_in / len(budget)
        figure = new_figure(width_in, 3.4 if crowded else 2.6)
        axes = figure.subplots()
        places = np.arange(len(budget))
        axes.set_xticks(places, labels, **(SLANT if crowded else {}))
        sets = (
            ("training", [stage.train for stage in budget], BLUE, ""),
            ("validation", [stage.validation for stage in budget], ORANGE, "////"),
        )
        for offset, (label, values, colour, hatch) in zip((-0.2, 0.2), sets, strict=True):
            axes.bar(places + offset, values, 0.38, color=colour, hatch=hatch, label=label)
            falls = [before - after for before, after in pairwise(values)]
            axes.bar(
                places[1:] + offset, falls, 0.38, values[1:], label=f"change of {label}",
                facecolor="none", edgecolor=BLACK, linewidth=0.5, linestyle=(0, (2, 2)), zorder=0.5,
            )  # fmt: skip
        _mark(axes, budget)
        axes.grid(False, axis="x")
        _logarithmic(axes, [value for _, values, *_ in sets for value in values])
        for offset, (_, values, *_) in zip((-0.2, 0.2), sets, strict=True):
            _write_sizes(axes, places + offset, values)
        axes.set_ylabel("weighted squared error\nper sample (-)")
        axes.set_title("error after each step, weighed by sensor noise alone")
        filled, outlines = axes.containers[::2], axes.containers[1:2]
        named = ["training", "validation", "what the step changed"]
        figure.legend([*filled, *outlines], named, loc="outside lower center", ncols=3)
    return figure


def _write_sizes(axes: Axes, places: np.ndarray, values: Sequence[float]) -> None:
    """The size of each bar above it, and above its outline where that ends close to the bar."""
    low, high = axes.get_ylim()
    close = (high / low) ** NEAR
    behind = {"facecolor": "white", "edgecolor": "none", "pad": 0.2}  # an outline's side may run
    for place, before, now in zip(places, [values[0], *values], values, strict=False):
        if not isfinite(now):
            continue
        top = before if now < before < now * close else now
        axes.annotate(
            f"{now:.3g}".replace("e+0", "e"), (place, top), (0.0, 1.5), textcoords="offset points",
            ha="center", va="bottom", fontsize=6, bbox=behind,
        )  # fmt: skip


def _broken(label: str) -> str:
    """A label over several lines: at its place, and between two effects."""
    return label.replace("@", "\n@").replace(" for ", "\nfor ").replace(" + ", "\n+ ")


def _logarithmic(axes: Axes, values: Sequence[float]) -> None:
    """A logarithmic axis from 1, or from below the least value, with room for words on top."""
    sizes = [value for value in values if isfinite(value) and value > 0.0] or [1.0]
    low, high = min(1.0, 0.5 * min(sizes)), max(*sizes, 2.0)
    axes.set_yscale("log")
    axes.set_ylim(low, high * (high / low) ** HEADROOM)


def _mark(axes: Axes, budget: Sequence[Stage]) -> None:
    """A grey ground and a word where a step is no plain addition of an effect."""
    for place, stage in enumerate(budget):
        if stage.change in (Change.START, Change.REFITTED, Change.ADDED):
            continue
        axes.axvspan(place - 0.5, place + 0.5, color="0.9", zorder=0)
        axes.text(
            place, 0.98, stage.change.value, ha="center", va="top", fontsize=7, style="italic",
            transform=axes.get_xaxis_transform(),
        )  # fmt: skip


def before_after_figure(
    before: Mapping[str, Mapping[str, SignalError]],
    after: Mapping[str, Mapping[str, SignalError]],
    unit_of: Mapping[str, str],
    words: tuple[str, str] = ("before", "after"),
) -> Figure:
    """RMSE over windows of each output before and after, in these words, on each set."""
    return errors_figure(dict(zip(words, (before, after), strict=True)), unit_of)


def errors_figure(
    states: Mapping[str, Mapping[str, Mapping[str, SignalError]]], unit_of: Mapping[str, str]
) -> Figure:
    """RMSE of each output on each set, in each state of a rig by its words."""
    first, width = next(iter(states.values())), 0.8 / len(states)
    outputs = list(next(iter(first.values())))
    looks = LOOKS[-len(states) :]
    with styled():
        figure = new_figure(PAGE_IN, 2.2)
        panels = figure.subplots(1, len(outputs), squeeze=False)[0]
        for axes, output in zip(panels, outputs, strict=True):
            full = unit_of.get(output, output)
            factor = 1.0 / display_scale(full).factor
            sets = [
                label
                for label in first
                if all(output in each.get(label, {}) for each in states.values())
            ]
            places = np.arange(len(sets))
            axes.set_xticks(places, sets)
            for k, (label, errors) in enumerate(states.items()):
                values = [factor * errors[name][output].rmse for name in sets]
                at = places + width * (k - 0.5 * (len(states) - 1))
                colour, hatch = looks[k]
                bars = axes.bar(at, values, 0.95 * width, color=colour, hatch=hatch, label=label)
                axes.bar_label(bars, fmt="%.2g", fontsize=6)
            axes.margins(y=0.15)
            axes.grid(False, axis="x")
            axes.set_ylabel(f"RMSE ({display_unit(full)})")
            axes.set_title(public_name(output).replace(".", " ").replace("_", " "))
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    return figure
