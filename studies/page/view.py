"""One browser tab: its session, the job that runs for it, and what all tabs of the page share."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from pathlib import Path
from time import strftime
from typing import TYPE_CHECKING, Any, Protocol

from studies.page.jobs import Job, Told
from studies.page.look import CHOICE, button, column, put, row, sheet, text
from studies.page.replay import Action, write_script
from studies.page.session import Session
from workbench.errors import InputError

if TYPE_CHECKING:
    from bokeh.document import Document
    from bokeh.models import Model

POLL_MS = 200
SHOWN = 240  # letters of a line of Python
BUSY = "something is running: wait for it, or cancel it"
BUSY_S = 4.0  # as long as that is said beside the progress
COPY = """
const told = (word) => { pressed.label = word; setTimeout(() => { pressed.label = label }, 1500) }
if (!said.text) { told("Nothing to copy") } else {
    navigator.clipboard.writeText(said.text).then(() => told("Copied"), () => told("Refused"))
}
"""

Change = Callable[[Session], Session]


class Tab(Protocol):
    """One tab: built when it is first looked at, shown again when the session is another one."""

    title: str

    def build(self) -> Model:
        """Its widgets."""

    def of(self, session: Session) -> tuple[Any, ...]:
        """The parts of a session that it shows: where they are the same, so is what it shows."""

    def show(self, session: Session) -> None:
        """What it shows of a session."""


class Page:
    """One browser tab with a session of its own; nothing of it is shared with another one."""

    def __init__(self, document: Document, tabs: Callable[[Page], list[Tab]]) -> None:
        self.document, self.session = document, Session()
        self._tabs = tabs(self)
        self._shown: dict[int, tuple[Any, ...]] = {}
        self._job: Job | None = None
        self._then: Callable[[Any], Change] = lambda _: lambda session: session
        self._otherwise: Callable[[], None] = lambda: None
        self._polling: Any = None
        self._task: Callable[..., Any] | None = None
        self._busy_until_s = 0.0
        self._replay = Path(f"workbench_replay_{strftime('%Y%m%d_%H%M%S')}_{id(self) % 9973}.py")
        self._build()
        document.on_session_destroyed(self._closed)

    def _build(self) -> None:
        from bokeh.models import CustomJS, PreText, RadioButtonGroup

        self._head, self._status = text(), text(visible=True)
        self._cancel = button("Cancel", self.cancel, visible=False, name="cancel")
        labels = [f"{k} {tab.title}" for k, tab in enumerate(self._tabs, start=1)]
        self._choice = RadioButtonGroup(
            labels=labels,
            active=0,
            stylesheets=[sheet(CHOICE)],
            name="tabs",
            sizing_mode="stretch_width",
        )
        self._choice.on_change("active", lambda _a, _o, _n: self.refresh())
        self._panels = [column() for _ in self._tabs]
        self._command, self._python = (PreText(text="", visible=False) for _ in range(2))
        self._done = text()
        copies = [
            button(label, lambda: None, name=name, width=170)
            for label, name in (("Copy as command", "copy_command"), ("Copy as Python", "copy_py"))
        ]
        for each, said in zip(copies, (self._command, self._python), strict=True):
            known = {"said": said, "pressed": each, "label": each.label}
            each.js_on_click(CustomJS(args=known, code=COPY))
        whole = column(
            self._head,
            self._choice,
            row(self._status, self._cancel),
            *self._panels,
            row(*copies),
            self._done,
            self._command,
            self._python,
        )
        whole.styles = {"padding": "12px 20px", "max-width": "1600px", "box-sizing": "border-box"}
        self.document.add_root(whole)
        self.document.title = "workbench"
        self.refresh()
        self.calm()

    def become(self, session: Session) -> None:
        """Another session; its replay script is written once something was done."""
        done = session.actions != self.session.actions
        self.session = session
        if done and any(each.command for each in session.actions):
            try:
                write_script(session.actions, self._replay)
            except OSError as error:
                self.complain(f"the replay script cannot be written: {error}")
        if session.actions:
            self.tell(session.actions[-1])
        self.refresh()

    def attempt(self, change: Change) -> bool:
        """Another session, or what stands against it in words."""
        if self._occupied():
            return False
        try:
            self.become(change(self.session))
        except (InputError, ValueError, OSError, ArithmeticError) as error:
            self.complain(str(error))
            return False
        self.calm()
        return True

    def allows(self, needs: Callable[[Session], object]) -> bool:
        """True where nothing runs and the session has what an action needs; else says why not."""

        def same(session: Session) -> Session:
            needs(session)
            return session

        return self.attempt(same)

    def work(
        self,
        action: Action,
        then: Callable[[Any], Change],
        task: Callable[..., Any],
        *arguments: Any,
        otherwise: Callable[[], None] = lambda: None,
    ) -> None:
        """Start a job for an action.

        ``then`` makes a change of the session from its result; ``otherwise`` is called where it
        has none, as after a cancel.
        """
        if self._occupied():
            return
        if action.command:
            self.tell(action)
        self.follow(Job(task, *arguments), then, otherwise)
        self._task = task

    def follow(
        self, job: Job, then: Callable[[Any], Change], otherwise: Callable[[], None] = lambda: None
    ) -> None:
        """Show a job while it runs."""
        self._job, self._then, self._otherwise = job, then, otherwise
        self._task, self._busy_until_s = None, 0.0
        self._cancel.visible = True
        self._polling = self.document.add_periodic_callback(self._poll, POLL_MS)
        self._poll()

    def _poll(self) -> None:
        job = self._job
        if job is None:
            return
        told = job.look()
        if not told.ended:
            self._show_progress(told, job.elapsed_s)
            return
        then, self._job = self._then, None
        self._stop_polling()
        if told.refused:
            self._otherwise()
            self.complain(told.refused)
        elif self.attempt(then(told.result)) and told.warned:
            said = "\n".join(dict.fromkeys(told.warned))
            self._status.text = f'<p class="warned" role="status">{escape(said)}</p>'

    def _show_progress(self, told: Told, elapsed_s: float) -> None:
        """What a job said last; for a while after a click in vain, that it runs."""
        last = told.progress[-1] if told.progress else "starting"
        said = f'<p class="busy" role="status">{escape(last)} &middot; {elapsed_s:.0f} s</p>'
        if elapsed_s < self._busy_until_s:
            said += f'<p class="wrong" role="alert">{BUSY}</p>'
        self._status.text = said

    def _stop_polling(self) -> None:
        self._cancel.visible = False
        if self._polling is not None:
            self.document.remove_periodic_callback(self._polling)
            self._polling = None

    def cancel(self) -> None:
        """End the running job; what was there stays."""
        if self._job is not None:
            self._job.cancel()
            self._poll()

    def supersede(self, task: Callable[..., Any]) -> None:
        """End the running job where it does this very task: another answer of it is wanted."""
        if self._job is not None and self._task is task:
            self._otherwise = lambda: None
            self.cancel()

    def _occupied(self) -> bool:
        """True where something runs; that is said, and stays for a while beside its progress."""
        job = self._job
        if job is None:
            return False
        self._busy_until_s = job.elapsed_s + BUSY_S
        self._show_progress(job.look(), job.elapsed_s)
        return True

    def _closed(self, _: Any) -> None:
        """The browser is gone: its job has nobody to work for."""
        if self._job is not None:
            self._job.cancel()
            self._job = None

    def complain(self, message: str) -> None:
        """Say what is wrong."""
        self._status.text = f'<p class="wrong" role="alert">{escape(message)}</p>'

    def calm(self) -> None:
        """Say that nothing runs."""
        self._status.text = '<p class="calm" role="status">ready</p>'

    def tell(self, action: Action) -> None:
        """The action as a command line and as Python, to be copied."""
        self._command.text, self._python.text = action.command, action.python
        said = f"<pre>$ {escape(action.command)}</pre>" if action.command else ""
        python = "".join(
            f"<pre>&gt;&gt;&gt; {escape(_short(x))}</pre>" for x in action.python.split("\n")
        )
        kept = f'<p class="guide">all actions as a script: {self._replay}</p>'
        put(self._done, said + python + (kept if self._replay.exists() else ""))

    def refresh(self) -> None:
        """Show the chosen tab, where it shows other parts of a session than there are now."""
        rig = f": {escape(self.session.now.rig.name)}" if self.session.steps else ""
        put(self._head, f"<h1>workbench{rig}</h1>")
        active = self._choice.active or 0
        for k, panel in enumerate(self._panels):
            panel.visible = k == active
        if not self._panels[active].children:
            self._panels[active].children = [self._tabs[active].build()]
        tab = self._tabs[active]
        before, now = self._shown.get(active), tab.of(self.session)
        if before is None or any(one is not other for one, other in zip(before, now, strict=True)):
            self._shown[active] = now
            tab.show(self.session)


def _short(line: str) -> str:
    """A line as far as it tells something; what is copied is whole."""
    return line if len(line) <= SHOWN else f"{line[:SHOWN]} ..."
