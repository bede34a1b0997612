"""How the page looks: colours of the figures, one chart style, text, tables and buttons."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from studies.figures.style import BLUE, ORANGE, RED
from studies.page.plausibility import Finding, Mark

if TYPE_CHECKING:
    from bokeh.models import Button, Column, Div, Model
    from bokeh.plotting import figure

INK, SOFT, RULE, MEASURED = "#1f2933", "#52606d", "#d9dee4", "#7b8794"
MARKS = {
    Mark.GOOD: ("#00694d", "✓ good"),
    Mark.LOOK: ("#8a5a00", "▲ look"),
    Mark.STOP: ("#a34700", "■ stop"),
}  # colours dark enough to be read as text
FONT = "system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif"
GAP = 12
NARROWEST = 240  # of a chart: one that begins narrower leaves a stripe
SMALL = 130  # of a chart: then few ticks

STYLE = f"""
body {{ margin: 0; background: #ffffff; color: {INK}; font: 14px {FONT}; }}
:focus-visible {{ outline: 3px solid {ORANGE}; outline-offset: 1px; }}
#loading {{ font-size: 18px; margin: 12px 20px; }}
[data-root-id]:not(:empty) ~ #loading {{ display: none; }}
"""
TEXT = f"""
:host {{ font: 14px/1.45 {FONT}; color: {INK}; }}
h1 {{ font-size: 18px; margin: 0; }}
h2 {{ font-size: 15px; margin: 8px 0 2px; }}
p {{ margin: 0; }}
.guide {{ color: {SOFT}; max-width: 90ch; }}
.piece {{ margin: 8px 0; }}
.wrong {{ border-left: 4px solid {RED}; background: #fdf1ea; padding: 6px 10px;
          white-space: pre-wrap; overflow-wrap: anywhere; }}
.warned {{ border-left: 4px solid {ORANGE}; background: #fdf6e3; padding: 6px 10px;
           white-space: pre-wrap; overflow-wrap: anywhere; }}
.busy {{ border-left: 4px solid {BLUE}; background: #eaf3f9; padding: 6px 10px; }}
.calm {{ color: {SOFT}; padding: 6px 10px; border-left: 4px solid {RULE}; }}
pre {{ font: 12px/1.4 ui-monospace, 'DejaVu Sans Mono', monospace; margin: 0;
       white-space: pre-wrap; overflow-wrap: anywhere; }}
table {{ border-collapse: collapse; font-variant-numeric: tabular-nums; }}
th {{ text-align: left; font-weight: 600; border-bottom: 1px solid {INK};
     padding: 2px 14px 2px 0; }}
td {{ border-bottom: 1px solid {RULE}; padding: 2px 14px 2px 0; vertical-align: top; }}
td.n, th.n {{ text-align: right; white-space: nowrap; }}
td.k, th.k {{ white-space: nowrap; }}
td.t {{ min-width: 180px; }}
.bk-clearfix {{ max-width: 100%; }}
.wide {{ overflow-x: auto; max-width: 100%; }}
.wide:focus-visible {{ outline: 3px solid {ORANGE}; }}
"""
BUTTON = f"""
.bk-btn {{ font: 14px {FONT}; border-radius: 4px; min-height: 32px; }}
.bk-btn:focus-visible {{ outline: 3px solid {ORANGE}; outline-offset: 1px; }}
.bk-btn-primary {{ background: {BLUE}; border-color: {BLUE}; color: #ffffff; }}
.bk-btn-primary:hover {{ background: #005a8e; }}
"""
CHOICE = f"""
:host {{ font: 14px {FONT}; }}
.bk-btn-group {{ display: flex; flex-wrap: wrap; }}
.bk-btn-group .bk-btn {{ flex: 0 0 auto; }}
.bk-btn {{ font: 14px {FONT}; border: none; border-radius: 0; background: none; color: {SOFT};
           border-bottom: 3px solid transparent; padding: 6px 12px; }}
.bk-btn.bk-active {{ color: {INK}; font-weight: 600; border: none;
                     border-bottom: 3px solid {BLUE}; background: none; box-shadow: none; }}
.bk-btn:focus-visible {{ outline: 3px solid {ORANGE}; outline-offset: -2px; }}
"""


def sheet(css: str) -> Any:
    """A style sheet of one widget."""
    from bokeh.models import InlineStyleSheet

    return InlineStyleSheet(css=css)


def text(html: str = "", **more: Any) -> Div:
    """A piece of text as HTML."""
    from bokeh.models import Div

    shown = {"visible": bool(html), "sizing_mode": "stretch_width", **more}
    return Div(text=html, stylesheets=[sheet(TEXT)], **shown)


def put(place: Div, html: str) -> None:
    """Fill a piece of text; an empty one takes no room."""
    place.update(text=html, visible=bool(html))


def wide(table: str) -> str:
    """A table of a terminal, which is scrolled where it is wider than the page."""
    return f'<pre class="wide" style="white-space: pre" tabindex="0">{escape(table)}</pre>'


def guide(sentence: str) -> Div:
    """The one sentence that tells what a tab is for."""
    return text(f'<p class="guide">{escape(sentence)}</p>')


def button(label: str, act: Callable[[], None], main: bool = False, **more: Any) -> Button:
    """A button; the main one of a tab is filled."""
    from bokeh.models import Button

    kind = "primary" if main else "default"
    found = Button(label=label, button_type=kind, stylesheets=[sheet(BUTTON)], **more)
    found.on_click(act)
    return found


def row(*children: Model, top: bool = False) -> Model:
    """Widgets beside each other, in as many lines as they need; flush below, or at the top."""
    from bokeh.models import Row

    styles = {"flex-wrap": "wrap", "align-items": "flex-start" if top else "flex-end"}
    return Row(children=[*children], spacing=GAP, sizing_mode="stretch_width", styles=styles)


def sharing(model: Model, grow: int, width: int) -> Model:
    """A part of a row that takes its share of the width, and no less than fits it."""
    model.styles = {"flex": f"{grow} 1 {width}px", "min-width": f"{NARROWEST}px"}
    return model


def column(*children: Model) -> Column:
    """Widgets below each other over the whole width."""
    from bokeh.models import Column

    return Column(children=[*children], spacing=GAP, sizing_mode="stretch_width")


def chart(x: str, y: str, height: int = 200, title: str = "", **more: Any) -> figure:
    """An empty chart in the common style, canvas drawn."""
    from bokeh.models import FactorRange
    from bokeh.plotting import figure

    tools = more.pop("tools", "xpan,xwheel_zoom,reset")
    found = figure(
        height=height, min_width=NARROWEST, title=title or None, tools=tools,
        output_backend="canvas",
        **{"sizing_mode": "stretch_width", **more},
    )  # fmt: skip
    found.toolbar.logo = None
    found.toolbar.autohide = True
    for axis, label in ((found.xaxis, x), (found.yaxis, y)):
        axis.axis_label = label or None
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_font_size = "12px"
        axis.axis_label_text_color = INK
        axis.major_label_text_font_size = "11px"
        axis.axis_line_color = SOFT
        axis.minor_tick_line_color = None
    if height < SMALL and not isinstance(more.get("y_range"), FactorRange):
        found.yaxis.ticker.desired_num_ticks = 3
    found.grid.grid_line_color = "#e8ebef"
    found.outline_line_color = None
    found.min_border_left, found.min_border_right = 64, 8
    if title:
        found.title.text_font_size = "12px"
        found.title.text_color = INK
    return found


def html_table(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    numbers: int = 1,
    names: Sequence[int] = (0,),
) -> str:
    """A table, scrolled where it is wider than the page.

    Columns from ``numbers`` on are flush right; those of ``names`` do not break into lines.
    """

    def cell(kind: str, k: int, word: str) -> str:
        of = "n" if k >= numbers else "k" if k in names else "t"
        return f'<{kind} class="{of}">{escape(str(word))}</{kind}>'

    lines = ["".join(cell("th", k, word) for k, word in enumerate(head))]
    lines += ["".join(cell("td", k, word) for k, word in enumerate(each)) for each in rows]
    inside = "".join(f"<tr>{line}</tr>" for line in lines)
    return f'<div class="wide" tabindex="0"><table>{inside}</table></div>'


def findings_html(found: Sequence[Finding]) -> str:
    """What was looked at, with a word, a sign and a colour for how to take it."""
    lines = []
    for each in found:
        colour, word = MARKS[each.mark]
        lines.append(
            f'<tr><td class="k" style="color:{colour}">{word}</td>'
            f'<td class="k">{escape(each.what)}</td><td>{escape(each.seen)}</td></tr>'
        )
    return f'<div class="wide" tabindex="0"><table>{"".join(lines)}</table></div>'
