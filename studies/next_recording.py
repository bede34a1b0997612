"""Study ``next-recording``: whether the recommended recording breaks the tie that asked for it.

The independent truth of a case plays the commands, or follows the reference in its own loop, and
the case is diagnosed again with one training recording more.

``python -m studies.next_recording constant_force:3 sensor_offset:3`` prints each verdict before and
after; a case takes two diagnoses.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

from studies.hidden_benches import SERVO_DRIVE
from studies.hidden_effects import recordings
from studies.truth.case import Case
from studies.truth.cases import read_cases
from studies.truth.record import played
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.result import Diagnosis, NextRecording
from workbench.plant_files import plant_named
from workbench.recording import Recording

POSITION, COMMAND = "slide.position_m", "valve.command_v"


@dataclass(frozen=True)
class Separation:
    """A case before and after the recording that the first diagnosis asked for; None without."""

    case: Case
    before: Diagnosis
    after: Diagnosis | None

    @property
    def asked(self) -> tuple[str, ...]:
        """The rivals of the hidden effect that the recording was to tell it from."""
        rivals = (self.before.ranking[0].candidate.name, *_alike(self.before))
        return tuple(rival for rival in rivals if rival != self._name)

    @property
    def left(self) -> tuple[str, ...]:
        """Those of them that stand beside the hidden effect still, all where it does not pass.

        A longer stroke shows more of what always is there.  Where that leads, the hidden effect
        comes next, and every rival that passes too stands beside it.
        """
        passing = [r for r in self.after.ranking if r.accepted] if self.after else []
        names = [row.candidate.name for row in passing]
        if self._name not in names:
            return self.asked
        if names[0] == self._name:
            return tuple(rival for rival in self.asked if rival in _alike(self.after))
        others = [
            name for name in names[: names.index(self._name)] if not SERVO_DRIVE.always_has(name)
        ]
        return self.asked if others else tuple(r for r in self.asked if r in names)

    @property
    def _name(self) -> str:
        return SERVO_DRIVE.public_name(self.case)


def _alike(found: Diagnosis | None) -> tuple[str, ...]:
    """What the leader of a ranking is not told from."""
    leader = found.ranking[0] if found and found.ranking else None
    return leader.alike if leader else ()


def recorded(case: Case, asked: NextRecording) -> Recording:
    """What the truth of a case records of what was asked for."""
    commands = next(iter(asked.predicted.values()))[COMMAND]
    states = plant_named(SERVO_DRIVE.plant)
    start_m = float(dict(zip(states.state_list, states.initial, strict=True))[POSITION])
    table = played(case, commands, asked.reference.get(POSITION), start_m)
    return SERVO_DRIVE.recording(table, "next recording")


def separate(case: Case, train: Recording, validation: Recording) -> Separation:
    """Diagnose, record what is asked for, and diagnose again."""
    rig = SERVO_DRIVE.user_rig(case)
    before = diagnose(rig, [train], [validation])
    asked = before.next_recording
    if asked is None or not asked.predicted:
        return Separation(case, before, None)
    more = recorded(case, asked)
    return Separation(case, before, diagnose(rig, [train, more], [validation]))


def separation_text(found: Separation) -> str:
    """The verdict before, what was recorded, and the verdict after."""
    asked = found.before.next_recording
    lines = [f"{found.case.hidden} seed {found.case.seed}: {found.before.sentence}"]
    if asked:
        lines.append(f"  {asked.what}; gain {asked.expected_gain:.3g}, alike {asked.alike}")
    if found.after:
        lines.append(f"  after it {found.after.verdict.value}: {found.after.sentence}")
    told, of = len(found.asked) - len(found.left), len(found.asked)
    still = f", not from {', '.join(found.left)}" if found.left else ""
    return "\n".join([*lines, f"  told from {told} of {of} rivals{still}"])


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the separation of stored cases; see the module."""
    parser = argparse.ArgumentParser(prog="python -m studies.next_recording", description=__doc__)
    parser.add_argument("cases", nargs="+", metavar="EFFECT:SEED")
    asked = parser.parse_args(arguments)
    pairs = [(name, int(seed)) for name, _, seed in (each.partition(":") for each in asked.cases)]
    cases = [read_cases()[pair] for pair in pairs]
    for case, (train, validation) in zip(cases, recordings(cases), strict=True):
        print(separation_text(separate(case, train, validation)), flush=True)


if __name__ == "__main__":
    main()
