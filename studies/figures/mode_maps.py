"""Which mode is active where: over two signals, a panel for each value of the others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import PAGE_IN, new_figure, styled
from studies.text import labelled
from workbench.units import display_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from linearize.hybrid_simulation import SampledHybrid

CELLS = 72
COLOURS = "cividis"
PALE = 0.55  # of white in the colours, so that numbers can be read on them
TURN = 0.618  # of the colours between one mode and the next: neighbours differ
SHOWN = 0.004  # of the cells: smaller regions have no number
FINE = 0.02  # of the range: a narrower holding interval asks for a logarithmic axis around zero
TEXT_WIDTH = 160  # letters that a line of the legend takes
MAP_IN, LINE_IN = 2.7, 0.14  # height of the maps, and of a line of the legend

MEANING = "active mode by colour and number; the shade itself has no order"

Range = tuple[float, float]


def mode_map_figure(
    modes: SampledHybrid,
    ranges: Mapping[str, Range],
    panels: Mapping[str, Mapping[str, float]],
) -> Figure:
    """The active mode over two signals.

    ``ranges`` names the two signals, across first; ``panels`` gives the values of the others by
    title, the design model's initial and nominal ones where it says nothing.
    """
    from matplotlib.patches import Patch

    edges = {name: _edges(modes, name, ends) for name, ends in ranges.items()}
    drawn = {title: _active(modes, edges, values) for title, values in panels.items()}
    shown = sorted({k for active in drawn.values() for k in _large(active)})
    lines = [f"{k + 1}  {modes.hybrid.modes[k].name}" for k in shown]
    columns = max(TEXT_WIDTH // (max(map(len, lines)) + 8), 1)
    shades = _shades(len(modes.hybrid.modes))
    with styled():
        figure = new_figure(PAGE_IN, MAP_IN + LINE_IN * (1 - (-len(lines) // columns)))
        axes = figure.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False)[0]
        for panel, (title, active) in zip(axes, drawn.items(), strict=True):
            _drawn(panel, edges, active, shades)
            _numbered(panel, edges, active)
            panel.set_title(title)
            panel.set_xlabel(labelled(next(iter(ranges))))
        axes[0].set_ylabel(labelled([*ranges][1]))
        figure.legend(
            [Patch(facecolor=shades[k], edgecolor="0.6", linewidth=0.4) for k in shown],
            lines,
            title=MEANING,
            loc="outside lower center",
            ncols=columns,
            handlelength=1.2,
            handletextpad=0.4,
        )
    return figure


def _active(
    modes: SampledHybrid, edges: Mapping[str, np.ndarray], values: Mapping[str, float]
) -> np.ndarray:
    """Index of the active mode in every cell, shape (n_down, n_across)."""
    model = modes.hybrid.model
    names = (*model.states, *model.commands)
    usual = dict(zip(names, (*model.initial, *model.plant.nominal[0]), strict=True))
    across, down = np.meshgrid(*(_middles(each) for each in edges.values()))
    z = np.tile(np.array([*{**usual, **values}.values(), 1.0]), (across.size, 1))
    for name, value in zip(edges, (across, down), strict=True):
        z[:, names.index(name)] = value.ravel()
    return modes.active(z).reshape(across.shape)


def _edges(modes: SampledHybrid, name: str, ends: Range) -> np.ndarray:
    """Edges of cells over a range, dense around zero where a narrow interval there holds."""
    near = _near(modes, name)
    if near >= FINE * (ends[1] - ends[0]):
        return np.linspace(*ends, CELLS + 1)
    return near * np.sinh(np.linspace(*np.arcsinh(np.array(ends) / near), CELLS + 1))


def _near(modes: SampledHybrid, name: str) -> float:
    """Half of the narrowest interval in which a signal is held or slow, infinite without one."""
    every = modes.hybrid.modes
    regions = [mode.box[name] for mode in every if name in mode.box]
    halves = [(region.upper - region.lower) / 2.0 for region in regions if region.holds]
    guards = [guard for mode in every for guard in mode.guards if [*guard.weights] == [name]]
    return min(
        [*halves, *(abs(each.offset / each.weights[name]) for each in guards)], default=np.inf
    )


def _shades(number_of_modes: int) -> np.ndarray:
    """A colour for each mode, shape (n, 4)."""
    from matplotlib import colormaps

    return colormaps[COLOURS](TURN * np.arange(number_of_modes) % 1.0) * (1.0 - PALE) + PALE


def _drawn(
    panel: Axes, edges: Mapping[str, np.ndarray], active: np.ndarray, shades: np.ndarray
) -> None:
    from matplotlib.colors import ListedColormap

    x, y = (display_scale(name).from_si(each) for name, each in edges.items())
    panel.pcolormesh(
        x, y, active + 1, cmap=ListedColormap(shades), vmin=1, vmax=len(shades), rasterized=True
    )
    panel.grid(False)
    for set_scale, each in ((panel.set_xscale, x), (panel.set_yscale, y)):
        steps = np.diff(each)
        if steps.max() > 1.01 * steps.min():
            set_scale("symlog", linthresh=10.0 * float(steps.min()))


def _large(active: np.ndarray) -> list[int]:
    """The modes whose regions are large enough for a number."""
    found, cells = np.unique(active, return_counts=True)
    return [int(k) for k in found[cells > SHOWN * active.size]]


def _numbered(panel: Axes, edges: Mapping[str, np.ndarray], active: np.ndarray) -> None:
    x, y = (_middles(display_scale(name).from_si(each)) for name, each in edges.items())
    for k in _large(active):
        rows, columns = np.nonzero(active == k)
        away = (rows - rows.mean()) ** 2 + (columns - columns.mean()) ** 2
        place = (x[columns[away.argmin()]], y[rows[away.argmin()]])
        panel.annotate(str(k + 1), place, ha="center", va="center", fontsize=7)


def _middles(edges: np.ndarray) -> np.ndarray:
    return (edges[1:] + edges[:-1]) / 2.0
