"""What ``improve`` makes of the soft joint's models on records of the bellows that sticks.

On the record of the event alone a wider overlap explains nearly all that the stuck spool does, and
the backward pass takes the right effect out again; so the models are improved on manoeuvres that a
person would record for a diagnosis, with slow ramps through the centre.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from studies.soft_joint_fits import recording
from studies.truth.soft_joint_event import diagnosis_records
from workbench.diagnosis.improve import improve
from workbench.plant import Plant
from workbench.plants import PLANTS
from workbench.rig import default_rig

STUCK = "valve_stuck_band"


@dataclass(frozen=True)
class Improved:
    """What was added, in words, and the values that the model ends with.

    kept        public names of the effects that were added
    sentence    what the rounds said
    values      all parameter values by ``part.parameter_unit``
    """

    kept: list[str]
    sentence: str
    values: dict[str, float]

    def plant(self, name: str) -> Plant:
        """The improved plant."""
        return PLANTS[name]().with_values(self.values).lean()


def improved(name: str, say: Callable[[str], None]) -> Improved:
    """Improve the plant of that name on a training record, held against another manoeuvre."""
    names = ("training", "validation")
    train, other = map(recording, diagnosis_records(), names)
    found = improve(default_rig(name), [train], [other], say)
    words = " ".join(f"{diagnosis.sentence}." for diagnosis in found.diagnoses)
    values = {key: float(value) for key, value in found.rig.plant.values.items()}
    return Improved(list(found.kept), words, values)
