"""The figure of the next recording: what each rival would record, and how far they are apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

from studies.figures.style import GREY, PAGE_IN, new_figure, styled, thinned
from workbench.units import display_scale, display_unit, public_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from workbench.diagnosis.result import NextRecording

BAND = 2.0  # standard deviations of the sensor noise


def next_recording_figure(found: NextRecording) -> Figure:
    """Commands and outputs of every rival; beside them the outputs less those of the likeliest.

    ``found`` holds predictions; the band is that of the sensor noise.
    """
    outputs = list(found.noise)
    names = [*found.commands, *outputs]
    with styled():
        figure = new_figure(PAGE_IN, 0.6 + 1.25 * len(names))
        panels = figure.subplots(len(names), 2, sharex=True, squeeze=False)
        for (left, right), name in zip(panels, names, strict=True):
            _draw_predicted(left, found, name)
            _draw_apart(right, found, name)
        for axes in panels[-1]:
            axes.set_xlabel("time (s)")
        panels[0][0].set_title("what each would record")
        panels[0][1].set_title(f"less what {found.separates[0]} would record")
        handles, labels = panels[0][0].get_legend_handles_labels()
        more, said = panels[-1][1].get_legend_handles_labels()
        handles, labels = handles + more[-1:], labels + said[-1:]
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(handles), 3))
    return figure


def _draw_predicted(axes: Axes, found: NextRecording, name: str) -> None:
    per_si = display_scale(name)
    for rival, recording in found.predicted.items():
        axes.plot(*thinned(recording.time_s, per_si.from_si(recording[name])), label=rival)
    part, _, quantity = public_name(name).replace("_", " ").partition(".")
    unit = display_unit(name)
    axes.set_ylabel(f"{part}\n{quantity}" + (f" ({unit})" if unit else ""))


def _draw_apart(axes: Axes, found: NextRecording, name: str) -> None:
    """Differences from the likeliest rival, which has none; its place in the colours stays."""
    recordings = list(found.predicted.values())
    per = 1.0 / display_scale(name).factor
    for rival, recording in found.predicted.items():
        apart = per * (recording[name] - recordings[0][name])
        axes.plot(*thinned(recording.time_s, apart), label=rival)
    if name in found.noise:
        size = BAND * per * found.noise[name]
        axes.axhspan(-size, size, color=GREY, alpha=0.5, linewidth=0, label="sensor noise, two sd")
    words = public_name(name).rpartition(".")[2].replace("_", " ")
    unit = display_unit(name)
    axes.set_ylabel(f"{words} apart" + (f" ({unit})" if unit else ""))
