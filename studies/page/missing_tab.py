"""Tab 3: which effect is missing, what it looks like, where it shows, and what to record next."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.figures.style import BLUE, ORANGE
from studies.page import tasks
from studies.page.look import (
    NARROWEST,
    button,
    chart,
    column,
    guide,
    html_table,
    put,
    row,
    text,
)
from studies.page.missing_term import MissingTerm
from studies.page.session import Role, Session, recordings
from studies.page.verbs import diagnose_action, require_train, with_diagnosed, with_saved_commands
from studies.text import percent
from studies.text_of_next_recording import next_recording_text
from studies.text_of_ranking import reasons, sizes_text

if TYPE_CHECKING:
    from bokeh.models import Model

    from studies.page.view import Page
    from workbench.diagnosis.result import Ranked

SHOWN = 10
BAR, LETTER = 30, 7  # pixels of a row, and of a letter of its name


class MissingTab:
    """The ranking as bars and as a table, the missing term, the next recording."""

    title = "Missing effect"

    def __init__(self, page: Page) -> None:
        self._page = page

    def build(self) -> Model:
        """Its widgets."""
        from bokeh.models import TextInput

        diagnose = button("Diagnose", self._diagnose, main=True, name="diagnose")
        self._said, self._table, self._next = text(name="verdict"), text(), text()
        self._bars = column()
        self._term = MissingTerm()
        self._name = TextInput(title="Command file", value="next_recording.csv", width=300)
        self._save = row(
            self._name, button("Save command file", self._save_commands, name="save_commands")
        )
        self._save.visible = False
        return column(
            guide("Ask which physical effect of the catalogue would explain what the plant misses; "
                  "a bar is the share of the weighted misfit that goes away, orange on recordings "
                  "that were not fitted."),
            row(diagnose),
            self._said,
            self._bars,
            self._table,
            self._term.build(),
            self._next,
            self._save,
        )  # fmt: skip

    def of(self, session: Session) -> tuple[Any, ...]:
        """Parts of a session that it shows."""
        return (session.diagnosed,)

    def show(self, session: Session) -> None:
        """The diagnosis of a session."""
        found = session.diagnosed
        self._term.show(found.terms if found else {})
        asked = found.next_recording if found else None
        self._save.visible = bool(asked and asked.predicted)
        if found is None:
            self._bars.children = []
            for each in (self._said, self._table, self._next):
                put(each, "")
            return
        warned = "".join(f'<p class="warned">{escape(each)}</p>' for each in found.warnings)
        verdict = found.verdict.value.replace("_", " ")
        put(self._said, f"<h2>{verdict}</h2><p>{escape(found.sentence)}</p>{warned}")
        shown = found.ranking[:SHOWN]
        self._bars.children = [_bars(shown)] if shown else []
        put(self._table, _table(shown))
        lines = next_recording_text(asked).splitlines() if asked else []
        told = "".join(f"<p>{escape(each)}</p>" for each in lines)
        put(self._next, told and f"<h2>What to record next</h2>{told}")

    def _diagnose(self) -> None:
        page = self._page

        if page.allows(require_train):
            session = page.session
            page.work(
                diagnose_action(session),
                lambda found: lambda now: with_diagnosed(now, found),
                tasks.diagnose, session.now.rig,
                recordings(session.of(Role.TRAINING)), recordings(session.of(Role.VALIDATION)),
            )  # fmt: skip

    def _save_commands(self) -> None:
        target = Path(self._name.value.strip() or "next_recording.csv")
        self._page.attempt(lambda session: with_saved_commands(session, target))


def _bars(rows: tuple[Ranked, ...]) -> Any:
    """Expected fall on both sets, best first; ties marked, and what cannot be told."""
    from bokeh.models import ColumnDataSource, FactorRange

    leader = rows[0]
    tied = {leader.candidate.name, *leader.tied_with} if leader.tied_with else set()
    names = [label_of(each, tied) for each in rows]
    found = chart(
        "fall of the weighted misfit (%)", "", 90 + BAR * len(rows), "expected fall",
        max_width=900,
        y_range=FactorRange(*reversed(names)), x_range=(0, 105), tools="",
    )  # fmt: skip
    places = np.arange(len(rows))[::-1] + 0.5
    for offset, drops, colour, word, hatch in (
        (0.19, [each.drop_train for each in rows], BLUE, "training", " "),
        (-0.19, [each.drop_validation for each in rows], ORANGE, "validation", "/"),
    ):
        source = ColumnDataSource(
            data={"y": places + offset, "x": [100.0 * max(np.nan_to_num(d), 0.0) for d in drops]}
        )
        found.hbar(
            "y", 0.36, "x", source=source, color=colour, legend_label=word, hatch_pattern=hatch,
            hatch_color="white",
        )  # fmt: skip
    found.min_border_left = 24 + LETTER * max(map(len, names))
    found.min_width = found.min_border_left + NARROWEST  # a name cut once leaves a stripe
    found.legend.location, found.legend.label_text_font_size = "bottom_right", "11px"
    found.yaxis.major_label_text_font_size = "12px"
    found.ygrid.grid_line_color = None
    return found


def label_of(row: Ranked, tied: set[str]) -> str:
    """The name of a candidate with a sign: = tied with the first, ? not to be seen here."""
    name = row.candidate.name
    if name in tied:
        return f"= {name}"
    return f"? {name}" if row.blind else name


def _table(rows: tuple[Ranked, ...]) -> str:
    """Size with its deviation, what the signature looks like, and what speaks against it."""
    lines = []
    for each in rows:
        told = "passes every criterion" if each.accepted else "; ".join(reasons(each))
        if each.blind:
            told = f"cannot tell here{'; ' + told if told else ''}"
        if each.tied_with:
            told += f"; tied with {', '.join(each.tied_with)}"
        lines.append(
            (each.candidate.name, percent(each.drop_validation), sizes_text(each),
             signature(each), told)
        )  # fmt: skip
    head = ("effect", "validation", "size ± one deviation", "what it looks like", "")
    note = '<p class="guide">= cannot be told from the first; ? not to be seen here</p>'
    return html_table(head, lines, numbers=9, names=(0, 1, 2)) + note


def signature(row: Ranked) -> str:
    """One sentence on how an effect shows."""
    cause = row.candidate.cause
    drivers = " and ".join(cause.drivers) or "nothing in particular"
    enters = f"Enters the {cause.balance.value} balance and follows {drivers}"
    return f"{enters}; best seen by: {cause.shown_by}."
