"""What study ``hidden-effects`` asks: the grid of its cases, and how each is recorded."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

from studies.hidden_benches import BENCHES, SERVO_DRIVE, bench_of
from studies.hidden_effects import Recorded, recordings
from studies.hidden_rows import Kind
from studies.study import Extent
from studies.truth.case import Case
from studies.truth.cases import NOTHING, read_cases
from studies.truth.pairs import PAIRS, Pair, record_pairs, stored_pair
from studies.truth.weak import WEAK, record_weak, stored_weak

QUICK_SEED = 1  # and of it every so many-th task of each plant and kind,
QUICK_EVERY = 5
SLOW = "gearbox"  # of which a diagnosis takes minutes: one
LAW_SEED = 1  # each law once


@dataclass(frozen=True)
class Task:
    """One question: what is hidden, two cases for a pair, and how it is asked."""

    kind: Kind
    cases: tuple[Case, ...]

    @property
    def plant(self) -> str:
        """Name of the plant."""
        return self.cases[0].plant

    @property
    def hidden(self) -> str:
        """What is hidden, in one text."""
        return " + ".join(case.hidden or NOTHING for case in self.cases)

    @property
    def seed(self) -> int:
        """The seed of the case, or of both."""
        return self.cases[0].seed

    @property
    def key(self) -> str:
        """A name that changes with the numbers of the cases, and with a manoeuvre of its own."""
        played = WEAK[self.hidden] if self.kind is Kind.WEAK else ()
        numbers = zlib.crc32(repr((self.cases, played)).encode())
        return f"{self.kind.value}/{self.plant}/{self.hidden}/{self.seed}/{numbers:08x}"


def tasks(extent: Extent) -> list[Task]:
    """Everything that is stored, or a sample of one seed, pairs first, which take longest.

    Other widths in full only.
    """
    if extent is Extent.FULL:
        return [*_single(), *_pairs(), *_weak(), *_widths()]
    groups: dict[tuple[str, Kind], list[Task]] = {}
    for task in (*_pairs(), *_single(), *_weak()):
        if task.seed == QUICK_SEED:
            groups.setdefault((task.plant, task.kind), []).append(task)
    sample = [task for group in groups.values() for task in group[::QUICK_EVERY]]
    slow = [task for task in sample if task.plant == SLOW]
    return [task for task in sample if task not in slow[1:]]


def _single() -> Iterator[Task]:
    for bench in BENCHES.values():
        for case in read_cases(bench.truth.stored).values():
            in_catalogue = case.hidden in bench.truth.hidden
            outside = Kind.LAW if case.hidden else Kind.NOTHING
            kind = Kind.EFFECT if in_catalogue else outside
            if kind is not Kind.LAW or case.seed == LAW_SEED:
                yield Task(kind, (case,))


def _pairs() -> Iterator[Task]:
    for names in PAIRS:
        pair = stored_pair(*names)
        yield Task(Kind.PAIR, (pair.first, pair.second))


def _weak() -> Iterator[Task]:
    for case in stored_weak():
        yield Task(Kind.WEAK, (case,))


def _widths() -> Iterator[Task]:
    """All of the servo drive's effects once more."""
    truth = SERVO_DRIVE.truth
    for case in read_cases(truth.stored).values():
        if case.hidden in truth.hidden:
            yield Task(Kind.WIDTH, (case,))


def alone(task: Task) -> Task:
    """The same question without the small differences that every truth has: what they do to it."""
    return without(task, differences_of(task))


def without(task: Task, fields: Collection[str]) -> Task:
    """The same question without these differences, by the field of the truth that they act on."""
    cases = (
        replace(case, differences=tuple(d for d in case.differences if d.field not in fields))
        for case in task.cases
    )
    return replace(task, cases=tuple(cases))


def differences_of(task: Task) -> set[str]:
    """Fields of the truth on which its small differences act."""
    return {difference.field for case in task.cases for difference in case.differences}


def recorded(asked: Sequence[Task]) -> list[Recorded]:
    """Training and validation recordings of tasks of one plant, in the order of the tasks.

    All that is recorded in one way is made in one batch, and once.
    """
    ordinary = list(dict.fromkeys(t.cases[0] for t in asked if t.kind not in _OWN_WAY))
    made = dict(zip(ordinary, recordings(ordinary), strict=True)) if ordinary else {}
    found = {t: made[t.cases[0]] for t in asked if t.kind not in _OWN_WAY}
    for kind, record in _OWN_WAY.items():
        group = [t for t in asked if t.kind is kind]
        tables = record(group) if group else []
        for task, parts in zip(group, tables, strict=True):
            found[task] = bench_of(task.cases[0]).recorded(f"{task.hidden} {kind.value}", parts)
    return [found[task] for task in asked]


_OWN_WAY = {
    Kind.PAIR: lambda group: record_pairs([Pair(*task.cases) for task in group]),
    Kind.WEAK: lambda group: record_weak([task.cases[0] for task in group]),
}
