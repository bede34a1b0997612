"""Tab 6: a controller and estimators against the full plant, held against a specification."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.page.control_verbs import design_action, with_looped
from studies.page.drawn import as_html
from studies.page.look import BUTTON, button, column, guide, put, row, sheet, text, wide
from studies.page.session import Session
from workbench.errors import InputError

if TYPE_CHECKING:
    from bokeh.models import Model

    from studies.page.view import Page

METHODS = ["lq", "cascade", "pid", "mpc", "nonlinear-mpc", "hybrid-mpc"]
OBSERVERS = ["ekf", "ukf", "imm", "mhe"]
SPEC = """\
rise_time   = "150 ms"
overshoot   = "2 %"
final_error = "0.2 mm"
"""


class DesignTab:
    """Method, estimators, scenario, specification with its verdict, and the closed loops."""

    title = "Design and check"

    def __init__(self, page: Page) -> None:
        self._page = page
        self._shown: Any = None

    def build(self) -> Model:
        """Its widgets."""
        from bokeh.models import CheckboxButtonGroup, Select, Spinner, TextAreaInput

        self._method = Select(title="Controller", options=METHODS, value="lq", width=160,
                              name="method")  # fmt: skip
        self._observers = CheckboxButtonGroup(
            labels=OBSERVERS, active=[0], stylesheets=[sheet(BUTTON)]
        )
        self._scenario = Select(title="Scenario", options=["step", "sine"], value="step",
                                width=120)  # fmt: skip
        self._runs = Spinner(title="Plants (1: the rig's own)", low=1, high=100, value=1, width=180)
        self._spec = TextAreaInput(
            title="Specification; the verdict follows as you type", value=SPEC, rows=8, width=520,
            name="specification",
        )  # fmt: skip
        self._spec.on_change("value", lambda _a, _o, _n: self._judge())
        self._verdict, self._loops, self._told = text(name="spec_verdict"), text(), text()
        check = button("Design and check", self._check, main=True, name="design_and_check")
        return column(
            guide("Design a controller on all modes of the rig, with an estimator in the loop, and "
                  "see on the full nonlinear plant whether it meets what is asked."),
            row(self._method, self._observers, self._scenario, self._runs, check),
            self._spec,
            self._verdict,
            self._loops,
            self._told,
        )  # fmt: skip

    def show(self, session: Session) -> None:
        """The closed loops of a session."""
        from studies.checking import scenarios_of

        if session.steps:
            self._scenario.options = known = [*scenarios_of(session.now.rig.plant)]
            if self._scenario.value not in known:
                self._scenario.value = known[0]
        found = session.looped
        if found is self._shown:
            return
        self._shown = found
        put(self._loops, "".join(map(as_html, found.drawn.values())) if found else "")
        told = f"{found.check.text}\n\n{found.told}" if found else ""
        put(self._told, wide(told) if told else "")
        self._judge()

    def _judge(self) -> None:
        """The specification as it is typed against the loops that were run last."""
        from studies.specification import read_specification
        from studies.verdicts import figures_of, judge

        session, content = self._page.session, self._spec.value
        if not session.steps or not content.strip():
            put(self._verdict, "")
            return
        rig, found = session.now.rig, session.looped
        try:
            asked = read_specification(content, rig, [self._scenario.value])
        except (InputError, ValueError) as error:
            put(self._verdict, f'<p class="wrong" role="alert">{escape(str(error))}</p>')
            return
        if found is None:
            said = "the specification can be read; run the loop for its verdict"
            put(self._verdict, f'<p class="guide">{said}</p>')
            return
        runs = 1 + max((_run_of(row.design) for row in found.check.rows), default=0)
        pairs = zip(found.check.rows, found.check.records, strict=True)
        loops = [figures_of(asked, *pair) for pair in pairs]
        each = len(loops) // runs
        by_run = [loops[k : k + each] for k in range(0, len(loops), each)]
        verdict = judge(asked, rig, by_run)
        word = "met" if verdict.met else f"missed: {', '.join(verdict.missed)}"
        kind = "busy" if verdict.met else "wrong"
        put(self._verdict, f'<p class="{kind}" role="status">specification {escape(word)}</p>'
            f"<pre>{escape(verdict.text)}</pre>")  # fmt: skip

    def _check(self) -> None:
        from studies.page.control_tasks import close_loops

        page = self._page
        if not page.attempt(lambda session: session.now and session):
            return
        session = page.session
        first, method = Path(session.steps[0].rig_file), self._method.value
        target = str(first.with_name(f"{first.stem}_{method}.toml"))
        observers = [OBSERVERS[k] for k in self._observers.active]
        chosen = (method, target, observers, [self._scenario.value], int(self._runs.value))
        spec = self._spec.value
        action = design_action(session, *chosen, spec)
        page.work(
            action,
            lambda found: lambda now: with_looped(now, found, action),
            close_loops, session.now.rig, *chosen, spec,
        )  # fmt: skip


def _run_of(design: str) -> int:
    """Which run a row is of, from 0: ``lq`` or ``lq 1`` is the rig's own."""
    number = design.rpartition(" ")[2]
    return int(number) - 1 if number.isdigit() else 0
