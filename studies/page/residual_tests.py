"""The two residual tests by their names: whiteness, and independence of the input."""

from __future__ import annotations

from html import escape
from math import isfinite
from typing import TYPE_CHECKING, Any

from studies.figures.style import BLUE
from studies.page.look import SOFT, chart, column, put, row, sharing, text
from studies.text import outside_band
from workbench.units import public_name

if TYPE_CHECKING:
    from bokeh.models import Model

    from workbench.comparison.independence import Independence
    from workbench.comparison.residuals import Residual

HEIGHT = 170


class ResidualTests:
    """Correlations of a one-step error with itself and with the input, with their 95 % bands."""

    def build(self) -> Model:
        """Two charts."""
        from bokeh.models import ColumnDataSource

        self._sources, self._charts = [], []
        for y in ("autocorrelation (-)", "with the input (-)"):
            source = ColumnDataSource(data={"lag": [], "value": [], "low": [], "high": []})
            found = chart("lag (ms)", y, HEIGHT)
            found.varea("lag", "low", "high", source=source, fill_color=SOFT, fill_alpha=0.18)
            found.segment("lag", 0, "lag", "value", source=source, color=BLUE, line_width=1.5)
            self._sources.append(source)
            self._charts.append(found)
        self._titles = [text(), text()]
        pairs = [
            column(title, found) for title, found in zip(self._titles, self._charts, strict=True)
        ]
        for each in pairs:
            sharing(each, 1, 380)
        self._pairs = pairs
        whole = row(*pairs, top=True)
        whole.visible = False
        self._whole = whole
        return whole

    def clear(self) -> None:
        """Nothing to test."""
        self._whole.visible = False

    def show(self, name: str, residual: Residual, against: Independence | None) -> None:
        """Both tests of one output."""
        self._whole.visible = True
        output = public_name(name)
        self._put(0, residual.lag_s[1:], residual.correlation[1:], residual.bands[1:],
                  _said(f"Whiteness of {output}, one step ahead", residual.outside))  # fmt: skip
        self._pairs[1].visible = against is not None
        if against is not None:
            input_ = public_name(against.against)
            what = f"Independence of {output} from {input_}, from lag 0 on"
            told = _said(what, against.outside)
            self._put(1, against.lag_s, against.correlation, against.bands, told)

    def _put(self, k: int, lag_s: Any, values: Any, bands: Any, title: str) -> None:
        rows = {"lag": 1e3 * lag_s, "value": values, "low": -bands, "high": bands}
        self._sources[k].data = rows
        put(self._titles[k], f"<p>{escape(title)}</p>")


def _said(what: str, outside: float) -> str:
    chance = " (5 % is chance)" if isfinite(outside) else ""
    return f"{what}: {outside_band(outside)}{chance}"
