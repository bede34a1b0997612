"""Tab 1: choose a rig and recordings, see whether they are plausible, mark what they are for."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.figures.style import BLUE
from studies.page import tasks
from studies.page.look import (
    button,
    chart,
    column,
    findings_html,
    guide,
    put,
    row,
    text,
)
from studies.page.mapping import Mapping
from studies.page.replay import NO_ACTION
from studies.page.session import (
    File,
    Role,
    Session,
    recordings,
    with_opened,
    with_plant,
    with_rig,
    with_role,
    without_file,
)
from studies.page.traces import TIME, Traces
from studies.page.verbs import named, require_rig, require_train, with_checked
from studies.text import labelled
from workbench.plants import PLANTS
from workbench.reading.formats import BINARY
from workbench.units import display_scale

if TYPE_CHECKING:
    from bokeh.models import Model

    from studies.page.view import Page

ENDINGS = (".csv", ".txt", ".dat", *BINARY)
PLANT = "one of the catalogue"
NONE = "choose here, or type a path"
SMALL, TALL = 92, 120


class RecordingTab:
    """Files, their columns, their plausibility, and the gate before a fit."""

    title = "Recording"

    def __init__(self, page: Page) -> None:
        self._page = page
        self._looked_at = ""
        self._drawn: Any = None

    def build(self) -> Model:
        """Its widgets."""
        from bokeh.models import Select, TextInput

        page = self._page
        self._rig = TextInput(title="Rig file (TOML)", width=360, name="rig_file")
        self._plant = Select(
            title="Or begin with a plant", options=[PLANT, *PLANTS], value=PLANT, width=240
        )
        self._plant.on_change("value", self._begin)
        self._file = TextInput(title="Recording (CSV, MAT, MDF)", width=360, name="recording_file")
        self._here = Select(
            title="Recordings beside the rig", options=[NONE], value=NONE, width=280
        )
        self._here.on_change("value", self._picked)
        self._files, self._found, self._gate = column(), text(), text(name="gate")
        self._name = text()
        self._traces = Traces(page.document)
        self._charts = column()
        self._mapping = Mapping(page, lambda: self._file.value.strip())
        return column(
            guide("Open a rig and its recordings, look whether they are plausible, and mark which "
                  "one is fitted (training) and which one only judges (validation)."),
            row(self._rig, button("Open rig", self._open_rig, name="open_rig"),
                self._plant),
            row(self._file, button("Add recording", self._add, name="add_recording"), self._here),
            self._files,
            row(button("Check before a fit", self._check, name="check_gate")),
            self._gate,
            self._name,
            self._found,
            self._charts,
            self._mapping.build(),
        )  # fmt: skip

    def of(self, session: Session) -> tuple[Any, ...]:
        """Parts of a session that it shows."""
        return session.steps, session.files, session.checked

    def show(self, session: Session) -> None:
        """The files of a session, and one of them drawn."""
        if session.steps:
            self._rig.value = session.now.rig_file
            self._here.options = [NONE, *_beside(session)]
        self._files.children = [self._line(each) for each in session.files]
        known = {each.opened.path: each.opened for each in session.files}
        if self._looked_at not in known:
            self._looked_at = next(iter(known), "")
        opened = known.get(self._looked_at)
        if opened is not self._drawn:
            self._drawn = opened
            self._draw(opened)
        put(self._gate, findings_html(session.checked) if session.checked else "")
        self._mapping.show(session, opened)

    def _line(self, file: File) -> Model:
        """One recording: its role, and what can be done with it."""
        from bokeh.models import Select

        path = file.opened.path
        role = Select(
            title=f"{Path(path).name} is for", value=file.role.value, width=240,
            options=[each.value for each in Role], name=f"role_{Path(path).stem}",
        )  # fmt: skip
        role.on_change("value", lambda _a, _o, new: self._mark(path, Role(new)))
        return row(
            role,
            button(f"Look at {Path(path).stem}", lambda: self._look(path)),
            button("Put away", lambda: self._page.attempt(lambda s: without_file(s, path))),
        )

    def _mark(self, path: str, role: Role) -> None:
        if not self._page.attempt(lambda session: with_role(session, path, role)):
            self.show(self._page.session)

    def _look(self, path: str) -> None:
        self._looked_at = path
        self.show(self._page.session)

    def _begin(self, _attr: str, _old: str, new: str) -> None:
        if new != PLANT:
            self._plant.value = PLANT
            self._page.attempt(lambda session: with_plant(session, new))

    def _open_rig(self) -> None:
        path = self._rig.value.strip()
        self._page.attempt(lambda session: with_rig(session, named(path, "rig file", "rig.toml")))

    def _picked(self, _attr: str, _old: str, new: str) -> None:
        if new != NONE:
            self._file.value = new
            self._here.value = NONE
            self._add()

    def _add(self) -> None:
        path, page = self._file.value.strip(), self._page
        if not page.allows(require_rig):
            return
        if not page.allows(lambda _: named(path, "recording", "train.csv")):
            return
        page.work(
            NO_ACTION,
            lambda found: lambda session: with_opened(session, found),
            tasks.open_recordings, page.session.now.rig, (path,),
        )  # fmt: skip

    def _check(self) -> None:
        page = self._page

        if page.allows(require_train):
            page.work(
                NO_ACTION,
                lambda found: lambda session: with_checked(session, found),
                tasks.check_gate, page.session.now.rig,
                recordings(page.session.of(Role.TRAINING)),
            )  # fmt: skip

    def _draw(self, opened: Any) -> None:
        """Every channel of a recording over time, and what was found of it."""
        if opened is None:
            self._charts.children = []
            put(self._name, "")
            put(self._found, "")
            return
        recording = opened.recording
        rows = {
            name: display_scale(name).from_si(values) for name, values in recording.channels.items()
        }
        self._traces.put({TIME: recording.time_s, **rows}, [*rows])
        found = []
        for name in rows:
            last = name == [*rows][-1]
            each = chart(
                "time (s)" if last else "", "", TALL if last else SMALL, labelled(name),
                x_range=self._traces.range,
            )  # fmt: skip
            each.line(TIME, name, source=self._traces.source, color=BLUE, line_width=1.2)
            each.xaxis.major_label_text_font_size = "11px" if last else "0px"
            found.append(each)
        self._charts.children = found
        put(self._name, f"<h2>{escape(opened.path)}</h2>")
        put(self._found, "<h2>Plausible?</h2>" + findings_html(opened.findings))


def _beside(session: Session) -> list[str]:
    """Recordings that lie where the rig file does, and are not open yet."""
    folder = Path(session.now.rig_file).parent
    taken = {each.opened.path for each in session.files}
    found = sorted(str(p) for p in folder.glob("*") if p.suffix.lower() in ENDINGS)
    return [path for path in found if path not in taken]
