"""Which of those that do the same to a recording leads: one whose errors are smaller throughout.

The drops of a ranking share weights from the errors of the model without any of them.  Where the
missing effect was large these count windows least that show it best, and rivals whose remaining
errors differ by half seem to do the same.  Once each has been settled (see
:mod:`workbench.diagnosis.settle`) its errors are its own.  For errors of unknown size

    -2 log L / n = sum over outputs of log(mean square error)

with n the recorded values of an output; compared is the mean over the outputs.  A rival takes the
leader's place where it is likelier in training, and held out so much likelier that it leaves a
tenth less in every output, as their geometric mean.  Both sets have to say so: held out alone a
real seal's dry friction would be one that grows with the pressure, by as much as chance gives, and
in training another seal's would.

What is tied stays tied: the small errors that every model has weigh as much as the difference
between two such rivals.

Source: Box and Draper 1965, "The Bayesian estimation of common parameters from several responses"
(their determinant, here of a diagonal covariance); diagnosis.md 1.6.
"""

from __future__ import annotations

from math import log

import numpy as np

from workbench.diagnosis.ranking import grouped
from workbench.diagnosis.result import Ranked
from workbench.effect import Kind
from workbench.fitting.errors import penalised_rmse
from workbench.fitting.gauss_newton import Fit

CLEARLY_LIKELIER = -log(0.9)  # a tenth of the mean square held out


def dominant_first(ranking: tuple[Ranked, ...]) -> tuple[Ranked, ...]:
    """The ranking, led by the one of those that do the same that no other dominates.

    What passes every criterion gives way to nothing that does not, and no effect to a shift of a
    parameter.
    """
    leader = ranking[0]
    names = (leader.candidate.name, *leader.tied_with, *leader.crowd)
    group = [row for row in ranking if row.candidate.name in names]
    first = _undominated(group)
    if first is leader:
        return ranking
    rest = [row for row in ranking if row.candidate.name not in names]
    return (*grouped([first, *(row for row in group if row is not first)]), *rest)


def dominates(row: Ranked, other: Ranked) -> bool:
    """True where a row is likelier than another in training, and clearly so held out.

    Never where one of them was not refitted or not validated.
    """
    fits = (row.fit, row.validation, other.fit, other.validation)
    if any(fit is None for fit in fits):
        return False
    trained, held_out, trained_other, held_out_other = map(_unlikely, fits)
    return trained < trained_other and held_out < held_out_other - CLEARLY_LIKELIER


def _undominated(group: list[Ranked]) -> Ranked:
    """The first of a group, or what dominates it, and so on; each leaves less held out."""
    first = group[0]
    sound = [row for row in group if row.accepted and row.kind is Kind.EFFECT]
    while better := [row for row in sound if dominates(row, first)]:
        first = min(better, key=lambda row: _unlikely(row.validation))
    return first


def _unlikely(fit: Fit) -> float:
    """The equation of the module as the mean over outputs, none of them below its noise."""
    return float(2.0 * np.mean(np.log(np.maximum(penalised_rmse(fit), fit.windows.noise))))
