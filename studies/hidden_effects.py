"""Study ``hidden-effects``: a hidden effect is to be found in recordings that other code made.

Every case hides one effect in an independent truth of ``studies/truth``, beside a dozen small
differences that are always there; one case hides nothing, one hides a law that no catalogue has.
The user's rig lacks the effect.  Right is: the hidden one first, or in a printed tie.

``python -m studies.hidden_effects 1 2 3`` prints the confusion matrix of three seeds on the servo
drive, with ``--plant crr_rig`` on another plant.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass

from studies.hidden_benches import BENCHES, SERVO_DRIVE, Bench, bench_of
from studies.truth.case import Case
from studies.truth.cases import read_cases
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.result import Diagnosis, Verdict
from workbench.recording import Recording


@dataclass(frozen=True)
class Answer:
    """What a diagnosis said of one case.

    place       rank of the hidden effect, from 1; 0 where nothing of the catalogue was hidden
    tied        the hidden effect leads the ranking or stands in the printed tie
    """

    case: Case
    diagnosis: Diagnosis
    place: int
    tied: bool

    @property
    def named(self) -> str:
        """The candidate that the ranking puts first."""
        return self.diagnosis.ranking[0].candidate.name

    @property
    def in_catalogue(self) -> bool:
        """Whether the hidden effect is one that can be named."""
        return self.case.hidden in bench_of(self.case).truth.hidden

    @property
    def right(self) -> bool:
        """Whether the answer passes: see the module."""
        verdict = self.diagnosis.verdict
        if self.case.hidden is None:
            silent = verdict in (Verdict.NOTHING_MISSING, Verdict.SMALL_PROXY)
            names = verdict in (Verdict.FOUND, Verdict.TIE)
            small = bench_of(self.case).always_there
            return silent or (names and self.named.partition("@")[0] in small)
        if not self.in_catalogue:
            return verdict is Verdict.NOT_IN_CATALOGUE
        return self.tied


def recordings(cases: Iterable[Case]) -> list[tuple[Recording, Recording]]:
    """Training and validation recordings of one plant's cases, all made in one batch."""
    cases = list(cases)
    (bench,) = {case.plant: bench_of(case) for case in cases}.values()
    pairs = bench.truth.record(cases)
    return [
        (
            bench.recording(train, f"{case.hidden} training"),
            bench.recording(held_out, f"{case.hidden} other"),
        )
        for case, (train, held_out) in zip(cases, pairs, strict=True)
    ]


def answer(case: Case, train: Recording, validation: Recording) -> Answer:
    """Diagnose one case."""
    diagnosis = diagnose(bench_of(case).user_rig(case), [train], [validation])
    order = [row.candidate.name for row in diagnosis.ranking]
    name = bench_of(case).public_name(case)
    place = order.index(name) + 1 if name in order else 0
    leader = diagnosis.ranking[0]
    printed = diagnosis.verdict is Verdict.TIE and name in leader.tied_with
    tied = place == 1 or printed
    return Answer(case, diagnosis, place, tied)


def answers(
    cases: Sequence[Case], show: Callable[[Answer], None] = lambda found: None
) -> list[Answer]:
    """Diagnose some cases of one plant."""
    found = []
    for case, (train, held_out) in zip(cases, recordings(cases), strict=True):
        found.append(answer(case, train, held_out))
        show(found[-1])
    return found


def stored(bench: Bench, seeds: Collection[int], only: Collection[str] | None = None) -> list[Case]:
    """The stored cases of these seeds, of all effects or of some."""
    return [
        case
        for (hidden, seed), case in read_cases(bench.truth.stored).items()
        if seed in seeds and (only is None or (hidden or "nothing") in only)
    ]


def confusion(found: Iterable[Answer]) -> str:
    """One line per case: hidden, size, what was named, verdict, rank, drop, right or not."""
    head = f"{'hidden':<22}{'seed':>5}{'size':>11}  {'first in ranking':<34}{'found':>11}  "
    lines = [head + f"{'verdict':<18}{'rank':>5}{'drop':>7}  right"]
    for each in found:
        leader = each.diagnosis.ranking[0]
        size = next((s.value for s in leader.size.values()), float("nan"))
        lines.append(
            f"{each.case.hidden or 'nothing':<22}{each.case.seed:>5}{each.case.size:>11.3g}  "
            f"{each.named:<34}{size:>11.3g}  {each.diagnosis.verdict.value:<18}{each.place:>5}"
            f"{leader.drop_train:>7.2f}  {'yes' if each.right else 'NO'}"
        )
    return "\n".join(lines)


def summary(found: Iterable[Answer]) -> str:
    """How many hidden effects of the catalogue lead, lead or tie, and are named by the verdict."""
    hidden = [each for each in found if each.in_catalogue]
    naming = (Verdict.FOUND, Verdict.TIE)
    first = sum(each.place == 1 for each in hidden)
    named = sum(each.tied and each.diagnosis.verdict in naming for each in hidden)
    return (
        f"{first} of {len(hidden)} first, {sum(each.tied for each in hidden)} first or in the tie, "
        f"{named} with a verdict that says so"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Answer the stored cases of some seeds; see the module."""
    parser = argparse.ArgumentParser(prog="python -m studies.hidden_effects", description=__doc__)
    parser.add_argument("--plant", choices=BENCHES, default=SERVO_DRIVE.plant)
    parser.add_argument("--only", nargs="+", metavar="EFFECT", help="instead of every effect")
    parser.add_argument("seeds", type=int, nargs="*", default=[1])
    asked = parser.parse_args(arguments)

    def show(found: Answer) -> None:
        print(confusion([found]).splitlines()[1], flush=True)

    said = answers(stored(BENCHES[asked.plant], asked.seeds, asked.only), show)
    print(confusion(said), summary(said), sep="\n\n")


if __name__ == "__main__":
    main()
