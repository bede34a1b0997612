"""Tab 2: the plant against its recordings, every picture linked, and what the residuals hold."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.figures.style import BLUE, ORANGE
from studies.page import tasks
from studies.page.compare_text import errors_table, regimes_html, trace_rows
from studies.page.look import (
    MEASURED,
    NARROWEST,
    button,
    chart,
    column,
    guide,
    put,
    row,
    sharing,
    text,
)
from studies.page.residual_tests import ResidualTests
from studies.page.session import Session, recordings
from studies.page.traces import TIME, Traces, inside, on_box
from studies.page.verbs import compare_action, require_used, with_compared
from studies.text import labelled, percent
from workbench.units import display_unit, public_name

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bokeh.models import Model

    from studies.page.view import Page
    from workbench.comparison.compare import RecordingComparison

OVERLAY, ERROR, SCATTER = 112, 84, 190  # heights
WORST = 5  # % of the samples


class CompareTab:
    """Overlay and error over time, residuals over what drives them, errors by regime, tests."""

    title = "Compare"

    def __init__(self, page: Page) -> None:
        self._page = page
        self._of: Any = None
        self._clouds: list[Any] = []

    def build(self) -> Model:
        """Its widgets."""
        from bokeh.models import RangeSlider, Select

        self._traces = Traces(self._page.document)
        self._choices = {
            name: Select(title=title, options=[], width=width, name=name)
            for name, title, width in (
                ("recording", "Recording", 180),
                ("horizon", "Horizon", 150),
                ("signal", "Residual of", 200),
            )
        }
        for name in ("recording", "horizon"):
            self._choices[name].on_change("value", lambda _a, _o, _n: self._draw())
        self._choices["signal"].on_change("value", lambda _a, _o, _n: self._draw_residual())
        self._window = RangeSlider(
            title="Time window (s)", start=0, end=1, value=(0, 1), step=0.01, width=320
        )
        self._window.on_change("value_throttled", lambda _a, _o, new: self._zoom(*new))
        self._left, self._right = column(), column()
        sharing(self._left, 3, 480)
        sharing(self._right, 2, 500)
        self._lit = text('<p class="guide">Drag a box in any picture: the same samples light up '
                         "in all of them.</p>", name="lit")  # fmt: skip
        self._errors, self._regimes, self._notes = text(), text(), text()
        self._tests = ResidualTests()
        compare = button("Compare", self._compare, main=True, name="compare")
        return column(
            guide("See how well the plant tells what was recorded, one step ahead, over windows "
                  "and as a free run, and where it fails."),
            row(compare, *self._choices.values(), self._window,
                button(f"Select the worst {WORST} %", self._worst, name="worst"),
                button("Clear selection", self._clear)),
            self._lit,
            row(self._left, self._right, top=True),
            self._tests.build(),
            self._regimes,
            self._notes,
        )  # fmt: skip

    def of(self, session: Session) -> tuple[Any, ...]:
        """Parts of a session that it shows."""
        return (session.compared,)

    def show(self, session: Session) -> None:
        """The comparison of a session."""
        found = session.compared
        if found is None:
            self._of = None
            self._left.children, self._right.children = [], []
            for each in (self._errors, self._regimes, self._notes):
                put(each, "")
            self._tests.clear()
            return
        names = [each.name for each in found.comparison.recordings]
        choice = self._choices["recording"]
        choice.options = names
        if choice.value in names:
            self._draw()
        else:
            choice.value = names[0]

    def _compare(self) -> None:
        page = self._page

        if page.allows(require_used):
            session = page.session
            page.work(
                compare_action(session),
                lambda found: lambda now: with_compared(now, found),
                tasks.compare, session.now.rig, recordings(session.used),
            )  # fmt: skip

    def _chosen(self) -> tuple[int, RecordingComparison, str]:
        """Which recording is looked at, over which horizon."""
        found = self._page.session.compared
        each = self._choices["recording"]
        k = each.options.index(each.value)
        compared = found.comparison.recordings[k]
        horizon = self._choices["horizon"].value
        return k, compared, horizon if horizon in compared.simulated else compared.judged

    def _draw(self) -> None:
        """Everything of one recording and horizon."""
        found = self._page.session.compared
        if found is None or not self._choices["recording"].value:
            return
        k, each, horizon = self._chosen()
        if self._of == (found, k, horizon):
            return
        self._of = (found, k, horizon)
        outputs = [public_name(name) for name in each.measured]
        self._choices["horizon"].update(options=[*each.simulated], value=horizon)
        signal = self._choices["signal"]
        signal.update(
            options=outputs, value=signal.value if signal.value in outputs else outputs[0]
        )
        rows = trace_rows(each, horizon)
        peaked = [name for name in rows if name[:2] in ("m:", "s:", "e:")]
        rows |= {f"d:{i}": driver.values for i, driver in enumerate(found.drivers[k])}
        self._traces.put({TIME: each.time_s, **rows}, peaked)
        end = max(float(each.time_s[-1]), 1e-9)
        self._window.update(start=0.0, end=end, value=(0.0, end), step=end / 1000.0)
        self._left.children = self._over_time(each, horizon)
        self._right.children = [*self._over_drivers(found.drivers[k]), self._errors]
        put(self._errors, f"<h2>Errors of {escape(each.name)}</h2>" + errors_table(each))
        put(self._regimes, regimes_html(found.regimes[k][horizon], horizon))
        put(self._notes, "".join(f'<p class="guide">{escape(note)}</p>' for note in each.notes))
        self._draw_residual()

    def _over_time(self, each: RecordingComparison, horizon: str) -> list[Any]:
        """Overlay and error of every output, one time axis."""
        charts = [_legend(horizon)]
        for name in each.measured:
            last = name == [*each.measured][-1]
            label = labelled(name)
            upper = self._timed("", label, OVERLAY)
            for kind, colour, style in (("m", MEASURED, "solid"), ("s", BLUE, "dashed")):
                upper.line(
                    TIME, f"{kind}:{name}", source=self._traces.source, color=colour,
                    line_dash=style, line_width=1.6, nonselection_line_alpha=1.0,
                )  # fmt: skip
            self._marks(upper, f"m:{name}")
            unit = label.rpartition("(")[2].rstrip(")")
            lower = self._timed("time (s)" if last else "", f"error ({unit})", ERROR + 28 * last)
            lower.line(
                TIME, f"e:{name}", source=self._traces.source, color=BLUE, line_width=1.0,
                nonselection_line_alpha=1.0,
            )  # fmt: skip
            self._marks(lower, f"e:{name}")
            if not last:
                lower.xaxis.major_label_text_font_size = "0px"
            upper.xaxis.major_label_text_font_size = "0px"
            charts += [upper, lower]
        return charts

    def _timed(self, x: str, title: str, height: int) -> Any:
        found = chart(
            x, "", height, title, x_range=self._traces.range,
            tools="xbox_select,xpan,xwheel_zoom,reset", active_drag="xbox_select",
        )  # fmt: skip
        on_box(found, lambda box: self._choose(TIME, None, box), self._clear)
        return found

    def _marks(self, figure: Any, field: str) -> None:
        """Dots that are seen only where a sample is selected."""
        figure.scatter(
            TIME, field, source=self._traces.source, size=4, color=ORANGE,
            line_color=None, alpha=0.0, nonselection_alpha=0.0, selection_alpha=0.7,
        )  # fmt: skip

    def _over_drivers(self, drivers: Any) -> list[Any]:
        """Residual of one output over each driver."""
        self._clouds, charts = [], []
        for i, driver in enumerate(drivers):
            found = chart(
                driver.label, "residual", SCATTER, tools="box_select,pan,wheel_zoom,reset",
                active_drag="box_select",
            )  # fmt: skip
            sharing(found, 1, NARROWEST)
            field = f"d:{i}"
            cloud = found.scatter(
                field, TIME, source=self._traces.source, size=3, color=BLUE, line_color=None,
                alpha=0.5, nonselection_color=MEASURED,
                nonselection_alpha=0.25, selection_color=ORANGE, selection_alpha=0.95,
            )  # fmt: skip
            self._clouds.append((found, cloud))
            on_box(found, lambda box, field=field: self._choose(field, "residual", box),
                   self._clear)  # fmt: skip
            charts.append(found)
        pairs = [row(*charts[k : k + 2]) for k in range(0, len(charts), 2)]
        return pairs

    def _full(self) -> str:
        """Full name of the output whose residual is looked at."""
        _, each, _ = self._chosen()
        wanted = self._choices["signal"].value
        return next(name for name in each.measured if public_name(name) == wanted)

    def _draw_residual(self) -> None:
        """The residual of the chosen output in the clouds, and its tests."""
        found = self._page.session.compared
        if found is None or not self._choices["signal"].value or self._of is None:
            return
        k, each, _ = self._chosen()
        name = self._full()
        for figure, cloud in self._clouds:
            for glyph in (cloud.glyph, cloud.selection_glyph, cloud.nonselection_glyph):
                glyph.y = f"e:{name}"
            figure.yaxis.axis_label = f"residual ({display_unit(name)})"
        self._tests.show(name, each.residuals[name], found.independence[k].get(name))

    def _choose(self, x: str, y: str | None, box: Mapping[str, float]) -> None:
        """Light up what lies in a box of any picture."""
        field = f"e:{self._full()}" if y else None
        self._traces.select(inside(self._traces.rows, x, field, box))
        self._tell()

    def _worst(self) -> None:
        """Light up the largest residuals of the chosen output: a box without a mouse."""
        if self._of is None:
            return
        error = np.abs(self._traces.rows[f"e:{self._full()}"])
        self._traces.select(error >= np.nanpercentile(error, 100 - WORST))
        self._tell()

    def _clear(self) -> None:
        self._traces.select(np.zeros(len(self._traces.rows[TIME]), dtype=bool))
        self._tell()

    def _tell(self) -> None:
        """What the selected samples are."""
        rows, lit = self._traces.rows, self._traces.selected
        if not lit.any():
            self._lit.text = '<p class="guide">Nothing is selected.</p>'
            return
        name = self._full()
        error = rows[f"e:{name}"]
        share = float(np.nansum(error[lit] ** 2) / max(np.nansum(error**2), 1e-300))
        time = rows[TIME][lit]
        self._lit.text = (
            f'<p role="status">{lit.sum()} samples lit ({percent(float(lit.mean()), 1)} of the '
            f"time, between {time[0]:.3f} and {time[-1]:.3f} s) hold {percent(share, 1)} of the "
            f"squared error of {escape(public_name(name))}.</p>"
        )

    def _zoom(self, low: float, high: float) -> None:
        self._traces.range.update(start=low, end=high)


def _legend(horizon: str) -> Any:
    """What the lines are, in words, where they hide nothing."""
    return text(
        f'<p class="guide"><span style="color:{MEASURED}">&#9472;&#9472;</span> measured &ensp; '
        f'<span style="color:{BLUE}">&#9476;&#9476;</span> simulated, {escape(horizon)} &ensp; '
        f'<span style="color:{ORANGE}">&#9679;</span> selected</p>'
    )
