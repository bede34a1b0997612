"""Rows over time in one source: thinned to what is in view, the same samples in every picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.figures.decimation import MOST_POINTS, peaks

if TYPE_CHECKING:
    from bokeh.document import Document

SETTLE_MS = 30  # from the last step of a zoom until the points of the new window are sent
TIME, SAMPLE = "time", "sample"


class Traces:
    """All rows of a recording, and a source that holds those points of them that are in view."""

    def __init__(self, document: Document) -> None:
        from bokeh.models import ColumnDataSource, Range1d

        self._document = document
        self.source = ColumnDataSource(data={TIME: [], SAMPLE: []}, name="traces")
        self.range = Range1d(0.0, 1.0)
        self.rows: dict[str, np.ndarray] = {TIME: np.zeros(0)}
        self.selected = np.zeros(0, dtype=bool)
        self._peaks: np.ndarray = np.zeros((0, 0))
        self._waiting = False
        for end in ("start", "end"):
            self.range.on_change(end, self._moved)

    def put(self, rows: Mapping[str, np.ndarray], peaks_of: list[str]) -> None:
        """Other rows, each (n,), ``time`` among them; the peaks of some of them stay."""
        self.rows = {name: np.asarray(each, dtype=float) for name, each in rows.items()}
        self._peaks = np.array([self.rows[name] for name in peaks_of])
        time = self.rows[TIME]
        self.selected = np.zeros(len(time), dtype=bool)
        low, high = (float(time[0]), float(time[-1])) if len(time) else (0.0, 1.0)
        self.source.selected.indices = []
        self.source.data = self._window(low, high)
        self.range.update(start=low, end=high, reset_start=low, reset_end=high)

    def _window(self, low: float, high: float) -> dict[str, Any]:
        """The points to be drawn between two times."""
        time = self.rows[TIME]
        first, last = np.searchsorted(time, [low, high])
        kept = peaks(self._peaks, int(first) - 1, int(last) + 1, MOST_POINTS)
        return {SAMPLE: kept, **{name: each[kept] for name, each in self.rows.items()}}

    def _moved(self, _attr: str, _old: float, _new: float) -> None:
        """Draw anew once the window stands still."""
        if not self._waiting:
            self._waiting = True
            self._document.add_timeout_callback(self._draw, SETTLE_MS)

    def _draw(self) -> None:
        self._waiting = False
        kept = self.source.data[SAMPLE]
        found = self._window(self.range.start, self.range.end)
        if not np.array_equal(kept, found[SAMPLE]):
            self._document.hold("collect")  # points and what is lit of them are drawn once
            self.source.data = found
            self._light()
            self._document.unhold()

    def select(self, within: np.ndarray) -> None:
        """Light up samples (n,) in every picture."""
        self.selected = within
        self._light()

    def _light(self) -> None:
        kept = np.asarray(self.source.data[SAMPLE], dtype=int)
        lit = np.flatnonzero(self.selected[kept]) if len(kept) else np.zeros(0, dtype=int)
        self.source.selected.indices = lit.tolist()


def inside(
    rows: Mapping[str, np.ndarray], x: str, y: str | None, box: Mapping[str, float]
) -> np.ndarray:
    """Samples of which the point (x, y) lies in a box; only x counts without y."""
    found = _between(rows[x], box["x0"], box["x1"])
    return found if y is None else found & _between(rows[y], box["y0"], box["y1"])


def _between(values: np.ndarray, one: float, other: float) -> np.ndarray:
    return (values >= min(one, other)) & (values <= max(one, other))


def on_box(figure: Any, act: Callable[[Mapping[str, float]], None], clear: Callable) -> None:
    """Call with the box of a finished selection; or that there is none any more."""
    from bokeh.events import Reset, SelectionGeometry

    def chosen(event: Any) -> None:
        if event.final and event.geometry.get("type") == "rect":
            act(event.geometry)

    figure.on_event(SelectionGeometry, chosen)
    figure.on_event(Reset, lambda _: clear())
