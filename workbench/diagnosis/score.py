"""The classical score of each effect: a second look at the ranking of the scan.

With s what the smallest size of an effect does to the residual r, and M the nuisance-free metric of
:mod:`workbench.diagnosis.scan`, an amount a of it changes the cost by

    c(a) - c(0) = 2 a s'Mr + a^2 s'Ms

so that the fall to be expected, the modification index, is (s'Mr)^2 / s'Ms; less where the best
amount lies beyond a bound, and nothing where it has a forbidden sign.  It is linear in the effect,
the scan is exact in it: where the two differ much, the effect is far from linear.

Source: diagnosis.md 1.4; Sorbom 1989, "Model modification".
"""

from __future__ import annotations

from math import isclose

from workbench.diagnosis.scan import Profile, Trial
from workbench.effect import Parameter


def modification_index(profile: Profile, strength: Parameter) -> float:
    """Fall of chi2 that the smallest sizes promise, the best of both signs and of all shapes."""
    smallest = min(trial.size for trial in profile.trials)
    near = (each for each in profile.trials if isclose(each.size, smallest, rel_tol=1e-9))
    return max(_promised(each, strength) for each in near)


def _promised(trial: Trial, strength: Parameter) -> float:
    """The same of one trial, in whose own multiples a is counted: c(0) - c(1) is its drop."""
    slope = trial.drop + trial.shown
    if slope <= 0.0 or trial.shown <= 0.0:
        return 0.0
    null = strength.null or 0.0
    away = trial.values[trial.candidate.strength] - null
    end = strength.upper if away > 0.0 else strength.lower
    amount = min(slope / (2.0 * trial.shown), (end - null) / away)
    return amount * slope - amount**2 * trial.shown
