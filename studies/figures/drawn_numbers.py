"""What a figure draws, as numbers: a table of all its curves, bars and cells, panel by panel.

Every panel has a name of its own.  What a figure module gives as the label of its axes stands as it
is; otherwise a title or the label of an axis serves where it tells all panels apart, then the title
of the column with the labels of the row, which shared axes have from each other.  Curves without a
label are called after what they show; one that begins with an underscore is kept off legends, but
not out of the table.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

UNNAMED = re.compile(r"_(child\d+|container\d+|nolegend_)?$")  # by Matplotlib, or by nobody
SCALE = "<colorbar>"


def write_drawn(figure: Figure, path: Path) -> None:
    """One row per point: panel, curve, x and y; the ends of its error bar, where any has one."""
    ends = [_bar_ends(axes) for axes in figure.axes]
    more = ("low", "high") if any(ends) else ()
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("panel", "curve", "x", "y", *more))
        for axes, panel, own in zip(figure.axes, panel_names(figure), ends, strict=True):
            found = [*_curves(axes)]
            named = curve_names(axes, found)
            for k, (curve, (_, x, y)) in enumerate(zip(named, found, strict=True)):
                names = _as_named(panel), _as_named(curve)
                bars = own.get(k, [("",) * len(more)] * len(x))
                writer.writerows(
                    (*names, *map(_short, (a, b, *bar)))
                    for a, b, bar in zip(x, y, bars, strict=True)
                )


def _bar_ends(axes: Axes) -> dict[int, list[tuple[float, float]]]:
    """Lower and upper ends of the error bars of each line that has them, by its number."""
    found = {}
    for each in axes.containers:
        if getattr(each, "has_yerr", False):
            points, _, bars = each.lines
            ends = [bar.vertices[:, 1] for bar in bars[-1].get_paths()]
            found[list(axes.lines).index(points)] = [(low, high) for low, high in ends]
    return found


def panel_names(figure: Figure) -> list[str]:
    """The name of each panel of a figure, in the order of its axes, each another one."""
    every = figure.axes
    panels = [axes for axes in every if axes.get_visible() and axes.get_label() != SCALE]
    titled = {bool(axes.get_title()) for axes in panels if not axes.get_label()}
    ways: list[Callable[[Axes], tuple[str, ...]]] = [
        lambda a: (_title(a), _y_label(a)),
        lambda a: (_title(a), _row_label(a), _y_label(a)),
        lambda a: (_title(a), _row_label(a), _y_label(a), _x_label(a)),
    ]
    if len(titled) < 2:  # where some have a title only, it is that of their column
        ways.insert(0, lambda a: (a.get_title() or _y_label(a) or _x_label(a),))
    for way in ways:
        names = [_joined(*_given(axes, way)) for axes in every]
        shown = [name for axes, name in zip(every, names, strict=True) if axes in panels]
        if all(shown) and len(set(shown)) == len(shown):
            break
    often = Counter(names)
    return [
        name if name and often[name] == 1 else _joined(name, f"panel {k}")
        for k, name in enumerate(names, start=1)
    ]


def _given(axes: Axes, way: Callable[[Axes], tuple[str, ...]]) -> tuple[str, ...]:
    label = str(axes.get_label())
    if label == SCALE:
        return ("scale", axes.get_title() or axes.get_ylabel() or axes.get_xlabel())
    return (label,) if label else way(axes)


def _joined(*parts: str) -> str:
    """The parts on one line, each once; where a label breaks its line, a cell does not."""
    words = (" ".join(part.split()) for part in parts)
    return ", ".join(dict.fromkeys(word for word in words if word))


def _title(axes: Axes) -> str:
    """The title of a panel, or the nearest above it in its column."""
    spec = axes.get_subplotspec()
    if axes.get_title() or spec is None:
        return axes.get_title()
    above = [
        (other.get_subplotspec().rowspan.start, other.get_title())
        for other in _of_grid(axes)
        if other.get_subplotspec().colspan == spec.colspan
        and other.get_subplotspec().rowspan.start < spec.rowspan.start
    ]
    return max(((row, title) for row, title in above if title), default=(0, ""))[1]


def _row_label(axes: Axes) -> str:
    """The label at the left end of a panel's row."""
    spec = axes.get_subplotspec()
    if spec is None:
        return ""
    row = [a for a in _of_grid(axes) if a.get_subplotspec().rowspan == spec.rowspan]
    return min(row, key=lambda a: a.get_subplotspec().colspan.start).get_ylabel()


def _y_label(axes: Axes) -> str:
    sharing = axes.get_shared_y_axes().get_siblings(axes)
    return axes.get_ylabel() or _shared(a.get_ylabel() for a in sharing) or _overall(axes, "y")


def _x_label(axes: Axes) -> str:
    sharing = axes.get_shared_x_axes().get_siblings(axes)
    return axes.get_xlabel() or _shared(a.get_xlabel() for a in sharing) or _overall(axes, "x")


def _shared(labels: Iterator[str]) -> str:
    """The label of shared axes if it is the same wherever there is one."""
    found = {label for label in labels if label}
    return found.pop() if len(found) == 1 else ""


def _overall(axes: Axes, way: str) -> str:
    return str(getattr(axes.figure, f"get_sup{way}label")())


def _of_grid(axes: Axes) -> list[Axes]:
    """The panels of the same grid."""
    grid = axes.get_gridspec()
    return [a for a in axes.figure.axes if a.get_subplotspec() and a.get_gridspec() is grid]


def curve_names(axes: Axes, curves: list[tuple[str, list, list]]) -> list[str]:
    """The label of each curve; one without is a level, an upright, or what the panel shows."""
    names = [
        _unlabelled(axes, x, y) if UNNAMED.fullmatch(label) else label.removeprefix("_")
        for label, x, y in curves
    ]
    bare = [bool(UNNAMED.fullmatch(label)) for label, _, _ in curves]
    often, counted = Counter(names), Counter[str]()
    for k, name in enumerate(names):
        if bare[k] and often[name] > 1:
            counted[name] += 1
            names[k] = f"{name} {counted[name]}"
    return names


def _unlabelled(axes: Axes, x: list, y: list) -> str:
    if len(x) == 2 and [*x] == [0, 1] and y[0] == y[1]:
        return "level"
    if len(x) == 2 and [*y] == [0, 1] and x[0] == x[1]:
        return "upright"
    words = _joined(_y_label(axes) or _x_label(axes) or axes.get_title())
    return words.rpartition(" (")[0] or words or "curve"


def _curves(axes: Axes) -> Iterator[tuple[str, list, list]]:
    """Label, x and y of each line, cell of a map, point cloud and group of bars."""
    spread = {each.lines[0]: each for each in axes.containers if hasattr(each, "has_yerr")}
    for line in axes.lines:  # of points with error bars the label is that of both together
        label = spread.get(line, line).get_label()
        yield str(label), list(line.get_xdata()), list(line.get_ydata())
    for mesh in axes.collections:
        if hasattr(mesh, "get_coordinates"):
            yield from _cells(mesh)
    for image in axes.images:
        yield from _image_cells(axes, image)
    for cloud in axes.collections:
        if hasattr(cloud, "get_coordinates"):
            continue
        points = np.ma.getdata(cloud.get_offsets())
        if len(points) > 1:
            yield str(cloud.get_label()), list(points[:, 0]), list(points[:, 1])
    for bars in axes.containers:
        if not hasattr(bars, "patches"):
            continue
        flat = getattr(bars, "orientation", "vertical") == "horizontal"
        words = _words(axes.yaxis if flat else axes.xaxis)
        sizes = [p.get_width() if flat else p.get_height() for p in bars.patches]
        middles = [
            p.get_y() + p.get_height() / 2 if flat else p.get_x() + p.get_width() / 2
            for p in bars.patches
        ]
        nearest = [min(words, key=lambda at, m=m: abs(at - m), default=m) for m in middles]
        yield str(bars.get_label()), [words.get(at, at) for at in nearest], sizes


def _cells(mesh: QuadMesh) -> Iterator[tuple[str, list, list]]:
    """Value of each cell that is shown, and its middle."""
    corners, values = np.asarray(mesh.get_coordinates()), np.ma.masked_invalid(mesh.get_array())
    middles = (corners[1:, 1:] + corners[:-1, :-1]) / 2.0
    for row, column in zip(*np.nonzero(~np.ma.getmaskarray(values)), strict=True):
        x, y = middles[row, column]
        yield f"{values[row, column]:.6g}", [x], [y]


def _image_cells(axes: Axes, image: AxesImage) -> Iterator[tuple[str, list, list]]:
    """Value of each cell that is shown, and the words at its ticks, or its middle without any."""
    values, (left, right, bottom, top) = np.ma.masked_invalid(image.get_array()), image.get_extent()
    if image.origin == "lower":
        bottom, top = top, bottom
    over, beside = _words(axes.xaxis), _words(axes.yaxis)
    rows, columns = values.shape[:2]
    if values.ndim != 2:  # a picture
        return
    for row, column in zip(*np.nonzero(~np.ma.getmaskarray(values)), strict=True):
        x = left + (column + 0.5) * (right - left) / columns
        y = top + (row + 0.5) * (bottom - top) / rows
        shown = [over.get(round(x, 6), x)], [beside.get(round(y, 6), y)]
        yield f"{values[row, column]:.6g}", *shown


def _words(axis: Axis) -> dict[float, str]:
    """The labels of an axis by where they stand, also where a panel hides them."""
    ticks = axis.get_ticklocs()
    labels = axis.get_major_formatter().format_ticks(ticks)
    return {round(float(at), 6): label for at, label in zip(ticks, labels, strict=True)}


def _as_named(words: str) -> str:
    """Words of a figure without what keeps a dollar from beginning a formula."""
    return words.replace(r"\$", "$")


def _short(value: object) -> str:
    return value if isinstance(value, str) else f"{float(value):.6g}"
