"""How well modes predict: the error by their number, and a run beside the plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLACK, GREY, PAGE_IN, new_figure, styled
from studies.text import labelled
from workbench.units import display_scale, display_unit, public_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linearize.hybrid_simulation import HybridRun
    from linearize.modes import HybridModel

LINES = ("-", "--", ":")
MARKERS = ("o", "s", "^", "D")
REAL_PARTS = (-1000, -100, -10, 0, 10, 100)  # ticks, 1/s


def placement_figure(
    numbers: Sequence[int],
    errors: Mapping[str, Sequence[float]],
    points: Mapping[str, tuple[int, float]],
    levels: Mapping[str, float],
) -> Figure:
    """Prediction error by number of modes, both axes logarithmic.

    ``errors`` are curves by label, ``points`` single sets of modes to compare, ``levels`` lines.
    """
    with styled():
        figure = new_figure(PAGE_IN / 1.6, 3.0)
        axes = figure.subplots()
        for (label, values), marker in zip(errors.items(), MARKERS, strict=False):
            axes.loglog(numbers, values, marker=marker, markersize=3, label=label)
        for (label, (number, error)), marker in zip(points.items(), ("x", "+", "*"), strict=False):
            axes.plot(
                number, error, marker, color=BLACK, markersize=6, linestyle="none", label=label
            )
        for (label, error), line in zip(levels.items(), (":", "--", "-."), strict=False):
            axes.axhline(error, color=BLACK, linestyle=line, linewidth=0.8, label=label)
        axes.set_xlabel("number of modes (-)")
        axes.set_ylabel("RMS prediction error (share of scale)")
        ticks = [n for n in (3, 5, 10, 20, 30, 50, 100) if numbers[0] <= n <= numbers[-1]]
        axes.set_xticks(ticks, map(str, ticks))
        axes.set_xticks([], minor=True)
        marks = [0.01, 0.02, 0.03, 0.05, 0.1]
        axes.set_yticks(marks, map(str, marks))
        axes.set_yticks([], minor=True)
        figure.legend(loc="outside lower center", ncols=2)
    return figure


def overlay_figure(
    hybrid: HybridModel,
    sample_time_s: float,
    plant: np.ndarray,
    commands: np.ndarray,
    runs: Mapping[str, HybridRun],
) -> Figure:
    """First states of the plant, (n_shown, n), with those of hybrid models; commands and modes.

    The modes are those of the first run, which belongs to ``hybrid``.
    """
    model, time_s = hybrid.model, sample_time_s * np.arange(plant.shape[1])
    first = next(iter(runs.values()))
    rows = -(-len(plant) // 2)
    with styled():
        figure = new_figure(PAGE_IN, 1.6 + 1.5 * rows)
        grid = figure.add_gridspec(rows + 1, 2)
        for k, name in enumerate(model.states[: len(plant)]):
            axes = figure.add_subplot(grid[k // 2, k % 2 if len(plant) > 1 else slice(None)])
            scale = display_scale(name)
            axes.plot(
                time_s, scale.from_si(plant[k]), color=GREY, linestyle="-", linewidth=2.5,
                label="plant",
            )  # fmt: skip
            for label, run in runs.items():
                axes.plot(time_s, scale.from_si(run.states[k]), label=label)
            axes.set_ylabel(labelled(name))
        handles = axes.get_legend_handles_labels()
        below = figure.add_subplot(grid[rows, 0])
        for name, row, line in zip(model.commands, commands, LINES, strict=False):
            given = display_scale(name).from_si(row)
            below.plot(time_s, given, color=BLACK, linestyle=line, label=public_name(name))
            below.set_ylabel(labelled(name))
        if len(model.commands) > 1:
            below.set_ylabel(f"commands ({display_unit(model.commands[0])})")
            above = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "borderaxespad": 0.1}
            below.legend(fontsize=6, ncols=len(model.commands), columnspacing=1.0, **above)
        below.set_xlabel("time (s)")
        active = figure.add_subplot(grid[rows, 1])
        there = list(dict.fromkeys(first.modes))
        place = [there.index(k) for k in first.modes]
        active.step(time_s, place, where="post", color=BLACK, linestyle="-")
        active.set_yticks(range(len(there)), [hybrid.modes[k].name for k in there], fontsize=6)
        active.set_xlabel("time (s)")
        figure.legend(*handles, loc="outside lower center", ncols=len(runs) + 1)
    return figure


def point_figure(hybrid: HybridModel, kind: str, colour: str) -> Figure:
    """Poles of every mode, a panel for each region of the signal ``kind``.

    The shade tells the value of the signal ``colour`` at the operating point.  Far to the right lie
    modes on the falling branch of the Stribeck curve, which a slide passes within milliseconds.
    """
    labels = list(dict.fromkeys(mode.box[kind].label for mode in hybrid.modes))
    scale = display_scale(colour)
    with styled():
        figure = new_figure(PAGE_IN, 2.6)
        axes = figure.subplots(1, len(labels), sharex=True, sharey=True, squeeze=False)[0]
        for panel, label in zip(axes, labels, strict=True):
            modes = [mode for mode in hybrid.modes if mode.box[kind].label == label]
            poles = np.concatenate([np.linalg.eigvals(mode.A) for mode in modes])
            at = np.repeat([_at(hybrid, mode, colour) for mode in modes], [len(m.A) for m in modes])
            drawn = panel.scatter(
                poles.real, poles.imag, c=scale.from_si(at), cmap="cividis_r", s=14, marker="o",
                edgecolors="0.3", linewidths=0.4, label=label, vmin=0.0,
            )  # fmt: skip
            panel.axvline(0.0, color="0.4", linewidth=0.6)
            panel.set_xscale("symlog", linthresh=10.0)
            panel.set_xticks(REAL_PARTS, map(str, REAL_PARTS))
            panel.set_xticks([], minor=True)
            panel.set_title(f"{label}: {len(modes)} modes")
            panel.set_xlabel("real part (1/s)")
        axes[0].set_ylabel("imaginary part (rad/s)")
        bar = figure.colorbar(drawn, ax=[*axes])
        bar.set_label(labelled(colour))
        bar.outline.set_visible(False)
    return figure


def _at(hybrid: HybridModel, mode: object, name: str) -> float:
    from linearize.holding import whole_point

    return float(whole_point(hybrid, mode)[hybrid.model.states.index(name)])
