"""Jobs of the last tabs: modes, a design in closed loop, the report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from controllers.design_file import Design, design, write_design
from linearize.cuts import Interval
from linearize.hybrid_simulation import sampled_hybrid
from linearize.modes import HybridModel
from linearize.prediction import prediction_of
from linearize.standard import SHIFT_MODES
from linearize.stopped import has_stops
from linearize.visits import joined, recorded_visits, windows
from studies.checking import loops_of, recorded_runs, styled_figures
from studies.closed_loop_check import Check
from studies.design_text import certificate_text, margins_text, search_text
from studies.figures.modes import pole_figure
from studies.mode_choice import FINE, chosen_modes, regions_of
from studies.mode_pictures import map_figure, step_figure, step_of
from studies.mode_views import VIEWS, view_of
from studies.modes_text import modes_text
from studies.page.drawn import drawings
from studies.page.mode_cuts import cuts_of
from studies.shift_check import ShiftCheck
from studies.specification import design_numbers, read_specification
from workbench.errors import whole_file
from workbench.recording import Recording
from workbench.rig import Rig

Say = Callable[[str], None]


@dataclass(frozen=True)
class ModeChoice:
    """Which modes: as they are, by regimes, placed on recordings, or by a file of cuts."""

    regimes: bool = False
    placed: int | None = None
    cuts_file: str = ""
    cuts: str = field(default="", repr=False)


@dataclass(frozen=True)
class Linearised:
    """Modes as text and drawings, their cuts, and their error over 50 ms, in shares of a scale."""

    choice: ModeChoice
    text: str = field(repr=False)
    drawn: Mapping[str, str] = field(repr=False)
    cuts: Mapping[str, tuple[Interval, ...]]
    error: float
    count: int


@dataclass(frozen=True)
class Looped:
    """A design, what is certified of it, and its closed loops with the plants of the runs."""

    design_file: str
    told: str = field(repr=False)
    check: Check | ShiftCheck = field(repr=False)
    drawn: Mapping[str, str] = field(repr=False)


def linearise(
    rig: Rig, recordings: Sequence[Recording], choice: ModeChoice, say: Say
) -> Linearised:
    """Modes, their maps, where they predict, and how well on the recordings."""
    say("linearising")
    cuts = Path(choice.cuts_file) if choice.cuts_file else None
    if cuts:
        with whole_file(cuts) as unfinished:
            unfinished.write_text(choice.cuts, encoding="utf-8")
    placed_on = recordings if choice.placed is not None else ()
    hybrid = chosen_modes(rig, placed_on, choice.placed, choice.regimes, cuts)
    regions = regions_of(hybrid, None, None, say)
    say("drawing")
    figures = {"poles": pole_figure(hybrid)}
    if hybrid.plant.name in VIEWS:
        modes = sampled_hybrid(hybrid, view_of(hybrid).sample_time_s)
        figures |= {"map": map_figure(modes), "step": step_figure(step_of({"modes": hybrid}))}
    return Linearised(
        choice,
        modes_text(hybrid, regions),
        drawings(figures),
        cuts_of(hybrid),
        _error(rig, hybrid, recordings, say),
        len(hybrid.modes),
    )


def _error(rig: Rig, hybrid: HybridModel, recordings: Sequence[Recording], say: Say) -> float:
    """RMS error of the modes beside the plant along the recordings; NaN without one."""
    if not recordings:
        return float("nan")
    say("prediction along the recordings")
    per_sample = FINE.get(hybrid.plant.name, 1)
    seen = [
        recorded_visits(rig, hybrid.model, each, has_stops(hybrid), per_sample)
        for each in recordings
    ]
    judged = windows(joined(seen))
    return prediction_of(sampled_hybrid(hybrid, judged.sample_time_s), judged).total


def close_loops(
    rig: Rig,
    method: str,
    target: str,
    estimators: Sequence[str],
    scenarios: Sequence[str],
    runs: int,
    spec: str,
    say: Say,
) -> Looped:
    """A design, written, and its closed loops on the full plant, as design and check do it."""
    asked = read_specification(spec, rig, scenarios) if spec.strip() else None
    numbers = design_numbers(asked, method, rig.plant) if asked else {}
    say(f"designing {method}")
    found = design(method, rig.plant, numbers)
    path = Path(target)
    write_design(found, path)
    shifts = rig.plant.name in SHIFT_MODES
    told = search_text(found.controller) if shifts else _certified(found, say)
    observers = () if shifts else estimators
    loops = loops_of(rig, {path: path.read_text(encoding="utf-8")}, observers, scenarios)
    checked = recorded_runs(loops, runs, say)
    return Looped(target, told, checked, drawings(styled_figures(checked)))


def _certified(found: Design, say: Say) -> str:
    """Margins of each mode, and what is certified across modes."""
    from controllers.certificate import certificate
    from controllers.margins import loops, margins, unforeseen_s

    made, delay_s = found.controller, unforeseen_s(found.plant)
    loop = (found.hybrid, made.laws, made.sample_time_s, delay_s)
    told = margins_text(margins(*loop), delay_s)
    say("looking for a certificate across modes")
    return f"{told}\n{certificate_text(certificate(loops(*loop), made.sample_time_s))}"
