"""The poles of modes: all in one plane, by what distinguishes them, and a small map for each."""

from __future__ import annotations

from itertools import cycle
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLUE, GREEN, ORANGE, PAGE_IN, RED, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linearize.modes import HybridModel, Mode

SINGLE_MAPS = 64  # more modes have no map each
ACROSS, LETTERS = 6, 26  # maps side by side, and letters of a line above one
MARGIN = 0.15  # of the range of all poles, beyond them in each map
MOST_BESIDE = 6  # labels of a line of the legend
MARKERS = ("o", "s", "^", "D", "v", "x")
COLOURS = (BLUE, RED, GREEN, ORANGE)


def pole_figure(hybrid: HybridModel) -> Figure:
    """Poles of every mode: a panel per region of one cut, a marker per region of another.

    Markers tell where something holds, by sticking or at a stop, panels the first other cut.
    """
    first, second = _cuts(hybrid)
    panels = list(dict.fromkeys(_label(mode, first) for mode in hybrid.modes))
    kinds = list(dict.fromkeys(_label(mode, second) for mode in hybrid.modes))
    with styled():
        figure = new_figure(PAGE_IN, 2.6)
        axes = figure.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False)[0]
        for panel, label in zip(axes, panels, strict=True):
            looks = zip(cycle(MARKERS), cycle(COLOURS))  # 12 that differ
            for kind, (marker, colour) in zip(kinds, looks, strict=False):
                chosen = [
                    mode
                    for mode in hybrid.modes
                    if _label(mode, first) == label and _label(mode, second) == kind
                ]
                if not chosen:
                    continue
                poles = np.concatenate([np.linalg.eigvals(mode.A) for mode in chosen])
                panel.plot(
                    poles.real,
                    poles.imag,
                    marker,
                    color=colour,
                    markersize=4,
                    markerfacecolor="none",
                    linestyle="none",
                    label=kind,
                )
            panel.axvline(0.0, color="0.4", linewidth=0.6)
            panel.set_title(f"{first.partition('.')[0].replace('_', ' ')}: {label}")
            panel.set_xlabel("real part (1/s)")
        axes[0].set_ylabel("imaginary part (rad/s)")
        named = {}
        for panel in axes:
            handles, labels = panel.get_legend_handles_labels()
            named |= dict(zip(labels, handles, strict=True))
        columns = min(len(named), MOST_BESIDE)
        figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=columns)
    return figure


def mode_poles_figure(hybrid: HybridModel) -> Figure:
    """A pole map for every mode, all to one scale."""
    number = len(hybrid.modes)
    across = min(ACROSS, number)
    down = -(-number // across)
    by_mode = [np.linalg.eigvals(mode.A) for mode in hybrid.modes]
    every = np.concatenate(by_mode)
    # not shared axes: each of sixty would ask all others of their ends
    ends = {"xlim": _with_margin(every.real), "ylim": _with_margin(every.imag)}
    with styled():
        figure = new_figure(PAGE_IN, 0.8 + 1.05 * down)
        grid = figure.subplots(down, across, squeeze=False)
        for panel in grid.ravel()[number:]:
            panel.remove()
        for k, (panel, mode) in enumerate(zip(grid.ravel(), hybrid.modes, strict=False)):
            panel.axvline(0.0, color="0.4", linewidth=0.6)
            panel.plot(
                by_mode[k].real,
                by_mode[k].imag,
                "x",
                color=BLUE,
                markersize=4,
                linestyle="none",
                label="pole",
            )
            panel.set(**ends)
            panel.set_title("\n".join(wrap(f"{k + 1}  {mode.name}", LETTERS)), fontsize=5.5)
            below = k + across >= number
            panel.tick_params(labelsize=6, labelbottom=below, labelleft=k % across == 0)
        figure.supxlabel("real part (1/s)", fontsize=8)
        figure.supylabel("imaginary part (rad/s)", fontsize=8)
    return figure


def _with_margin(values: np.ndarray) -> tuple[float, float]:
    """Ends of an axis that holds the values, and zero, with room for their marks."""
    low, high = min(0.0, values.min()), max(0.0, values.max())
    room = MARGIN * (high - low or 1.0)
    return low - room, high + room


def _cuts(hybrid: HybridModel) -> tuple[str, str]:
    """The signals of the panels and of the markers: of these a velocity that rests, if one does."""
    from linearize.holding import resting_states

    holding = [mode for mode in hybrid.modes if any(part.holds for part in mode.box.values())]
    resting = (n for mode in holding for n in mode.box if n in resting_states(hybrid, mode))
    places = (n for mode in holding for n, part in mode.box.items() if part.holds)
    second = next(resting, next(places, None))
    cut = [mode.box for mode in hybrid.modes if second is None or second in mode.box]
    names = [*max(cut, key=len)]
    second = second or names[-1]
    return next((name for name in names if name != second), second), second


def _label(mode: Mode, signal: str) -> str:
    """The mode's region of a signal; where it does not mind the signal, what it holds at."""
    held = (region.label for region in mode.box.values() if region.holds)
    return mode.box[signal].label if signal in mode.box else next(held, "any")
