"""Study ``hidden-effects``: a hidden effect is to be found in recordings that other code made.

Every case hides one effect in the independent truth of ``studies/truth``, beside a dozen small
differences that are always there; one case hides nothing, one hides a law that no catalogue has.
The user's rig lacks the effect.  Right is: the hidden one first, or in a printed tie.

``python -m studies.hidden_effects 1 2 3`` prints the confusion matrix of three seeds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from studies.truth.cases import read_cases
from studies.truth.draw import HIDDEN, Case
from studies.truth.record import record
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.result import Diagnosis, Verdict
from workbench.recording import Recording
from workbench.rig import Rig, default_rig

PLANT = "servo_drive"
CHANNELS = {
    "command_V": ("valve.command_v", 1.0),
    "position_mm": ("slide.position_m", 1e-3),
    "pressure_a_bar": ("chamber_a.pressure_pa", 1e5),
    "pressure_b_bar": ("chamber_b.pressure_pa", 1e5),
    "supply_bar": ("supply.pressure_pa", 1e5),
}
# Small differences that every truth has and the catalogue can name: a second-order valve, lags in
# the pressure sensors, and friction that varies along the stroke.
ALWAYS_THERE = ("valve_lag", "command_delay", "sensor_lag", "friction_position")
PLACES = {
    "chamber_leak": "chamber_leak@chamber_a",
    "sensor_offset": "sensor_offset@chamber_a.pressure",
}


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
    def right(self) -> bool:
        """Whether the answer passes: see the module."""
        verdict = self.diagnosis.verdict
        if self.case.hidden is None:
            silent = verdict in (Verdict.NOTHING_MISSING, Verdict.SMALL_PROXY)
            names = verdict in (Verdict.FOUND, Verdict.TIE)
            return silent or (names and self.named.partition("@")[0] in ALWAYS_THERE)
        if self.case.hidden not in HIDDEN:
            return verdict is Verdict.NOT_IN_CATALOGUE
        return self.tied


def public_name(case: Case) -> str | None:
    """The hidden effect as the catalogue names it; None where it is not in there."""
    return PLACES.get(case.hidden, case.hidden) if case.hidden in HIDDEN else None


def user_rig(case: Case) -> Rig:
    """The rig of a user who does not know of the hidden effect."""
    rig = default_rig(PLANT)
    name = public_name(case)
    if name is None:
        return rig
    candidate = rig.plant.candidates[name]
    return replace(rig, plant=rig.plant.at_null(candidate), removed=(name,))


def recordings(cases: Iterable[Case]) -> list[tuple[Recording, Recording]]:
    """Training and validation recordings, all made in one batch."""
    cases = list(cases)
    pairs = record(cases)
    return [
        (
            recording_of(train, f"{case.hidden} training"),
            recording_of(held_out, f"{case.hidden} other"),
        )
        for case, (train, held_out) in zip(cases, pairs, strict=True)
    ]


def answer(case: Case, train: Recording, validation: Recording) -> Answer:
    """Diagnose one case."""
    diagnosis = diagnose(user_rig(case), [train], [validation])
    order = [row.candidate.name for row in diagnosis.ranking]
    name = public_name(case)
    place = order.index(name) + 1 if name in order else 0
    leader = diagnosis.ranking[0]
    printed = diagnosis.verdict is Verdict.TIE and name in leader.tied_with
    tied = place == 1 or printed
    return Answer(case, diagnosis, place, tied)


def answers(
    seeds: Iterable[int], show: Callable[[Answer], None] = lambda found: None
) -> list[Answer]:
    """Every stored case of these seeds."""
    chosen = [case for (_, seed), case in read_cases().items() if seed in set(seeds)]
    found = []
    for case, (train, held_out) in zip(chosen, recordings(chosen), strict=True):
        found.append(answer(case, train, held_out))
        show(found[-1])
    return found


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
    hidden = [each for each in found if each.case.hidden in HIDDEN]
    naming = (Verdict.FOUND, Verdict.TIE)
    first = sum(each.place == 1 for each in hidden)
    named = sum(each.tied and each.diagnosis.verdict in naming for each in hidden)
    return (
        f"{first} of {len(hidden)} first, {sum(each.tied for each in hidden)} first or in the tie, "
        f"{named} with a verdict that says so"
    )


def recording_of(table: Mapping[str, np.ndarray], name: str) -> Recording:
    """A table of the truth as a recording in SI."""
    channels = {
        public: np.asarray(table[column]) * factor
        for column, (public, factor) in CHANNELS.items()
        if column in table
    }
    return Recording(name, 1e-3, channels, source="studies/truth")


if __name__ == "__main__":
    import sys

    def show(found: Answer) -> None:
        print(confusion([found]).splitlines()[1], flush=True)

    said = answers([int(seed) for seed in sys.argv[1:]] or [1], show)
    print(confusion(said), summary(said), sep="\n\n")
