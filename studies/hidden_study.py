"""Study ``hidden-effects`` at scale: many cases, kept as they are answered, and what they say.

The quick grid is one seed of every plant, the full one every stored case.  Two processes answer
cases; each answer is kept on disk at once, so a second start goes on where a first one ended.
Visible is a hidden effect whose own refit removes more than 30 % of the misfit.

Source: diagnosis.md 5 (test bench).
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from multiprocessing import get_context
from pathlib import Path
from time import monotonic
from typing import Any

from studies.figures.confusion import confusion_figure
from studies.hidden_benches import BENCHES, Bench, bench_of
from studies.hidden_effects import Answer, answer, recordings
from studies.kept import Kept
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns
from studies.truth.case import Case
from studies.truth.cases import read_cases
from workbench.diagnosis.result import Verdict
from workbench.recording import Recording

PROCESSES = 2
QUICK_SEEDS = (1,)
VISIBLE = 0.30  # of the misfit, removed by the refit with the hidden effect itself
STRONG = 0.60  # the same for an effect whose size is to be right
ANSWERS = "answers.jsonl"

Pair = tuple[Recording, Recording]


@dataclass(frozen=True)
class Row:
    """One answer in plain numbers.

    kind        "effect", "nothing" or "law": what was hidden
    first       what the ranking puts first, and ``found`` its size
    place       rank of the hidden effect from 1, 0 where there is none
    own_drop    share of the misfit that the refit with the hidden effect removes, NaN without
    """

    plant: str
    hidden: str
    seed: int
    kind: str
    size: float
    first: str
    found: float
    verdict: str
    place: int
    tied: bool
    right: bool
    own_drop: float
    seconds: float

    @property
    def visible(self) -> bool:
        """True where the hidden effect can be seen."""
        return self.kind == "effect" and self.own_drop > VISIBLE


def row_of(said: Answer, seconds: float) -> Row:
    """The plain numbers of an answer."""
    case, ranking = said.case, said.diagnosis.ranking
    name = bench_of(case).public_name(case)
    own = next((r for r in ranking if r.candidate.name == name and r.fit is not None), None)
    leader = ranking[0]
    kind = "effect" if said.in_catalogue else "law" if case.hidden else "nothing"
    return Row(
        plant=case.plant,
        hidden=case.hidden or "nothing",
        seed=case.seed,
        kind=kind,
        size=case.size,
        first=said.named,
        found=next((s.value for s in leader.size.values()), float("nan")),
        verdict=said.diagnosis.verdict.value,
        place=said.place,
        tied=said.tied,
        right=said.right,
        own_drop=own.drop_train if own else float("nan"),
        seconds=seconds,
    )


def key(case: Case) -> str:
    """Name of a case that changes with its numbers."""
    numbers = zlib.crc32(repr(case).encode())
    return f"{case.plant}/{case.hidden or 'nothing'}/{case.seed}/{numbers:08x}"


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Answer what is not answered yet, and tell what all answers say."""
    kept = Kept(folder / ANSWERS)
    rows: list[Row] = []
    for bench in BENCHES.values():
        cases = _cases(bench, extent)
        left = [case for case in cases if key(case) not in kept]
        say(f"{bench.plant}: {len(left)} of {len(cases)} cases to answer")
        for case, row in _answered(left):
            kept.add(key(case), asdict(row))
            say(f"{bench.plant} {row.hidden}:{row.seed} -> {row.first}, {row.verdict}")
        rows += [_row(kept.rows[key(case)]) for case in cases]
    return outcome(rows)


def _cases(bench: Bench, extent: Extent) -> list[Case]:
    stored = read_cases(bench.truth.stored).values()
    return [c for c in stored if extent is Extent.FULL or c.seed in QUICK_SEEDS]


def _row(kept: dict[str, Any]) -> Row:
    return Row(**{name: value for name, value in kept.items() if name != "key"})


def _answered(cases: Sequence[Case]) -> Iterator[tuple[Case, Row]]:
    """Answers as they come; the recordings of all cases are made in one batch."""
    if not cases:
        return
    tasks = list(zip(cases, recordings(cases), strict=True))
    with get_context("spawn").Pool(min(PROCESSES, len(tasks))) as several:
        yield from several.imap_unordered(_answer, tasks)


def _answer(task: tuple[Case, Pair]) -> tuple[Case, Row]:
    case, (train, held_out) = task
    begun = monotonic()
    said = answer(case, train, held_out)
    return case, row_of(said, monotonic() - begun)


def outcome(rows: Sequence[Row]) -> Outcome:
    """Table, claims and figures of some answers."""
    plants = dict.fromkeys(row.plant for row in rows)
    figures = {
        f"confusion_{plant}": confusion_figure(
            plant.replace("_", " "),
            [(r.hidden, r.first, r.right) for r in rows if r.plant == plant],
        )
        for plant in plants
    }
    claims = tuple(_claims(rows))
    text = "\n\n".join((table(rows), *(f"{c.claim}: {c.found}" for c in claims)))
    return Outcome(text, claims, figures, {"rows": [_plain(row) for row in rows]})


def table(rows: Sequence[Row]) -> str:
    """One line for each answer."""
    head = ("plant", "hidden", "seed", "size", "first in ranking", "found", "verdict", "rank",
            "own drop", "right", "s")  # fmt: skip
    return columns(
        head,
        [
            (
                row.plant,
                row.hidden,
                str(row.seed),
                f"{row.size:.3g}",
                row.first,
                f"{row.found:.3g}",
                row.verdict,
                str(row.place or "-"),
                f"{row.own_drop:.0%}" if isfinite(row.own_drop) else "-",
                "yes" if row.right else "NO",
                f"{row.seconds:.0f}",
            )
            for row in rows
        ],
    )


def _claims(rows: Sequence[Row]) -> Iterator[Claim]:
    """The bar of the issue, group by group; a group that was not run claims nothing."""
    visible = [r for r in rows if r.visible]
    effects = [r for r in rows if r.kind == "effect"]
    named = [r for r in effects if r.verdict in (Verdict.FOUND.value, Verdict.TIE.value)]
    yield from _share("visible effects first", [r.place == 1 for r in visible], 0.90)
    yield from _share("visible effects first or tied", [r.tied for r in visible], 0.97)
    yield from _share("visible effects in the top three", [r.place <= 3 for r in visible], 1.0)
    yield from _share("all effects first", [r.place == 1 for r in effects], 0.75)
    yield from _share("right of those with found or tie", [r.tied for r in named], 0.97)
    strong = [r for r in effects if r.own_drop > STRONG and r.place == 1]
    close = [abs(r.found / r.size - 1.0) <= 0.10 for r in strong]
    yield from _share("size of strong effects within 10 %", close, 0.90)
    yield from _share("no false name", [r.right for r in rows if r.kind == "nothing"], 1.0)
    yield from _share("laws called outside", [r.right for r in rows if r.kind == "law"], 5 / 6)


def _share(what: str, holds: Sequence[bool], least: float) -> Iterator[Claim]:
    if holds:
        share = sum(holds) / len(holds)
        found = f"{sum(holds)} of {len(holds)} ({share:.0%})"
        yield Claim(f"{what}, at least {least:.0%}", found, share >= least)


def _plain(row: Row) -> dict[str, Any]:
    """JSON knows no NaN."""
    return {
        name: None if isinstance(value, float) and not isfinite(value) else value
        for name, value in asdict(row).items()
    }


STUDY = Study(
    name="hidden-effects",
    question="is a hidden effect found in recordings that other code made?",
    source="diagnosis.md 5",
    run=run,
)
