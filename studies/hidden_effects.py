"""A case of study ``hidden-effects``: a hidden effect is to be found in foreign recordings.

Every case hides one effect in an independent truth of ``studies/truth``, beside a dozen small
differences that are always there; others hide nothing, or a law that no catalogue has.  The user's
rig lacks the effect.  Right is: the hidden one first, or in a printed tie.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from studies.hidden_benches import bench_of
from studies.truth.case import Case
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.result import Diagnosis, Verdict
from workbench.fitting.windows import MOST_WINDOWS
from workbench.recording import Recording
from workbench.rig import Rig

Recorded = tuple[Recording, Recording]  # training and validation


@dataclass(frozen=True)
class Answer:
    """What a diagnosis said of one case.

    place       rank of the hidden effect, from 1; 0 where nothing of the catalogue was hidden
    """

    case: Case
    diagnosis: Diagnosis
    place: int

    @property
    def named(self) -> str:
        """The candidate that the ranking puts first."""
        return self.diagnosis.ranking[0].candidate.name

    @property
    def in_catalogue(self) -> bool:
        """Whether the hidden effect is one that can be named."""
        return self.case.hidden in bench_of(self.case).truth.hidden

    @property
    def names_a_difference(self) -> bool:
        """Whether it names one of the small differences that every truth of the plant has."""
        if self.diagnosis.verdict not in (Verdict.FOUND, Verdict.TIE):
            return False
        return bench_of(self.case).always_has(self.named)

    @property
    def ties_a_difference(self) -> bool:
        """Whether one of these stands in the printed tie, behind another leader."""
        if self.diagnosis.verdict is not Verdict.TIE:
            return False
        tied = (name.partition("@")[0] for name in self.diagnosis.ranking[0].tied_with)
        return any(name in bench_of(self.case).always_there for name in tied)

    @property
    def beside(self) -> tuple[str, ...]:
        """What the printed tie holds beside what leads; nothing where that is not accepted."""
        leader = self.diagnosis.ranking[0]
        return leader.tied_with if leader.accepted else ()

    @property
    def tied(self) -> bool:
        """Whether the hidden effect leads the ranking or stands in the printed tie."""
        return self.place == 1 or bench_of(self.case).public_name(self.case) in self.beside

    @property
    def right(self) -> bool:
        """Whether the answer passes: see the module."""
        verdict = self.diagnosis.verdict
        if self.case.hidden is None:
            if verdict is Verdict.NOT_IN_CATALOGUE:
                return False
            names = verdict in (Verdict.FOUND, Verdict.TIE)
            return not names or self.names_a_difference or self.ties_a_difference
        if not self.in_catalogue:
            return verdict is Verdict.NOT_IN_CATALOGUE
        return self.tied


def recordings(cases: Iterable[Case]) -> list[Recorded]:
    """Training and validation recordings of one plant's cases, all made in one batch."""
    cases = list(cases)
    (bench,) = {case.plant: bench_of(case) for case in cases}.values()
    tables = bench.truth.record(cases)
    return [bench.recorded(str(case.hidden), two) for case, two in zip(cases, tables, strict=True)]


def answer(
    case: Case,
    train: Recording,
    validation: Recording,
    rig: Rig | None = None,
    most_windows: int = MOST_WINDOWS,
) -> Answer:
    """Diagnose one case, with the rig of its user or another one."""
    rig = rig or bench_of(case).user_rig(case)
    diagnosis = diagnose(rig, [train], [validation], most_windows=most_windows)
    order = [row.candidate.name for row in diagnosis.ranking]
    name = bench_of(case).public_name(case)
    place = order.index(name) + 1 if name in order else 0
    return Answer(case, diagnosis, place)
