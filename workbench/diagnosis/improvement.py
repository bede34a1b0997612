"""What an improvement gives: frozen values that the command line prints and the report draws."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

from workbench.diagnosis.addition import Addition
from workbench.diagnosis.passes import Removal, Swap
from workbench.diagnosis.result import Diagnosis, Law
from workbench.diagnosis.warned import Of
from workbench.fitting.errors import Errors
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.posterior import Moved
from workbench.rig import Rig

CLEARLY_USED = 0.5  # prior deviations of what is tolerated, chosen: beyond it a word is said
SHOWN = 2.0  # deviations from nothing


class Change(Enum):
    """What a step of an improvement did."""

    START = "as it came"
    REFITTED = "parameters refitted"
    ADDED = "added"
    SHIFTED = "another value"
    DROPPED = "dropped"
    SWAPPED = "swapped"
    LAW = "empirical"


class Stage(NamedTuple):
    """One bar of the budget: weighted squared error per sample on both sets after a step."""

    label: str
    train: float
    validation: float
    change: Change = Change.ADDED


class Ahead(NamedTuple):
    """An effect that was tried for one round more: after how many diagnoses, and its outcome."""

    after: int
    name: str
    outcome: str

    @property
    def sentence(self) -> str:
        """All of it in words."""
        return f"one round further with {self.name}: {self.outcome}"


@dataclass(frozen=True)
class Improvement:
    """Rounds of diagnosis and addition, second thoughts, and the rig that they end with.

    Attributes
    ----------
    steps
        What the rounds added, in order, the terms of a law at the end; also what was dropped later.
    kept
        Public names, with places, of what the final rig has more than the first.
    diagnoses
        One for each round, and one more where an effect that a round had refused came in with the
        next one, and where a law was asked for after the second thoughts had changed the model;
        one more where a law left nothing to an effect; the last one accepted nothing, unless the
        user stopped it, no round was left, that one accepts an effect, which is ``left_out``, or
        its law stands in the place of what it accepts.
    ahead
        What was tried for one round more, also in vain.
    removals, swaps
        What the backward and the swap pass found, in order.
    law
        The empirical law that was taken, None without.
    came, before, after
        Errors over windows with free starts on both sets: as the rig came, with its parameters
        refitted and nothing added, and of the rig in the end: as it came where nothing is kept.
    free_before, free_after
        The same over free runs, as the rig came and in the end; empty for a plant without states,
        or where the user stopped them.  Where positions integrate they are no judge: the right
        effect can make them worse until the next one is there.
    parameters
        Before and after with standard deviations, of all that the final fit moved.
    budget
        Errors per sample step by step: the rig as it came, its parameters refitted, then each
        change; where the next diagnosis fits the same model again and lower, that fit's.
    stopped
        True where the user stopped it after at least one finished round.
    used_up
        True where the last round that there is added something: more may be missing.
    left_out
        The effect that the diagnosis before a law accepts, in place of which none was taken.
    fit, validation_fit
        The final fits; those of the first prior fit, which the rig does not take, where nothing is
        kept.
    """

    rig: Rig
    steps: tuple[Addition, ...]
    kept: tuple[str, ...]
    diagnoses: tuple[Diagnosis, ...]
    removals: tuple[Removal, ...]
    swaps: tuple[Swap, ...]
    ahead: tuple[Ahead, ...]
    law: Law | None
    before: Errors
    after: Errors
    free_before: Errors
    free_after: Errors
    parameters: tuple[Moved, ...]
    budget: tuple[Stage, ...]
    stopped: bool
    fit: Fit = field(repr=False)
    validation_fit: Fit | None = field(repr=False)
    came: Errors = field(default_factory=dict)
    used_up: bool = False
    left_out: str = ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the diagnoses warn of, each once; of their models only that of the last one."""
        *earlier, last = self.diagnoses
        kept = [w.text for found in earlier for w in found.warned if w.of is Of.RECORDINGS]
        return tuple(dict.fromkeys((*kept, *last.warnings)))

    def warned_then(self, diagnosis: Diagnosis) -> tuple[str, ...]:
        """What a diagnosis warned of its model alone, which holds no longer; without errors left.

        That errors are left is what the next round was for.
        """
        then = (w.text for w in diagnosis.warned if w.of is Of.MODEL)
        return tuple(text for text in then if text not in self.warnings)

    @property
    def tolerated(self) -> tuple[Moved, ...]:
        """What the final fit clearly uses of what was absent and is no effect that was added.

        Every fit may, and nothing is named for it; but it is in the rig.
        """
        null = {name: known.null for name, known in self.rig.plant.parameters.items()}
        used = (row for row in self.parameters if row.before == null.get(row.name))
        return tuple(row for row in used if row.far > CLEARLY_USED and _shown(row))


def _shown(row: Moved) -> bool:
    """True for what is surely more than nothing."""
    return row.at_bound or abs(row.after - row.before) > SHOWN * row.deviation
