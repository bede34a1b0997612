"""SPEC.toml: what a closed loop is asked for, line by line, and numbers of the designs for it.

Lines stand at the top with their unit (``rise_time = "150 ms"``), limits of states in ``[limits]``
(``"slide.velocity" = "1 m/s"``, or from and to as a list), and numbers of a controller in a table
of its name (``[mpc]``), in SI as in a design file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from math import inf, isfinite, isnan, nan
from pathlib import Path
from typing import Any

import numpy as np

from controllers import CONTROLLERS
from controllers.design_file import methods_of
from controllers.spec import replaced
from linearize.axes import stroke_m
from linearize.standard import SHIFT_MODES, SLIDE_MODES
from studies.asked_lines import (
    ALL_LINES,
    ARRIVED,
    EVERYWHERE,
    LONGEST_S,
    MOVING,
    OVERSHOOT,
    SHIFT_LINES,
    SLIDE_LINES,
    within,
)
from studies.following import BENCHES
from studies.following_check import Followed, tasks_of
from studies.scenarios import SCENARIOS
from studies.shift_check import SHIFTS
from studies.text import number, until
from workbench.closed_loop import LoopRecord
from workbench.errors import InputError, Message, listed, nearest
from workbench.plant import Plant, require
from workbench.rig import Rig
from workbench.rig_text import RigText, read_text
from workbench.units import Scale, UnitError, public_name, quantity, scale, si_unit, split

LIMITS = "limits"
PERCENT = ("%", "percent")

MISPLACED = "stands inside [{}]; move it above the tables"


@dataclass(frozen=True)
class Asked:
    """One line of a specification: from where to where a figure of a run may lie, in SI.

    name          as the file has it
    figure        the full name of the figure, which ends in its unit
    scenarios     those that the line is judged in
    unit, scale   as typed, to show what was found likewise
    """

    name: str
    figure: str
    least: float
    most: float
    scenarios: tuple[str, ...]
    unit: str
    scale: Scale

    def found(self, row: Any, record: LoopRecord) -> float:
        """The figure of a run; NaN where it has none.

        So for a step that never rose: an axis that stays where it is neither overshoots nor swings.
        """
        figures = row.figures if isinstance(row, Followed) else vars(row)
        if self.figure.startswith(ARRIVED) and isnan(figures.get("rise_s", 0.0)):
            return nan
        return figures[self.figure] if self.figure in figures else getattr(row, self.figure)

    def excess(self, found: float) -> float:
        """How far beyond what is asked: below 0 inside of it; infinite without a figure."""
        return max(self.least - found, found - self.most) if isfinite(found) else inf

    def allows(self, found: float) -> bool:
        """Whether a figure is as asked, to within rounding; none is not."""
        return isfinite(found) and bool(within(found, self.most, self.least))

    @property
    def ends(self) -> tuple[float, ...]:
        """What bounds the figure, in SI, the lower one first if there is one."""
        if self.least == -inf or (self.least == -self.most and si_unit(self.figure) == "Pa"):
            return (self.most,)  # no absolute pressure is below 0
        return (self.least, self.most)

    @property
    def text(self) -> str:
        """What is asked for, in words."""
        if len(self.ends) == 1:
            return f"at most {self.shown(self.most)}"
        return f"{number(self.scale.from_si(self.least))} to {self.shown(self.most)}"

    def shown(self, value: float) -> str:
        """A value of the figure in the unit that was typed."""
        if not isfinite(value):
            return until(value)
        return f"{number(self.scale.from_si(value))} {self.unit}".strip()


@dataclass(frozen=True)
class Limit(Asked):
    """A line on a state, of which no sample of a run may lie outside."""

    def found(self, row: Any, record: LoopRecord) -> float:
        """The extreme of the state that goes farthest beyond, or comes nearest to it."""
        ends = [float(end(record.recording[self.figure])) for end in (np.min, np.max)]
        return max(ends, key=self.excess)


@dataclass(frozen=True)
class Specification:
    """All lines of a file, and numbers of designs by the controller's name."""

    asked: tuple[Asked, ...]
    numbers: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


def read_specification(
    path_or_text: Path | str, rig: Rig, scenarios: Iterable[str] = ()
) -> Specification:
    """The specification of a file, or of its text, for a rig that ``check`` knows.

    Parameters
    ----------
    scenarios
        Those of the check, in which every line must have something to judge; all by default.

    Raises
    ------
    InputError
        With everything that is wrong in the file, sorted by line; or if a scenario does not exist,
        or the plant has no standard modes to control.
    """
    lines, judged = _known(rig.plant)
    chosen = tuple(scenarios) or tuple(judged)
    require(chosen, judged, "the list of scenarios")
    content, path = read_text(path_or_text)
    text = RigText(content, str(path) if path else "spec", "a specification")
    _top_keys(text, lines, rig.plant)
    asked = [*_figures(text, rig, lines, judged), *_limits(text, rig, tuple(judged))]
    for line in asked:
        if not set(chosen) & set(line.scenarios):
            what, expected = f"is not judged in {listed(chosen)}", f"among {listed(line.scenarios)}"
            text.wrong(tuple(line.name.split(".", 1)), what, expected=f"a scenario {expected}")
    numbers = {name: _numbers(text, name) for name in CONTROLLERS if name in text.tree}
    text.finish()
    return Specification(tuple(asked), numbers)


def _known(plant: Plant) -> tuple[Mapping[str, str], dict[str, bool]]:
    """The figure of each line, and whether each scenario ends at rest."""
    if plant.name in SHIFT_MODES:
        return SHIFT_LINES, dict.fromkeys(SHIFTS, True)
    if plant.name in SLIDE_MODES:
        stroke = stroke_m(plant)
        return SLIDE_LINES, {name: make(stroke).ends_at_rest for name, make in SCENARIOS.items()}
    if plant.name in BENCHES:
        tasks = tasks_of(plant)
        return BENCHES[plant.name].lines, {name: t.ends_at_rest for name, t in tasks.items()}
    expected = f"a rig of {listed((*SLIDE_MODES, *SHIFT_MODES, *BENCHES))}"
    raise InputError(Message(f"{plant.name} has no standard modes to control", expected=expected))


def _top_keys(text: RigText, lines: Mapping[str, str], plant: Plant) -> None:
    known = (*lines, LIMITS, *CONTROLLERS)
    for key in text.tree:
        if key in ALL_LINES and key not in known:
            expected = f"one of {listed((*lines, LIMITS), 99)}"
            text.wrong((key,), f"{plant.name} is not judged by it", expected=expected)
        elif key not in known:
            expected = f"one of {listed(known, len(known))}"
            if numbers := _numbers_called(key, known, plant):
                expected = f"a number of a controller in its table: {listed(numbers)}"
            what = f"{text.kind} has no such name"
            text.wrong((key,), what, expected=expected, known=numbers or known)


def _numbers_called(key: str, known: Iterable[str], plant: Plant) -> list[str]:
    """Numbers of the plant's controllers whose last name is most like a key; none if a known is."""
    numbers = [f"{m}.{name}" for m in methods_of(plant) for name in _names(CONTROLLERS[m].spec())]
    last = [name.rpartition(".")[2] for name in numbers]
    near = nearest(key, (*known, *last))
    return [whole for whole, end in zip(numbers, last, strict=True) if end == near]


def _names(spec: Any, before: str = "") -> Iterator[str]:
    """The numbers of a design by their dotted name, without the controller's."""
    for each in fields(spec):
        value = getattr(spec, each.name)
        if is_dataclass(value):
            yield from _names(value, f"{before}{each.name}.")
        else:
            yield before + each.name


def _figures(
    text: RigText, rig: Rig, lines: Mapping[str, str], judged: Mapping[str, bool]
) -> Iterator[Asked]:
    for name in text.tree:
        if name not in lines:
            continue
        figure, typed = lines[name], text.tree[name]
        at_rest = figure not in MOVING
        scenarios = [s for s, rests in judged.items() if figure in EVERYWHERE or rests == at_rest]
        if name == OVERSHOOT and str(typed).rstrip().endswith(PERCENT):
            figure = "overshoot_share"
        if found := _quantity(text, (name,), rig, figure, typed):
            most, unit, shown_in = found
            if si_unit(figure) == "s" and not 0.0 < most <= LONGEST_S:
                expected = f"a time above 0, to {LONGEST_S:g} s"
                text.wrong((name,), f"is {typed}", expected=expected)
            elif most < 0.0 or (figure == "switches" and most != round(most)):
                whole = "a whole number" if figure == "switches" else "a quantity"
                text.wrong((name,), f"is {typed}", expected=f"{whole} from 0")
            yield Asked(name, figure, -inf, most, tuple(scenarios), unit, shown_in)


def _limits(text: RigText, rig: Rig, scenarios: tuple[str, ...]) -> Iterator[Asked]:
    known = {public_name(name): name for name in rig.plant.lean().model.states}
    for name, typed in text.flat(LIMITS).items():
        place = (LIMITS, name)
        if name in ALL_LINES:
            text.wrong(place, MISPLACED.format(LIMITS))
            continue
        if name not in known:
            text.unknown(place, rig.plant.name, known)
            continue
        pair = typed if isinstance(typed, list) else [typed]
        if isinstance(typed, list) and len(pair) != 2:
            text.wrong(place, f"is {typed}", expected="one limit, or a list of from and to")
            continue
        ends = [_quantity(text, place, rig, known[name], each) for each in pair]
        if None in ends:
            continue
        most, unit, shown_in = ends[-1]
        least = ends[0][0] if len(pair) == 2 else -most
        if least >= most:
            expected = "from and to, the lower one first" if len(pair) == 2 else "more than 0"
            text.wrong(place, f"is {typed}", expected=expected)
        yield Limit(f"{LIMITS}.{name}", known[name], least, most, scenarios, unit, shown_in)


def _quantity(
    text: RigText, place: tuple[str, ...], rig: Rig, name: str, typed: Any
) -> tuple[float, str, Scale] | None:
    """A quantity in SI, the unit it was typed in, and that unit's scale; complaints to ``text``."""
    try:
        value, unit = quantity(typed, name, rig.ambient_pa), split(typed, name)[1]
    except UnitError as error:
        share = " or %" if place == (OVERSHOOT,) else ""
        text.wrong(place, str(error) + share)
        return None
    if not isfinite(value):
        text.wrong(place, f"is {typed}", expected="a finite quantity")
        return None
    return value, unit, scale(unit, name, rig.ambient_pa) if unit else Scale()


def _numbers(text: RigText, method: str) -> Mapping[str, Any]:
    """Numbers of a design, with the complaints of its specification placed in the file."""
    spec = CONTROLLERS[method].spec()
    known = {f"{method}.{number}" for number in _names(spec)}
    try:
        replaced(spec, text.tree[method], method)
    except InputError as error:
        for each in error.messages:
            line = text.line(tuple(each.name.split(".")))
            table, _, key = each.name.rpartition(".")
            misplaced = key in ALL_LINES and each.name not in known
            told = Message(MISPLACED.format(table), key) if misplaced else each
            text.messages.append(replace(told, file=text.file, line=line))
    return text.tree[method]
