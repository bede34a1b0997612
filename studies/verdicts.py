"""A closed-loop check held against a specification: a verdict per line, over all runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np

from studies.checking import drawn_plant
from studies.documents import Document
from studies.plain import plain
from studies.specification import Asked, Specification
from studies.text import columns, shown
from workbench.closed_loop import LoopRecord
from workbench.plant import Plant
from workbench.rig import Rig
from workbench.units import public_name, si_unit

MOST_NAMED = 5  # parameters of a worst run in the table; the document has all


@dataclass(frozen=True)
class Verdict:
    """What was found for one line in one scenario: its figure in SI, one for each run."""

    asked: Asked
    scenario: str
    estimator: str
    found: tuple[float, ...]

    @property
    def met(self) -> tuple[bool, ...]:
        """Whether each run meets the line."""
        return tuple(map(self.asked.allows, self.found))

    @property
    def share_met(self) -> float:
        return sum(self.met) / len(self.met)

    @property
    def worst(self) -> int:
        """The run that goes farthest beyond what is asked, or comes nearest to it, from 0."""
        return int(np.argmax([self.asked.excess(value) for value in self.found]))


@dataclass(frozen=True)
class Judged:
    """All verdicts of a check over so many runs: of the rig's own plant, then of drawn ones."""

    rig: Rig
    verdicts: tuple[Verdict, ...]
    runs: int

    @property
    def met(self) -> bool:
        """True when every run meets every line."""
        return all(all(each.met) for each in self.verdicts)

    @property
    def missed(self) -> tuple[str, ...]:
        """The lines that some run does not meet."""
        missed = (each.asked.name for each in self.verdicts if not all(each.met))
        return tuple(dict.fromkeys(missed))

    @property
    def text(self) -> str:
        """One row per line and scenario; with several runs, of the worst, and what it drew."""
        several = self.runs > 1
        end = ("worst", "met by", "worst run") if several else ("found", "met")
        with_estimator = len({each.estimator for each in self.verdicts}) > 1
        head = ("line", "scenario", *(("estimator",) if with_estimator else ()), "asked", *end)
        rows = []
        for each in self.verdicts:
            words = [each.asked.name, each.scenario, *([each.estimator] * with_estimator)]
            words += [each.asked.text, each.asked.shown(each.found[each.worst])]
            if several:
                words += [f"{sum(each.met)} of {len(each.met)}", str(each.worst + 1)]
            else:
                words.append("yes" if each.met[0] else "no")
            rows.append(words)
        worst = sorted({each.worst for each in self.verdicts} if several else ())
        return "\n".join([columns(head, rows), *(self._drawn_text(run) for run in worst)])

    def _drawn_text(self, run: int) -> str:
        """What sets a run apart, in standard deviations, farthest first."""
        if not run:
            return "run 1: the rig's own values"
        drawn = drawn_values(self.rig, drawn_plant(self.rig, run))
        farthest = sorted(drawn.items(), key=lambda item: -abs(item[1][1]))[:MOST_NAMED]
        words = (f"{public_name(n)} {shown(v, n)} ({z:+.1f} sd)" for n, (v, z) in farthest)
        return f"run {run + 1}: " + ", ".join(words)

    @property
    def document(self) -> Document:
        """One entry per line and scenario, in SI."""
        return {
            "in_specification": self.met,
            "specification": [self._entry(each) for each in self.verdicts],
        }

    def _entry(self, each: Verdict) -> Document:
        drawn = drawn_values(self.rig, drawn_plant(self.rig, each.worst))
        parameters = {
            public_name(name): {"value": value, "unit": si_unit(name), "deviations": deviations}
            for name, (value, deviations) in drawn.items()
        }
        return {
            "line": each.asked.name,
            "scenario": each.scenario,
            "estimator": each.estimator or None,
            "asked": {"from": plain(each.asked.least), "to": plain(each.asked.most)},
            "unit": si_unit(each.asked.figure),
            "found": plain(each.found[each.worst]),
            "met": all(each.met),
            "share_met": each.share_met,
            "worst_run": each.worst + 1,
            "worst_parameters": parameters,
            "found_by_run": [plain(value) for value in each.found],
        }


@dataclass(frozen=True)
class Figures:
    """What a specification asks of one loop of a run: the figure by line, none of a lost loop."""

    scenario: str
    estimator: str
    found: Mapping[str, float]


def figures_of(spec: Specification, row: Any, record: LoopRecord) -> Figures:
    """What every line that is judged in the scenario of a loop finds in it."""
    lines = (line for line in spec.asked if row.scenario in line.scenarios)
    found = {line.name: line.found(row, record) for line in lines}
    return Figures(row.scenario, getattr(row, "estimator", ""), found)


def judge(spec: Specification, rig: Rig, runs: Sequence[Sequence[Figures]]) -> Judged:
    """Every line in every scenario that it is judged in, over the runs of a check of one design.

    Parameters
    ----------
    runs
        The loops of each run; each has the same scenarios and estimators, in the same order.
    """
    verdicts = []
    for asked in spec.asked:
        for place, first in enumerate(runs[0]):
            if first.scenario in asked.scenarios:
                values = tuple(run[place].found.get(asked.name, nan) for run in runs)
                verdicts.append(Verdict(asked, first.scenario, first.estimator, values))
    return Judged(rig, tuple(verdicts), len(runs))


def drawn_values(rig: Rig, plant: Plant) -> dict[str, tuple[float, float]]:
    """What a plant has other than the rig: value, and its distance in standard deviations."""
    own = rig.plant.values
    return {
        name: (float(value), (value - own[name]) / rig.standard_deviation(name))
        for name, value in plant.values.items()
        if value != own[name]
    }
