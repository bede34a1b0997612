"""What a recording could show: the size from which an effect would be seen if it were there.

An effect of a given size adds D = d'Md to the projected cost, d the change of the residual that it
brings and M the nuisance-free metric of :mod:`workbench.diagnosis.scan`.  It would pass the
criteria of :mod:`workbench.diagnosis.judge` where D is at least a fifth of the misfit that there is
then, D >= s / (1 - s) misfit, and more than its parameters cost in effective samples.  Below that
size "not found" says nothing; an effect that is blind at its typical size cannot be told from this
recording at all.

Source: diagnosis.md 1.4 (power verdict), after the table of modification index and power of Saris,
Satorra and van der Veld 2009.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, isnan, log

from workbench.diagnosis.judge import LEAST_BIC, LEAST_SHARE, LEAST_SIZE, effective_samples
from workbench.diagnosis.result import Ranked
from workbench.diagnosis.scan import Profile
from workbench.fitting.problem import Problem

LARGEST = 100.0  # typical sizes: beyond, no size is
MOST_BLIND = 0.5  # of the candidates: with more, the recording is too weak for a "no"


def needed(problem: Problem, parameters: int) -> float:
    """What an effect must add to the cost to be accepted."""
    base = problem.base
    samples = max(effective_samples(base), 2.0)
    spread = max(base.chi2 / samples, 1e-12)
    cost = spread * (LEAST_BIC + parameters * log(samples))
    return max(LEAST_SHARE / (1.0 - LEAST_SHARE) * problem.misfit, cost)


def visible_from(problem: Problem, profile: Profile) -> float:
    """Smallest size that would be accepted, in typical sizes; infinite where none would.

    However much a recording shows, a size below 3 % of typical is called negligible.
    """
    shown: dict[float, float] = {}
    for trial in profile.trials:  # of several shapes and signs the one that shows most
        shown[trial.size] = max(trial.shown, shown.get(trial.size, 0.0))
    needs = needed(problem, 1 + len(profile.candidate.forms))
    return max(first_size(shown, needs), LEAST_SIZE)


def first_size(shown: Mapping[float, float], needs: float) -> float:
    """The size at which what is shown reaches what is needed: it grows as the square of the size.

    ``shown`` is known at a few sizes.  Below the first that is enough the square law is followed
    down to the size before it, beyond the largest upwards.
    """
    smaller = 0.0
    for size in sorted(shown):
        if shown[size] >= needs:
            return max(size * (needs / shown[size]) ** 0.5, smaller)
        smaller = size
    if not shown.get(smaller, 0.0) > 0.0:
        return inf
    found = smaller * (needs / shown[smaller]) ** 0.5
    return found if found < LARGEST else inf


def too_weak(ranking: Sequence[Ranked]) -> bool:
    """True where most of the candidates are blind, so that finding none of them says little."""
    asked = [row for row in ranking if not isnan(row.visible_from)]
    return sum(row.blind for row in asked) > MOST_BLIND * len(asked)
