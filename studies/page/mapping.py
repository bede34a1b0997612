"""Which column is which signal, in which unit: written as a rig file, and read from then on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.page import tasks
from studies.page.look import button, column, row, text
from studies.page.plausibility import column_names
from studies.page.replay import NO_ACTION, Action
from studies.page.session import TIME, Session, mapped, paths, with_opened, with_rig
from studies.page.verbs import named, require_rig
from workbench.errors import InputError
from workbench.recording_format import channel_names
from workbench.rig import load_rig
from workbench.units import display_unit
from workbench.whole_file import whole_file

if TYPE_CHECKING:
    from bokeh.models import Model

    from studies.page.view import Page

ABSENT = "(not recorded)"
OWN = "_columns"  # behind the name of a rig file that this page writes


class Mapping:
    """A line for each signal: the column of the file, and its unit there.

    The file is the one that is looked at, or else the one whose path is typed.
    """

    def __init__(self, page: Page, typed: Callable[[], str]) -> None:
        self._page, self._typed = page, typed
        self._widgets: dict[str, tuple[Any, Any]] = {}
        self._shown: Any = None

    def build(self) -> Model:
        """Its widgets, hidden until they are asked for."""
        from bokeh.models import TextInput

        self._lines = column()
        self._name = TextInput(title="Write as rig file", width=360, name="mapped_file")
        self._inner = column(
            text("<p>Each signal of the plant, the column that holds it, and the unit there.</p>"),
            self._lines,
            row(self._name, button("Write and read with it", self._apply, name="apply_mapping")),
        )
        self._inner.visible = False
        return column(
            row(button("Columns and units", self._fold, name="columns_and_units")), self._inner
        )

    def _fold(self) -> None:
        if not self._inner.visible and not self._page.allows(require_rig):
            return
        self._inner.visible = not self._inner.visible
        self._fill()

    def show(self, session: Session, opened: tasks.Opened | None) -> None:
        """The mapping of the rig of a session."""
        path = opened.path if opened else ""
        if session.steps and self._shown != (session.now, path):
            self._shown = (session.now, path)
            stem = Path(session.steps[0].rig_file)
            name = f"{stem.stem.removesuffix(OWN)}{OWN}.toml"
            self._name.value = str(stem.with_name(name))
            self._fill()

    def _fill(self) -> None:
        """One line for each signal, once it is looked at."""
        from bokeh.models import Select, TextInput

        if not self._inner.visible or self._shown is None:
            return
        step, path = self._shown
        path = path or self._typed()
        known = [str(c.column) for c in step.rig.reader.channels.values()]
        try:
            columns = [*column_names(step.rig, Path(path))] if path else known
        except InputError:
            columns = known
        self._widgets, lines = {}, []
        reader = step.rig.reader
        now = {full: (str(c.column), c.unit) for full, c in reader.channels.items()}
        signals = {**channel_names(step.rig.plant)}
        if reader.time.step_s is None:
            now[TIME] = (str(reader.time.column or TIME), reader.time.unit)
            signals = {TIME: TIME, **signals}
        for public, full in signals.items():
            chosen, typed = now.get(full, (ABSENT, display_unit(full)))
            select = Select(
                title=public, value=chosen, width=220,
                options=list(dict.fromkeys([ABSENT, chosen, *columns])),
            )  # fmt: skip
            unit = TextInput(title="unit", value=typed, width=110)
            self._widgets[full] = (select, unit)
            lines.append(row(select, unit))
        self._lines.children = lines

    def _apply(self) -> None:
        """The rig with these columns, once the open recordings can be read by it."""
        page, target = self._page, self._name.value.strip()
        chosen = {
            full: (select.value, unit.value.strip())
            for full, (select, unit) in self._widgets.items()
            if select.value != ABSENT
        }

        contents: list[str] = []
        if not page.allows(lambda session: contents.append(mapped(session.now.rig, chosen))):
            return
        (content,) = contents

        def change(session: Session) -> Session:
            path = Path(named(target, "rig file", "columns.toml"))
            with whole_file(path) as unfinished:
                unfinished.write_text(content, encoding="utf-8")
            lines = f"from pathlib import Path\nPath({target!r}).write_text({content!r})\n"
            found = with_rig(session, target)
            last = found.actions[-1]
            return replace(found, actions=(*found.actions[:-1], Action("", lines + last.python)))

        before = page.session.files
        if not before:
            page.attempt(change)
            return

        def reread(read: tuple[tasks.Opened, ...]) -> Any:
            def with_all(session: Session) -> Session:
                session = change(session)
                for each, file in zip(read, before, strict=True):
                    session = with_opened(session, [each], file.role)
                return session

            return with_all

        every = tuple(paths([each.opened for each in before]))
        page.work(NO_ACTION, reread, tasks.open_recordings, load_rig(content), every)
