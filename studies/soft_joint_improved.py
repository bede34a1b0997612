"""What ``improve`` makes of the soft joint's models on records whose spool sticks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from studies.soft_joint_fits import Data
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


def improved(name: str, data: Data, say: Callable[[str], None]) -> Improved:
    """Improve the plant of that name on the training record, held against the other one."""
    found = improve(default_rig(name), [data.training], [data.other], say)
    words = " ".join(diagnosis.sentence for diagnosis in found.diagnoses)
    values = {key: float(value) for key, value in found.rig.plant.values.items()}
    return Improved(list(found.kept), words, values)
