"""Jobs of the last tabs: modes, a design in closed loop, the report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from controllers.design_file import design, write_design
from linearize.cuts import Interval
from linearize.modes import HybridModel
from linearize.prediction import error_along
from linearize.stopped import has_stops
from linearize.visits import recorded_visits
from studies.checking import Checked, loops_of, recorded_runs, styled_figures
from studies.design_numbers import design_numbers
from studies.design_report import design_report
from studies.design_text import design_texts
from studies.mode_choice import FINE, chosen_modes, regions_of
from studies.mode_pictures import figures_of_modes
from studies.modes_text import modes_text
from studies.page.drawn import drawings
from studies.page.mode_cuts import cuts_of
from studies.sample_times import require_multiple
from studies.specification import read_specification
from studies.text import number
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.whole_file import whole_file

Say = Callable[[str], None]


@dataclass(frozen=True)
class ModeChoice:
    """Which modes: as they are, by regimes, placed on recordings, or by a file of cuts."""

    regimes: bool = False
    placed: int | None = None
    cuts_file: str = ""
    cuts: str = field(default="", repr=False)


@dataclass(frozen=True, eq=False)
class Linearised:
    """Modes as text and drawings, their cuts, and their error over 50 ms, in shares of a scale."""

    choice: ModeChoice
    text: str = field(repr=False)
    drawn: Mapping[str, str] = field(repr=False)
    cuts: Mapping[str, tuple[Interval, ...]]
    error: float
    count: int


@dataclass(frozen=True, eq=False)
class Looped:
    """A design, what is known of it piece by piece, and its closed loops."""

    told: tuple[str, ...] = field(repr=False)
    check: Checked = field(repr=False)
    drawn: Mapping[str, str] = field(repr=False)


def linearise(
    rig: Rig, recordings: Sequence[Recording], choice: ModeChoice, say: Say
) -> Linearised:
    """Modes, how well they predict on the recordings, told at once, where, and their maps."""
    say("linearising")
    hybrid = modes_of(rig, recordings, choice)
    error = _error(rig, hybrid, recordings, say)
    known = f"prediction error {number(100.0 * error, 3)} %; " if recordings else ""
    regions = regions_of(hybrid, None, None, lambda message: say(known + message))
    say(known + "drawing")
    return Linearised(
        choice,
        modes_text(hybrid, regions),
        drawings(figures_of_modes(hybrid)),
        cuts_of(hybrid),
        error,
        len(hybrid.modes),
    )


def modes_of(rig: Rig, recordings: Sequence[Recording], choice: ModeChoice) -> HybridModel:
    """The modes of a choice; its cuts are written, as another browser tab may have its own."""
    cuts = Path(choice.cuts_file) if choice.cuts_file else None
    if cuts:
        with whole_file(cuts) as unfinished:
            unfinished.write_text(choice.cuts, encoding="utf-8")
    placed_on = recordings if choice.placed is not None else ()
    return chosen_modes(rig, placed_on, choice.placed, choice.regimes, cuts)


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
    return error_along(hybrid, seen)


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
    require_multiple(rig.plant, found.controller.sample_time_s, f"{method}.sample_time_s")
    told, path = tuple(design_texts(design_report(found, say))), Path(target)
    write_design(found, path)
    loops = loops_of(rig, {path: path.read_text(encoding="utf-8")}, estimators, scenarios)
    checked = recorded_runs(replace(loops, asked=asked.asked if asked else ()), runs, say)
    return Looped(told, checked, drawings(styled_figures(checked, rig.plant)))
