"""The report of what a page, or its replay script, has found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from studies.checking import styled_figures
from studies.figures.comparison import comparison_figures
from studies.figures.diagnosis import diagnosis_figures
from studies.figures.improvement import before_after_figure
from studies.figures.style import save_all, styled
from studies.mode_choice import regions_of
from studies.mode_pictures import figures_of_modes
from studies.modes_text import modes_text
from studies.page.control_tasks import modes_of
from studies.report.page import FIGURES, Section, write_report
from studies.text_of_comparison import comparison_text
from studies.text_of_ranking import ranking_text
from studies.text_of_results import ADDED, FITTED, before_after_text, moved_text, unit_names
from workbench.fitting.fit import FitReport

if TYPE_CHECKING:
    from linearize.modes import HybridModel
    from studies.checking import Checked
    from studies.page.control_tasks import ModeChoice
    from workbench.comparison.compare import Comparison
    from workbench.diagnosis.result import Diagnosis
    from workbench.fitting.errors import Errors
    from workbench.recording import Recording
    from workbench.rig import Rig


class Accepted(Protocol):
    """What both an addition and a fit have."""

    rig: Rig
    before: Errors
    after: Errors


@dataclass(frozen=True)
class Found:
    """What there is to report; what is None or empty was not done."""

    comparison: Comparison | None = field(default=None, repr=False)
    diagnosis: Diagnosis | Any = field(default=None, repr=False)
    steps: Sequence[Accepted] = ()
    hybrid: HybridModel | None = field(default=None, repr=False)
    check: Checked | None = field(default=None, repr=False)


def report(
    folder: Path, command: str, name: str, found: Found, say: Callable[[str], None] = print
) -> Path:
    """Figures and one HTML file of what was found; gives its path."""
    say("drawing")
    sections: list[Section] = []

    def tell(title: str, text: str, table: str, figures: dict[str, Any]) -> None:
        save_all(figures, folder / FIGURES, command)
        sections.append(Section(title, (text,) if text else (), table, (*figures,)))

    if found.comparison:
        figures = comparison_figures(found.comparison)
        tell("The plant against its recordings", "", comparison_text(found.comparison), figures)
    if found.diagnosis:
        each = found.diagnosis
        tell("Which effect is missing", each.sentence, ranking_text(each), diagnosis_figures(each))
    for number, step in enumerate(found.steps, start=1):
        units = unit_names(step.rig.plant.measured)
        parameters = getattr(step, "parameters", ())
        words = _words(step)
        table = before_after_text(step.before, step.after, units, words)
        table += f"\n\n{moved_text(parameters)}" if parameters else ""
        drawn = {f"step_{number}": before_after_figure(step.before, step.after, units, words)}
        note = step.rig.notes[-1] if step.rig.notes else ""
        tell(f"Step {number}", note, table, drawn)
    if found.hybrid:
        say("where each mode predicts")
        table = modes_text(found.hybrid, regions_of(found.hybrid, None, None, say))
        with styled():
            drawn = figures_of_modes(found.hybrid)
        tell("The plant as modes", "", table, drawn)
    if found.check:
        tell("Closed loops", "", found.check.text, styled_figures(found.check))
    if not sections:
        sections.append(Section("Nothing was done yet"))
    return write_report(folder, f"What was found of {name}", command, sections)


def _words(step: Accepted) -> tuple[str, str]:
    """What the errors of a step are before and after, as its command says; the page's has them."""
    own = FITTED if isinstance(step, FitReport) else ADDED
    return getattr(step, "words", own)


def report_with_modes(
    folder: Path,
    command: str,
    rig: Rig,
    found: Found,
    train: Sequence[Recording],
    choice: ModeChoice | None,
    say: Callable[[str], None],
) -> Path:
    """The same with the modes of a choice, made anew: they do not travel between processes."""
    hybrid = modes_of(rig, train, choice) if choice else None
    return report(folder, command, rig.name, replace(found, hybrid=hybrid), say)
