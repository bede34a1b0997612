"""Tab 7: what was found as figures and one self-contained HTML file."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.page.control_verbs import report_action, with_reported
from studies.page.look import RULE, button, column, guide, put, row, text
from studies.page.session import Role, Session, recordings
from studies.page.verbs import require_rig

if TYPE_CHECKING:
    from bokeh.models import Model

    from studies.page.view import Page


class ReportTab:
    """Where the report goes, and how it looks."""

    title = "Report"

    def __init__(self, page: Page) -> None:
        self._page = page

    def build(self) -> Model:
        """Its widgets."""
        from bokeh.models import TextInput

        self._folder = TextInput(title="Folder", value="report", width=360, name="report_folder")
        self._said, self._inside = text(), text()
        return column(
            guide("Write what this page has found so far into a folder: one HTML file that needs "
                  "nothing else, and every figure as PDF, SVG and CSV."),
            row(self._folder, button("Write report", self._write, main=True, name="report")),
            self._said,
            self._inside,
        )  # fmt: skip

    def of(self, session: Session) -> tuple[Any, ...]:
        """Parts of a session that it shows."""
        return (session.reported,)

    def show(self, session: Session) -> None:
        """The report that was written last."""
        found = session.reported
        put(self._said, f"<p role='status'>wrote {escape(str(found))}</p>" if found else "")
        put(self._inside, "")
        if found:
            content = escape(found.read_text(encoding="utf-8"), quote=True)
            put(self._inside, (
                f'<iframe title="the report" sandbox srcdoc="{content}" '
                f'style="width: min(1240px, 92vw); height: 900px; border: 1px solid {RULE}">'
                "</iframe>"
            ))  # fmt: skip

    def _write(self) -> None:
        from studies.page.reporting import Found, report_with_modes

        page, target = self._page, self._folder.value.strip() or "report"
        if not page.allows(require_rig):
            return
        session = page.session
        action = report_action(session, target)
        page.work(
            action,
            lambda found: lambda now: with_reported(now, found, action),
            report_with_modes, Path(target), action.command, session.now.rig,
            Found(
                comparison=session.compared.comparison if session.compared else None,
                diagnosis=session.diagnosed,
                steps=tuple(step.accepted for step in session.steps if step.accepted),
                check=session.looped.check if session.looped else None,
            ),
            recordings(session.of(Role.TRAINING)),
            session.linearised.choice if session.linearised else None,
        )  # fmt: skip
