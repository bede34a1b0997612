"""One scheduled LQ design per joint of a leg, side by side: each joint answers for itself.

A joint's modes hold the others still.  What these do to it by their inertia and weight is left to
its feedback, which sees its own angle, speed and pressures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from controllers.motion import PREVIEW
from controllers.ranges import ranges_of
from controllers.regulator import AxisLqSpec, Regulator, regulator_on
from linearize.modes import HybridModel
from workbench.contracts import Command, Estimate


@dataclass(frozen=True)
class JointRegulators:
    """See the module.  Its memory is that of each regulator; the reference has a row per joint."""

    regulators: tuple[Regulator, ...]
    preview: int = PREVIEW

    @property
    def sample_time_s(self) -> float:
        return self.regulators[0].sample_time_s

    def start(self) -> Command:
        return _together([each.start() for each in self.regulators])

    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        return _together(
            [
                each.step(Command(last.value[k : k + 1], memory), reference[k : k + 1], estimate)
                for k, (each, memory) in enumerate(zip(self.regulators, last.memory, strict=True))
            ]
        )


def joint_regulators(hybrid: HybridModel, spec: AxisLqSpec | None = None) -> JointRegulators:
    """A regulator on the modes of each joint.

    Raises
    ------
    NoGainError
        If the regulator of these weights cannot be computed.
    """
    spec = spec or AxisLqSpec()
    pairs = ranges_of(hybrid.plant)
    return JointRegulators(
        tuple(regulator_on(hybrid, axis, spec.weighed(axis, wide)) for axis, wide in pairs)
    )


def _together(commands: list[Command]) -> Command:
    notes = {f"{k}_{key}": v for k, c in enumerate(commands, 1) for key, v in c.notes.items()}
    if any("fallback" in command.notes for command in commands):
        notes["fallback"] = 1.0
    value = np.concatenate([command.value for command in commands])
    return Command(value, tuple(command.memory for command in commands), notes)
