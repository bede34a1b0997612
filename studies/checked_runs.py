"""A check over so many runs: what every line came to, how often it is missed, where and why."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from linearize.standard import SHIFT_MODES
from studies.checking import Checked, styled_figures
from studies.closed_loop_check import Check
from studies.closed_loop_metrics import Metrics
from studies.documents import Document, check_document
from studies.following import BENCHES
from studies.following_check import Followed, FollowingCheck
from studies.kept import Row
from studies.many_runs import Setup, closed, read, rows_of
from studies.robustness import Line, Robustness
from studies.shift_check import Shift, ShiftCheck
from studies.slow_calls import slow_calls
from studies.specification import Specification
from studies.stayed_away import stayed_away
from studies.verdicts import Figures, Judged, Verdict, judge
from studies.workers import Workers
from workbench.rig import Rig
from workbench.rig_text import read_text
from workbench.units import public_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FEW = 12  # runs that are told one by one, and drawn all
WORST_DRAWN = 3
MOST_LOST_TOLD = 5


@dataclass(frozen=True)
class Lost:
    """A loop that broke off: its run from 1, where, and why."""

    run: int
    scenario: str
    estimator: str
    said: str

    @property
    def where(self) -> str:
        return self.scenario + (f" with {self.estimator}" if self.estimator else "")


@dataclass(frozen=True)
class CheckedRuns:
    """The rows of all runs of one design, in their order, the first of the rig's own plant."""

    setup: Setup
    rows: tuple[Row, ...]
    spec: Specification | None = None

    @property
    def several(self) -> bool:
        return len(self.rows) > 1

    @cached_property
    def found(self) -> Checked:
        """The metrics of every loop that held, without records."""
        kind, entry = _kind(self.setup.rig)
        rows = [
            entry(**{**read(loop["metrics"]), "design": self._design(number)})
            for number, loop in self._loops()
            if "metrics" in loop
        ]
        return kind(tuple(rows), ())

    @cached_property
    def lost(self) -> tuple[Lost, ...]:
        """The loops that broke off."""
        return tuple(
            Lost(number + 1, loop["scenario"], loop["estimator"], loop["lost"])
            for number, loop in self._loops()
            if "lost" in loop
        )

    @cached_property
    def judged(self) -> Judged | None:
        """A verdict per line of the specification, if there is one."""
        if self.spec is None:
            return None
        runs = [
            [
                Figures(loop["scenario"], loop["estimator"], read(loop.get("lines", {})))
                for loop in row["loops"]
            ]
            for row in self.rows
        ]
        return judge(self.spec, self.setup.rig, runs)

    @property
    def met(self) -> bool:
        """True when every run gets there and meets every line; without a specification, the goal.

        What stays where it is takes no air and keeps all limits.
        """
        if self.judged:
            return self.judged.met and not self.unreached
        return not self.lost and all(row.reached is not False for row in self.found.rows)

    @property
    def unreached(self) -> tuple[str, ...]:
        """What some run never came near, each with its number of runs where there are several."""
        runs: dict[str, set[int]] = {}
        asked = self.spec.asked if self.spec else ()
        for number, loop in self._loops():
            if "metrics" in loop and stayed_away(loop["scenario"], read(loop["metrics"]), asked):
                runs.setdefault(loop["scenario"], set()).add(number)
        several = f" in {{}} of {len(self.rows)} runs" if self.several else ""
        return tuple(scenario + several.format(len(those)) for scenario, those in runs.items())

    @cached_property
    def robustness(self) -> Robustness:
        """The lines of the specification over all runs; without one, the goal."""
        lines = [*self._lines()] if self.judged else [*self._goals()]
        names = dict.fromkeys(name for row in self.rows for name in row["deviations"])
        off = {n: np.array([row["deviations"].get(n, 0.0) for row in self.rows]) for n in names}
        return Robustness(tuple(line for _, line in lines), off, "run")

    @property
    def text(self) -> str:
        """Few runs one by one, with the verdicts; of many the lines and the worst runs."""
        tables = [self.robustness.text]
        if len(self.rows) <= FEW:
            tables = [self.found.text] if self.found.rows else []
            tables += [self.judged.text] if self.judged else []
        lost = [
            f"run {each.run} was lost in {each.where}: {each.said}\n"
            f"  {self.robustness.told(each.run - 1)}"
            for each in self.lost[:MOST_LOST_TOLD]
        ]
        if (more := len(self.lost) - MOST_LOST_TOLD) > 0:
            lost.append(f"and {more} more loops were lost")
        return "\n\n".join([*tables, *(["\n".join(lost)] if lost else [])])

    @property
    def document(self) -> Document:
        """Every run and every verdict, in SI; of several runs, what their spread says."""
        document = check_document(self.setup.rig.name, self.found)
        held = iter(document["runs"])
        known = dict.fromkeys(document["runs"][0] if document["runs"] else ())
        document["runs"] = [
            next(held) if "metrics" in loop else {**known, **self._lost_entry(number, loop)}
            for number, loop in self._loops()
        ]
        if self.judged:
            document |= self.judged.document | {"in_specification": self.met}
        if self.several:
            lines = self._lines() if self.judged else self._goals()
            document["robustness"] = [self._entry(*each) for each in lines]
        return document

    def figures(self) -> dict[str, Figure]:
        """The loops of few runs, or of the first and the worst, closed again; of many a spread."""
        numbers = [*range(len(self.rows))]
        if len(self.rows) > FEW:
            numbers = sorted({0, *self.robustness.worst[:WORST_DRAWN]})
        kind, _ = _kind(self.setup.rig)
        rows, records = [], []
        for number in numbers:
            for found in closed(self.setup, number):
                if not isinstance(found, str):
                    rows += [replace(row, design=self._design(number)) for row in found.rows]
                    records += found.records
        figures = styled_figures(kind(tuple(rows), tuple(records)), self.setup.rig.plant)
        if self.spec:
            from studies.figures.limits import limit_figures

            figures |= limit_figures(self.spec.asked, rows, records)
        if len(self.rows) > FEW:
            from studies.figures.robustness import influence_figure, spread_figure

            figures["influences"] = influence_figure(self.robustness)
            if self.judged:
                figures["spread"] = spread_figure(self.robustness, self._limits())
        return figures

    def _loops(self) -> Iterator[tuple[int, Row]]:
        for number, row in enumerate(self.rows):
            for loop in row["loops"]:
                yield number, loop

    def _design(self, number: int) -> str:
        return self.setup.path.stem + (f" {number + 1}" if self.several else "")

    def _lost_entry(self, number: int, loop: Row) -> Document:
        where = {"scenario": loop["scenario"], "estimator": loop["estimator"]}
        return {"design": self._design(number), **where, "reached": False, "lost": loop["lost"]}

    def _lines(self) -> Iterator[tuple[tuple[str, str, str], Line]]:
        for verdict in self.judged.verdicts if self.judged else ():
            place = (verdict.asked.name, verdict.scenario, verdict.estimator)
            yield place, _line_of(verdict, self._called(*place))

    def _goals(self) -> Iterator[tuple[tuple[str, str, str], Line]]:
        """Missed, 1, or not, 0; a reference that does not end at rest is only missed if lost."""
        rows, first = iter(self.found.rows), self.rows[0]["loops"]
        answers = [next(rows).reached if "metrics" in loop else False for _, loop in self._loops()]
        missed = np.array([answer is False for answer in answers]).reshape(-1, len(first))
        for loop, each in zip(first, missed.T, strict=True):
            key = ("goal", loop["scenario"], loop["estimator"])
            yield key, Line(self._called(*key), "not missed", each.astype(float), each)

    def _called(self, line: str, scenario: str, estimator: str) -> str:
        several = len({loop["estimator"] for loop in self.rows[0]["loops"]}) > 1
        return ", ".join((line, scenario, *([estimator] if several else [])))

    def _limits(self) -> dict[str, float]:
        """The limit of each line in its unit, as the figure shows it."""
        verdicts = self.judged.verdicts if self.judged else ()
        return {
            line.name: 0.0 if _two_sided(each) else each.asked.scale.from_si(each.asked.most)
            for each, line in zip(verdicts, self.robustness.lines, strict=True)
        }

    def _entry(self, place: tuple[str, str, str], line: Line) -> Document:
        name, scenario, estimator = place
        moved = {public_name(n): r for n, r in self.robustness.influences(line)}
        return {
            "line": name,
            "scenario": scenario,
            "estimator": estimator or None,
            "probability": line.probability,
            "interval": [*line.interval],
            "influences": None if self.robustness.unranked else moved,
            "worst_run": int(line.worst[0]) + 1,
        }


def _kind(rig: Rig) -> tuple[type[Checked], type[Metrics | Shift | Followed]]:
    if rig.plant.name in SHIFT_MODES:
        return ShiftCheck, Shift
    return (FollowingCheck, Followed) if rig.plant.name in BENCHES else (Check, Metrics)


def _two_sided(verdict: Verdict) -> bool:
    return verdict.asked.least not in (-inf, -verdict.asked.most)


def _line_of(verdict: Verdict, name: str) -> Line:
    """A line as its figure in the typed unit; of one with two ends, how far beyond them."""
    asked, found = verdict.asked, np.array(verdict.found)
    if _two_sided(verdict):
        beyond = [min(asked.excess(v), 0.0 if asked.allows(v) else inf) for v in found]
        name, values = f"{name}, beyond", np.array(beyond) / asked.scale.factor
    else:
        values = asked.scale.from_si(np.where(np.isfinite(found), np.abs(found), inf))
    return Line(name, asked.text, np.array(values), ~np.array(verdict.met), asked.unit)


def check_rig(
    rig: Rig,
    design: Path,
    estimators: Iterable[str] = (),
    scenarios: Iterable[str] = (),
    *,
    spec: Specification | None = None,
    runs: int = 1,
    workers: Workers | None = None,
    keep: Path | None = None,
    say: Callable[[str], None] = lambda message: None,
) -> CheckedRuns:
    """A design of a file against the rig's plant; from the second run on, against drawn ones.

    Parameters
    ----------
    workers
        Where runs are worked on, by default in this process.
    keep
        A file of rows: what is there is not done again.

    Raises
    ------
    InputError
        As :func:`~studies.checking.loops_of` and :func:`~studies.many_runs.rows_of`.
    ArithmeticError
        If there is one run only, and a loop of it is lost.
    """
    asked = spec.asked if spec else ()
    text, _ = read_text(design)
    setup = Setup(rig, design, text, tuple(estimators), tuple(scenarios), tuple(asked))
    rows = rows_of(setup, runs, workers or Workers(1), keep, say)
    found = CheckedRuns(setup, tuple(rows), spec if asked else None)
    if found.lost and not found.several:
        raise ArithmeticError(found.lost[0].said)
    if said := slow_calls(setup.loops, found.found):
        warnings.warn(said, stacklevel=2)
    return found
