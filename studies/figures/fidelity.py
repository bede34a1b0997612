"""What the closed loop loses with each effect that its design model lacks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLACK, BLUE, GREEN, ORANGE, PAGE_IN, RED, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOKS = ((BLUE, "o"), (RED, "s"), (GREEN, "^"), (ORANGE, "v"))
APART = 0.15
TICKS = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)


def fidelity_figure(worse: Mapping[str, Mapping[str, float]], marks: Sequence[str]) -> Figure:
    """Each figure as a multiple of that with the whole model, by what the model lacks.

    A loop that has no such figure stands at the right edge.
    """
    from matplotlib.ticker import NullLocator

    names = sorted(worse, key=lambda name: worse[name][marks[0]])
    finite = [v for each in worse.values() for v in each.values() if np.isfinite(v)]
    edge = 1.3 * max(finite)
    with styled():
        figure = new_figure(PAGE_IN, 0.9 + 0.3 * len(names))
        axes = figure.subplots()
        for k, (mark, (colour, marker)) in enumerate(zip(marks, LOOKS, strict=False)):
            values = [min(worse[name][mark], edge) for name in names]
            at = np.arange(len(names)) + APART * ((len(marks) - 1) / 2.0 - k)
            axes.plot(values, at, marker, color=colour, markersize=4, label=mark)
        axes.axvline(1.0, color=BLACK, linestyle="--", linewidth=0.8, label="_whole model")
        axes.set_xscale("log")
        low, high = axes.get_xlim()
        axes.set_xticks([tick for tick in TICKS if low < tick < high])
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_yticks(range(len(names)), [f"without {name}" for name in names])
        axes.set_xlabel("times as large as with the whole model (-)")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure
