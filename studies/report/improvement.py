"""The report of an improvement: each diagnosis, and the falling error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.export import save_next_recording
from studies.figures.diagnosis import diagnosis_figures
from studies.figures.improvement import budget_figure, errors_figure
from studies.figures.style import save_all
from studies.improvement_text import free_states, improvement_text, window_states
from studies.report.page import FIGURES, Section, write_report
from studies.text_of_next_recording import instructions
from studies.text_of_results import (
    addition_text,
    diagnosis_text,
    unit_names,
)

if TYPE_CHECKING:
    from workbench.diagnosis.improvement import Improvement


def report_improvement(found: Improvement, folder: Path, command: str) -> Path:
    """Figures and the page of an improvement."""
    units = unit_names(found.rig.plant.measured + found.rig.plant.optional_outputs)
    figures = {"error_by_effect": budget_figure(found.budget)} if found.budget else {}
    if found.parameters:
        figures["before_and_after"] = errors_figure(window_states(found), units)
        if found.free_before:
            figures["free_runs_before_and_after"] = errors_figure(free_states(found), units)
    sections = [Section("The falling error", (), improvement_text(found, units), (*figures,))]
    for number, diagnosis in enumerate(found.diagnoses, start=1):
        drawn = diagnosis_figures(diagnosis, f"{number}_")
        text = diagnosis_text(diagnosis, units)
        sections.append(Section(f"Diagnosis {number}", (diagnosis.sentence,), text, (*drawn,)))
        figures |= drawn
    sections += _next_recording(found, folder, command)
    for number, step in enumerate(found.steps, start=1):
        title = f"Addition {number}: {step.candidate.name}{_fate(found, step.candidate.name)}"
        sections.append(Section(title, step.rig.notes[-1:], addition_text(step, units)))
    for swap in found.swaps:
        if (step := swap.addition) is not None:
            title = f"Swapped in: {swap.rival.name} for {swap.candidate.name}"
            sections.append(Section(title, step.rig.notes[-1:], addition_text(step, units)))
    save_all(figures, folder / FIGURES, command)
    return write_report(folder, f"Improvement of {found.rig.name}", command, sections)


def _fate(found: Improvement, name: str) -> str:
    """What the second thoughts made of an addition, behind its name; nothing where it stays."""
    if any(each.dropped and each.candidate.name == name for each in found.removals):
        return ", dropped later"
    rivals = (s.rival.name for s in found.swaps if s.replaced and s.candidate.name == name)
    return next((f", later replaced by {rival}" for rival in rivals), "")


def _next_recording(found: Improvement, folder: Path, command: str) -> list[Section]:
    """What the last diagnosis asks for: predictions, and the commands to play beside them."""
    asked = found.diagnoses[-1].next_recording if found.diagnoses else None
    if asked is None or not asked.predicted:
        return []
    save_next_recording(found.rig, asked, folder / FIGURES, command)
    looped = asked.conduct is not None and asked.conduct.loop is not None
    what = "the reference of the loop below" if looped else "the commands, ready to play"
    notes = (f"{FIGURES}/next_recording.csv holds {what}",)
    return [Section("Next recording", notes, instructions(asked), ("next_recording",))]
