"""The rule that no small difference may hide the hidden effect, for the truth of any plant.

How the misfits of a case are measured is the plant's own affair (`misfit` for the servo drive).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from studies.truth.case import Case, generator, resized, shrink

LARGEST_SHARE = 0.20
VISIBLE = 1.0  # mean squared deviation over noise variance: as large as the noise
ROUNDS = 12


@dataclass(frozen=True)
class Misfit:
    """Misfit of the hidden effect and of each difference, in noise variances."""

    hidden: float
    differences: dict[str, float]


Measure = Callable[[Sequence[Case]], list[Misfit]]
DrawSize = Callable[[str | None, np.random.Generator], float]


def scaled(
    cases: Sequence[Case], measure: Measure, draw_size: DrawSize, rounds: int = ROUNDS
) -> list[Case]:
    """Cases whose hidden effect is visible and whose differences are each below 20 % of it.

    An invisible hidden effect gets a new size; a difference that is too large is halved (misfit
    goes about with the square of the amplitude).  Both change the path, so every changed case is
    measured again until the rule holds.  Null cases are returned as they are.

    Raises RuntimeError if the rule does not hold after `rounds` measurements.
    """
    done = list(cases)
    todo = [i for i, case in enumerate(cases) if case.hidden]
    for _ in range(rounds):
        found = measure([done[i] for i in todo])
        again = []
        for i, misfit in zip(todo, found, strict=True):
            better = corrected(done[i], misfit, draw_size)
            if better != done[i]:
                done[i] = better
                again.append(i)
        todo = again
        if not todo:
            return done
    names = ", ".join(f"{done[i].hidden} seed {done[i].seed}" for i in todo)
    raise RuntimeError(f"truth: {names} do not meet the misfit rule after {rounds} rounds")


def corrected(case: Case, misfit: Misfit, draw_size: DrawSize) -> Case:
    """The case with a new size or smaller differences; the same case if it meets the rule."""
    if misfit.hidden < VISIBLE:
        rng = generator(case.hidden, case.seed, f"size {case.redraws}")
        return resized(case, draw_size(case.hidden, rng))
    factors = halvings(misfit)
    return shrink(case, factors) if factors else case


def halvings(misfit: Misfit) -> dict[str, float]:
    """Factors (powers of a half) of the differences that exceed their share."""
    factors = {}
    for field, value in misfit.differences.items():
        excess = value / max(LARGEST_SHARE * misfit.hidden, 1e-30)
        if excess > 1:
            factors[field] = 0.5 ** int(np.ceil(np.log(excess) / np.log(4)))
    return factors
