"""Tab 4: add an effect and fit, watch the error fall on both sets, go back, save the rig."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.figures.style import BLUE, ORANGE
from studies.page import tasks
from studies.page.look import (
    button,
    chart,
    column,
    guide,
    html_table,
    put,
    row,
    sharing,
    sheet,
    text,
)
from studies.page.session import Role, Session, Step, recordings
from studies.page.verbs import (
    add_action,
    back_to,
    fit_action,
    require_rig,
    require_train,
    save,
    with_accepted,
)
from studies.text import number, shown, spread
from studies.text_of_results import unit_names
from workbench.units import public_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bokeh.models import Model

    from studies.page.view import Page
    from workbench.fitting.errors import Errors

SETS = (("train", "training", BLUE, " "), ("validation", "validation", ORANGE, "/"))
LINES = ":host { font-size: 14px; line-height: 1.7; }"
OTHER = "another effect of the catalogue"


class AddTab:
    """Effects to tick, the waterfall of the error, parameters, and the rig file."""

    title = "Add and fit"

    def __init__(self, page: Page) -> None:
        self._page = page
        self._ticks: Any = None
        self._names: list[str] = []
        self._suggested = ""

    def build(self) -> Model:
        """Its widgets."""
        from bokeh.models import Select, TextInput

        self._boxes = column()
        self._other = Select(title="Or any other", options=[OTHER], value=OTHER, width=320)
        self._other.on_change("value", self._chose_other)
        self._fall, self._errors, self._moved = column(), text(name="errors"), text()
        sharing(self._fall, 1, 420)
        sharing(self._errors, 1, 520)
        self._name = TextInput(title="Rig file to save", width=360, name="save_as")
        return column(
            guide("Tick an effect to add and fit it; untick it to go back to the rig before it; "
                  "save the rig when the error falls on the validation recording too."),
            self._boxes,
            row(self._other, button("Fit the parameters alone", self._fit, name="fit")),
            row(self._fall, self._errors, top=True),
            self._moved,
            row(self._name, button("Save rig", self._save, main=True, name="save_rig")),
        )  # fmt: skip

    def of(self, session: Session) -> tuple[Any, ...]:
        """Parts of a session that it shows."""
        return session.steps, session.offered

    def show(self, session: Session) -> None:
        """The steps of a session, and what may be added."""
        from bokeh.models import CheckboxGroup

        if not session.steps:
            self._boxes.children = []
            return
        taken = [step.accepted.name for step in session.steps[1:]]
        offered = [name for name in session.offered if name not in taken]
        self._names = [*taken, *offered]
        self._ticks = CheckboxGroup(
            labels=[f"{k}. {name}" for k, name in enumerate(taken, start=1)] + offered,
            active=[*range(len(taken))], name="effects",
            stylesheets=[sheet(LINES)],
        )  # fmt: skip
        self._ticks.on_change("active", self._ticked)
        self._boxes.children = [self._ticks]
        plant = session.now.rig.plant
        self._other.options = [OTHER, *(n for n in plant.candidates if n not in self._names)]
        first = Path(session.steps[0].rig_file)
        suggested = str(first.with_name(f"{first.stem}_better.toml"))
        if self._name.value in ("", self._suggested):
            self._name.value = suggested
        self._suggested = suggested
        bars = waterfall(session.steps)
        self._fall.children = [_waterfall(bars)] if bars else []
        last = session.now.accepted
        told = (
            _errors_html(last.name, last.before, last.after, unit_names(plant.measured))
            if last
            else ""
        )
        put(self._errors, told)
        put(self._moved, _moved_html(session.now) if last else "")

    def _ticked(self, _attr: str, old: list[int], new: list[int]) -> None:
        page = self._page
        steps = len(page.session.steps) - 1
        gone, come = sorted({*old} - {*new}), sorted({*new} - {*old})
        if gone and gone[0] < steps:
            if not page.attempt(lambda session: back_to(session, gone[0])):
                self._untick()
        elif come and come[0] >= steps:
            self._add(self._names[come[0]])

    def _chose_other(self, _attr: str, _old: str, new: str) -> None:
        if new != OTHER:
            self._other.value = OTHER
            self._add(new)

    def _add(self, name: str) -> None:
        self._start(add_action(self._page.session, name), tasks.add, name)

    def _fit(self) -> None:
        page = self._page
        if page.allows(require_rig):
            self._start(fit_action(page.session), tasks.fit)

    def _start(self, action: Any, task: Any, *more: str) -> None:
        """A job that gives the rig another step."""
        page = self._page

        if not page.allows(require_train):
            self._untick()
            return
        session = page.session
        page.work(
            action,
            lambda found: lambda now: with_accepted(now, found, action),
            task, session.now.rig, *more,
            recordings(session.of(Role.TRAINING)), recordings(session.of(Role.VALIDATION)),
            otherwise=self._untick,
        )  # fmt: skip

    def _untick(self) -> None:
        """What was not accepted."""
        self._ticks.active = [*range(len(self._page.session.steps) - 1)]

    def _save(self) -> None:
        target = self._name.value
        self._page.attempt(lambda session: save(session, target))


def waterfall(steps: Sequence[Step]) -> list[tuple[str, dict[str, float]]]:
    """Squared error in noise deviations per sample on each set, step by step."""
    accepted = [step.accepted for step in steps if step.accepted]
    if not accepted:
        return []
    begun = "as it came" if accepted[0].name == "fit" else "parameters refitted"
    bars = [(begun, _per_sample(accepted[0].before))]
    return bars + [
        (f"{k}. {each.name}", _per_sample(each.after)) for k, each in enumerate(accepted, start=1)
    ]


def _per_sample(errors: Errors) -> dict[str, float]:
    """chi2/n of each set: the mean over its outputs, which have the same samples."""
    return {
        label: float(np.mean([error.chi2_per_sample for error in row.values()]))
        for label, row in errors.items()
        if row
    }


def _waterfall(bars: list[tuple[str, dict[str, float]]]) -> Any:
    from bokeh.models import FactorRange

    names = [name for name, _ in bars]
    found = chart(
        "", "squared error per sample (noise²)", 260, "error after each step",
        x_range=FactorRange(*names), y_range=(0.0, 1.0), tools="",
    )  # fmt: skip
    for offset, (label, word, colour, hatch) in zip((-0.2, 0.2), SETS, strict=True):
        values = [found_errors.get(label, 0.0) for _, found_errors in bars]
        places = np.arange(len(bars)) + 0.5 + offset
        found.vbar(
            places, 0.38, values, color=colour, legend_label=word, hatch_pattern=hatch,
            hatch_color="white",
        )  # fmt: skip
        found.text(
            places, values, [number(each, 3) for each in values], text_align="center",
            text_font_size="11px", y_offset=-3,
        )  # fmt: skip
    most = max(max(errors.values(), default=0.0) for _, errors in bars)
    found.y_range.update(start=0.0, end=1.15 * most)
    found.legend.label_text_font_size = "11px"
    return found


def _errors_html(name: str, before: Errors, after: Errors, units: Mapping[str, str]) -> str:
    """RMSE and fit of each output before and after."""
    rows = []
    for label, _, _, _ in SETS:
        for signal, old in before.get(label, {}).items():
            new = after.get(label, {}).get(signal)
            full = units.get(signal, signal)
            rows.append(
                (label, signal, shown(old.rmse, full, 3), shown(new.rmse, full, 3) if new else "-",
                 number(old.fit_percent, 3), number(new.fit_percent, 3) if new else "-")
            )  # fmt: skip
    head = ("set", "signal", "RMSE before", "after", "fit % before", "after")
    return f"<h2>{escape(name)}: before and after</h2>" + html_table(head, rows, numbers=2)


def _moved_html(step: Step) -> str:
    """Parameters before and after, the ones that moved most first."""
    rows = []
    for each in step.accepted.parameters:
        far = abs(each.after - each.before) / each.prior_deviation if each.prior_deviation else 0.0
        fixed = np.isfinite(each.prior_deviation)
        rows.append(
            (far if fixed else np.inf, public_name(each.name),
             spread(each.before, each.prior_deviation, each.name),
             spread(each.after, each.deviation, each.name),
             f"{number(far, 2)} deviations" if fixed else "new")
        )  # fmt: skip
    rows.sort(key=lambda each: -each[0])
    head = ("parameter", "before", "after", "moved")
    return "<h2>What moved</h2>" + html_table(head, [each[1:] for each in rows])
