"""Study ``hidden-effects`` at scale: many cases, kept as they are answered, and what they say.

The full grid is everything: single effects, nothing, laws outside the catalogue, pairs, recordings
too weak to tell, and other widths of the priors.  The quick one is a sample of one seed, without
other widths.  Two processes answer; each answer is kept on disk at once, so a second start goes
on where a first one ended, and tells how many answers are of other code.  Visible is a hidden
effect whose own refit removes more than 30 % of the misfit.

``python -m studies.hidden_study --kind law --plant servo_drive`` answers a part of the full grid;
``--alone`` takes the small differences away that every truth has beside what it hides, ``--without
wall_k_per_j`` one of them: walls that warm.

Source: diagnosis.md 5 (test bench).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

from studies.hidden_answers import answered
from studies.hidden_benches import BENCHES
from studies.hidden_claims import outcome
from studies.hidden_effects import Recorded
from studies.hidden_rows import Kind, Row, plain, row_again
from studies.hidden_tasks import (
    SLOW,
    Task,
    alone,
    differences_of,
    recorded,
    tasks,
    without,
)
from studies.kept import Kept
from studies.study import Extent, Outcome, Study
from studies.versions import code_of_loops

PROCESSES = 2
ANSWERS, CODE = "answers.jsonl", "code"

Say = Callable[[str], None]


def run(folder: Path, extent: Extent, say: Say) -> Outcome:
    """Answer what is not answered yet, and tell what all answers say."""
    asked = tasks(extent)
    found = outcome(finished(folder, asked, say), extent)
    return replace(found, text=f"{found.text}\n\n{which_code(folder, asked)}")


def which_code(folder: Path, asked: Sequence[Task]) -> str:
    """How many answers are of other code than this: they take too long to be asked again."""
    kept = Kept(folder / ANSWERS)
    other = sum(kept.rows[task.key].get(CODE) != code_of_loops() for task in asked)
    again = f"; a line that is taken out of {ANSWERS} is asked again" if other else ""
    return f"{other} of {len(asked)} answers are of other code than this{again}"


def finished(
    folder: Path, asked: Sequence[Task], say: Say, processes: int = PROCESSES
) -> list[Row]:
    """A row for every task; what is kept in the folder is not asked again."""
    kept = Kept(folder / ANSWERS)
    groups = []
    for plant in sorted(dict.fromkeys(task.plant for task in asked), key=_slowest_first):
        there = [task for task in asked if task.plant == plant]
        groups.append([task for task in there if task.key not in kept])
        say(f"{plant}: {len(groups[-1])} of {len(there)} cases to answer")
    for task, row in _answers(groups, processes):
        kept.add(task.key, {**plain(row), CODE: code_of_loops()})
        right = "right" if row.right else "WRONG"
        say(f"{task.plant} {row.hidden}:{row.seed} -> {row.first}, {row.verdict}, {right}")
    return [row_again(kept.rows[task.key]) for task in asked]


def _slowest_first(plant: str) -> int:
    """So that no core waits for the last long answer."""
    return 0 if plant == SLOW else 1


def _answers(groups: Sequence[Sequence[Task]], processes: int) -> Iterator[tuple[Task, Row]]:
    """Answers as they come; the tasks of a group are those of one plant."""
    if not any(groups):
        return
    with get_context("spawn").Pool(min(processes, sum(map(len, groups)))) as several:
        yield from several.imap_unordered(_answer, _work(groups))


def _work(groups: Sequence[Sequence[Task]]) -> Iterator[tuple[Task, Recorded]]:
    for group in groups:
        yield from zip(group, recorded(group) if group else (), strict=True)


def _answer(work: tuple[Task, Recorded]) -> tuple[Task, Row]:
    return work[0], answered(*work)


def _asked_for(asked: argparse.Namespace, task: Task) -> bool:
    """True for a task of the kinds, plants, names and seeds that the command line names."""
    return (
        (asked.kind is None or task.kind.value in asked.kind)
        and (asked.plant is None or task.plant in asked.plant)
        and (asked.only is None or task.hidden in asked.only)
        and (asked.seeds is None or task.seed in asked.seeds)
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Answer a part of the full grid; see the module."""
    parser = argparse.ArgumentParser(prog="python -m studies.hidden_study", description=__doc__)
    parser.add_argument("--kind", nargs="+", choices=[kind.value for kind in Kind])
    parser.add_argument("--plant", nargs="+", choices=BENCHES)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="what is hidden")
    parser.add_argument("--seeds", type=int, nargs="+")
    parser.add_argument("--alone", action="store_true", help="no small differences beside it")
    parser.add_argument(
        "--without", nargs="+", metavar="FIELD", help="small differences to leave out"
    )
    parser.add_argument("--processes", type=int, default=PROCESSES)
    parser.add_argument("-o", "--output", type=Path, default=Path("studies_out/hidden-effects"))
    asked = parser.parse_args(arguments)
    part = [task for task in tasks(Extent.FULL) if _asked_for(asked, task)]
    part = [alone(task) for task in part] if asked.alone else part
    if asked.without:
        known = set().union(*map(differences_of, part))
        if unknown := sorted({*asked.without} - known):
            parser.error(f"--without {unknown[0]}: expected some of {', '.join(sorted(known))}")
        part = [without(task, asked.without) for task in part]
    said = outcome(
        finished(asked.output, part, lambda line: print(line, flush=True), asked.processes)
    )
    told = which_code(asked.output, part)
    print(said.text, told, *(f"{claim.claim}: {claim.found}" for claim in said.claims), sep="\n\n")


STUDY = Study(
    name="hidden-effects",
    question="is a hidden effect found in recordings that other code made?",
    source="diagnosis.md 5",
    run=run,
)

if __name__ == "__main__":
    main()
