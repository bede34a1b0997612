"""The main job, end to end: a recorded drive lacks an effect, and nobody here knows which.

compare, see where, diagnose, add, watch the error fall on the validation recording, linearise the
improved plant into modes, design PID, LQ and MPC, and check each with two estimators in closed loop
on the full nonlinear plant.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from controllers.design_file import design, write_design
from linearize.standard import standard_modes
from studies.checking import styled_figures
from studies.closed_loop_check import Check, check
from studies.closed_loop_metrics import table as loop_table
from studies.documents import check_document, diagnosis_document
from studies.export import export_modes
from studies.figures.comparison import comparison_figures
from studies.figures.diagnosis import diagnosis_figures
from studies.figures.improvement import before_after_figure
from studies.figures.modes import pole_figure
from studies.figures.style import save_all
from studies.figures.summary import summary_figure
from studies.modes_text import modes_text
from studies.report.page import FIGURES, Section, write_report
from studies.text_of_comparison import comparison_text
from studies.text_of_results import ADDED, addition_text, diagnosis_text, unit_names
from workbench.comparison import compare
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.improve import accept
from workbench.fitting.windows import WINDOW_S
from workbench.reading import read_recording
from workbench.recording import Recording
from workbench.rig import Rig, load_rig
from workbench.rig_writing import write_rig
from workbench.whole_file import whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from workbench.comparison.compare import RecordingComparison
    from workbench.diagnosis.result import Diagnosis

DATA = Path(__file__).with_name("demo_data")
MOST_WINDOWS = 24  # half of what the recording holds: all would take longer and say no more
OBSERVERS = ("ekf", "mhe")
METHODS = ("pid", "lq", "mpc")

Say = Callable[[str], None]


@dataclass(frozen=True)
class Story:
    """What is told while the demo runs: on the terminal, as figures, and in the report."""

    folder: Path
    command: str
    say: Say
    show: Say
    sections: list[Section] = field(default_factory=list)

    def tell(self, title: str, text: str, table: str, figures: Mapping[str, Figure]) -> None:
        """One part: printed, its figures saved, and kept for the report."""
        self.show(f"\n== {title}\n{text}\n\n{table}")
        save_all(figures, self.folder / FIGURES, self.command)
        self.sections.append(Section(title, (text,), table, (*figures,)))

    def keep(self, name: str, document: dict) -> None:
        """A result as JSON."""
        import json

        with whole_file(self.folder / name) as unfinished:
            text = json.dumps(document, indent=2, allow_nan=False)
            unfinished.write_text(text + "\n", encoding="utf-8")


def run_demo(folder: Path, command: str, say: Say, show: Say) -> Path:
    """Everything from two recordings to a report; gives the report's path."""
    story = Story(folder, command, say, show)
    rig = load_rig(DATA / "rig.toml")
    train = read_recording(rig, DATA / "train.csv")
    validation = read_recording(rig, DATA / "validation.csv")
    before = _compare(story, "The recording against the plant as it is", rig, validation, "before_")
    found = _diagnose(story, rig, train, validation)
    improved, after = rig, before
    if found.best is not None:
        improved = _add(story, rig, found)
        title = "The improved plant on the validation recording"
        after = _compare(story, title, improved, validation, "")
    write_rig(improved, folder / "improved.toml")
    _linearise(story, improved)
    checked = _control(story, improved)
    summary = {"summary": summary_figure(found, before, after, checked)}
    save_all(summary, folder / FIGURES, command)
    story.sections.insert(0, Section("In short", (found.sentence,), "", (*summary,)))
    say("report")
    page = write_report(folder, "From a recording to a controller", command, story.sections)
    show(f"\nwrote {page}, {folder / FIGURES} and {folder / 'improved.toml'}")
    return page


def _compare(
    story: Story, title: str, rig: Rig, validation: Recording, prefix: str
) -> RecordingComparison:
    story.say("comparing")
    found = compare(rig, [validation])
    text = (
        f"One step ahead, over windows of {WINDOW_S:g} s with free start, and as a free run over "
        "the whole recording.  Positions integrate, so a free run drifts with every small error."
    )
    story.tell(title, text, comparison_text(found), comparison_figures(found, prefix))
    return found.recordings[0]


def _diagnose(story: Story, rig: Rig, train: Recording, validation: Recording) -> Diagnosis:
    found = diagnose(rig, [train], [validation], story.say, most_windows=MOST_WINDOWS)
    story.keep("diagnosis.json", diagnosis_document(found, unit_names(rig.plant.measured)))
    title = "Which effect is missing, and where it shows"
    story.tell(title, found.sentence, diagnosis_text(found, {}), diagnosis_figures(found))
    return found


def _add(story: Story, rig: Rig, found: Diagnosis) -> Rig:
    """The rig with the effect that a diagnosis names."""
    units = unit_names(rig.plant.measured)
    added = accept(rig, found)
    name = added.candidate.name
    text = f"{name} is added and fitted with the uncertain parameters; validation is predicted."
    figures = {"before_and_after": before_after_figure(added.before, added.after, units, ADDED)}
    story.tell(f"Errors before and after {name}", text, addition_text(added, units), figures)
    return added.rig


def _linearise(story: Story, rig: Rig) -> None:
    story.say("linearising")
    hybrid = standard_modes(rig.plant)
    table = modes_text(hybrid, ())
    export_modes(hybrid, story.folder / "modes", story.command, table)
    text = "Valve, friction and place on the stroke are cut; each box has its own affine model."
    story.tell("The improved plant as modes", text, table, {"poles": pole_figure(hybrid)})


def _control(story: Story, rig: Rig) -> Check:
    designs = {}
    for method in METHODS:
        story.say(f"designing {method}")
        found = design(method, rig.plant)
        write_design(found, story.folder / f"{method}.toml")
        designs[method] = found.controller
    story.say("closed loops on the full nonlinear plant")
    step = check(rig.plant, designs, OBSERVERS, ["step"])
    best = step.best.design
    sine = check(rig.plant, {best: designs[best]}, ["ekf"], ["sine"])
    found = Check(step.rows + sine.rows, step.records + sine.records)
    story.keep("check.json", check_document(rig.name, found))
    text = (
        "Every design with two estimators in a step, and the best with the Kalman filter along a "
        "sine, on the full nonlinear plant with sensor noise, resolution and converter.  Best: "
        f"{best} with {step.best.estimator}, which ends {1e3 * step.best.final_error_m:.2g} mm "
        "from the target."
    )
    story.tell("Closed loops", text, loop_table(found.rows), styled_figures(found))
    return found
