"""Tab 6: a controller and estimators against the full plant, held against a specification."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.page.by_mode import ByMode
from studies.page.control_verbs import design_action, with_looped
from studies.page.drawn import as_html
from studies.page.look import BUTTON, button, column, guide, put, row, sharing, sheet, text, wide
from studies.page.session import Session
from studies.page.verbs import counted, require_rig
from workbench.errors import InputError

if TYPE_CHECKING:
    from bokeh.models import Model

    from studies.page.view import Page

USUAL_METHOD, USUAL_OBSERVER = "lq", "ekf"


class DesignTab:
    """Method and estimators, also by mode, specification with its verdict, and closed loops."""

    title = "Design and check"

    def __init__(self, page: Page) -> None:
        self._page = page
        self._plant = ""

    def build(self) -> Model:
        """Its widgets."""
        from bokeh.models import CheckboxButtonGroup, Select, Spinner, TextAreaInput

        self._method = Select(title="Controller", options=[], width=190, name="method")
        self._method.on_change("value", lambda _a, old, new: self._chose(old, new))
        self._observers = CheckboxButtonGroup(labels=[], active=[0], stylesheets=[sheet(BUTTON)])
        self._scenario = Select(title="Scenario", options=[], width=150)
        self._scenario.on_change("value", lambda _a, _o, _n: self._judge())
        self._runs = Spinner(title="Plants (1: the rig's own)", low=1, high=100, value=1, width=180)
        self._by_mode = ByMode(self._page)
        self._spec = TextAreaInput(
            title="Specification; the verdict follows as you type", rows=8, width=520,
            name="specification", stylesheets=[sheet("textarea { padding-top: 6px; }")],
        )  # fmt: skip
        self._spec.on_change("value_input", lambda _a, _o, new: self._judge(new))
        self._verdict, self._loops = text(name="spec_verdict"), text()
        self._found, self._told = text(), text()
        check = button("Design and check", self._check, main=True, name="design_and_check")
        observers = column(text("<p>Estimators, one loop each</p>"), self._observers)
        observers.update(spacing=0, sizing_mode="fixed", width=330)
        return column(
            guide("Design a controller on all modes of the rig, with an estimator in the loop, and "
                  "see on the full nonlinear plant whether it meets what is asked."),
            row(self._method, observers, self._scenario, self._runs, check),
            self._by_mode.build(),
            row(self._spec, sharing(self._verdict, 1, 400), top=True),
            self._loops,
            self._found,
            self._told,
        )  # fmt: skip

    def of(self, session: Session) -> tuple[Any, ...]:
        """Parts of a session that it shows."""
        return session.steps, session.looped, session.offers

    def show(self, session: Session) -> None:
        """The closed loops of a session."""
        if session.steps:
            self._offer(session)
        self._by_mode.show(session.offers)
        found = session.looped
        put(self._loops, "".join(map(as_html, found.drawn.values())) if found else "")
        put(self._found, wide(found.check.text) if found else "")
        put(self._told, "".join(map(_piece, found.told)) if found else "")
        self._judge()

    def _offer(self, session: Session) -> None:
        """What is there for the plant, once it is another one."""
        from controllers.design_file import methods_of
        from studies.checking import scenarios_of
        from studies.page.offers import observers_of, usual_spec

        plant = session.now.rig.plant
        if plant.name == self._plant:
            return
        self._plant = plant.name
        known = methods_of(plant)
        scenarios = [*scenarios_of(plant)] if known else []
        observers = observers_of(plant) if known else []
        self._scenario.update(options=scenarios, value=scenarios[0] if scenarios else "")
        usual = observers.index(USUAL_OBSERVER) if USUAL_OBSERVER in observers else 0
        self._observers.update(labels=observers, active=[usual] if observers else [])
        self._spec.value = usual_spec(plant)
        value = USUAL_METHOD if USUAL_METHOD in known else next(iter(known), "")
        self._method.update(options=known, value=value)

    def _chose(self, old: str, new: str) -> None:
        """By mode only where that is the controller; not while something else runs."""
        if not self._by_mode.open(new, self._observers.labels):
            self._method.value = old

    def _judge(self, typed: str | None = None) -> None:
        """The specification as it is typed against the loops that were run last."""
        from studies.specification import read_specification
        from studies.verdicts import figures_of, judge

        session, content = self._page.session, self._spec.value if typed is None else typed
        if not session.steps or not content.strip() or not self._scenario.value:
            put(self._verdict, "")
            return
        rig, found = session.now.rig, session.looped
        try:
            asked = read_specification(_as_text(content), rig, [self._scenario.value])
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
            f"{wide(verdict.text)}")  # fmt: skip

    def _check(self) -> None:
        from studies.page.control_tasks import close_loops

        page = self._page
        if not page.allows(require_rig):
            return
        if not page.allows(lambda _: counted(self._runs.value, "plants")):
            return
        session, method = page.session, self._method.value
        if not method:
            page.complain(f"{session.now.rig.plant.name} has no standard modes to control")
            return
        first = Path(session.steps[0].rig_file)
        target = str(first.with_name(f"{first.stem}_{method}.toml"))
        observers = [self._observers.labels[k] for k in self._observers.active]
        spec, observers = self._by_mode.with_choices(_as_text(self._spec.value), observers)
        runs = counted(self._runs.value, "plants")
        chosen = (method, target, observers, [self._scenario.value], runs, spec)
        action = design_action(session, *chosen)
        page.work(
            action,
            lambda found: lambda now: with_looped(now, found, action),
            close_loops, session.now.rig, *chosen,
        )  # fmt: skip


def _as_text(typed: str) -> str:
    """A specification that no reader takes for the name of a file; empty as it is."""
    return f"{typed}\n" if typed.strip() and not typed.endswith("\n") else typed


def _piece(told: str) -> str:
    """A table as it is, a sentence in as many lines as it needs."""
    return wide(told) if "\n" in told else f'<p class="guide piece">{escape(told)}</p>'


def _run_of(design: str) -> int:
    """Which run a row is of, from 0: ``lq`` or ``lq 1`` is the rig's own."""
    number = design.rpartition(" ")[2]
    return int(number) - 1 if number.isdigit() else 0
