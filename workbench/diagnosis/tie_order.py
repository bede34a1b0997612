"""Which of those that do the same to a recording comes first: the one with the likeliest errors.

The drops of a ranking share weights from the errors of the model without any of them.  Where the
missing effect was large these count windows least that show it best, and rivals whose remaining
errors differ by half seem to do the same.  Once each has been settled (see
:mod:`workbench.diagnosis.settle`) its errors are its own, and for errors of unknown size

    -2 log L = n sum over outputs of log(mean square error), trained + held out

with n the recorded values held out over their correlation time, those of the first in the ranking.
Training errors count as if they were as many: they are usually more, but nominal parameters moved
to make them small, those of a wrong effect further than those of the right one.  By what is held
out alone a real seal's dry friction would be one that grows with the pressure, which leaves as
little there and more than half as much again in training.

It orders a tie and decides which three of a crowd are printed; what is tied stays tied, since the
small errors that every model has weigh as much as the difference between two such rivals.

Source: Box and Draper 1965, "The Bayesian estimation of common parameters from several responses"
(their determinant, here of a diagonal covariance); diagnosis.md 1.6.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.diagnosis.judge import LARGEST_TIE
from workbench.diagnosis.result import Ranked
from workbench.effect import Kind
from workbench.fitting.gauss_newton import Fit


def likeliest_first(ranking: tuple[Ranked, ...]) -> tuple[Ranked, ...]:
    """The ranking with those that do the same as its leader in the order of their likelihoods.

    What passes every criterion stays before what does not, effects before shifts of parameters.
    """
    leader = ranking[0]
    names = (leader.candidate.name, *leader.tied_with, *leader.crowd)
    group = [row for row in ranking if row.candidate.name in names]
    if len(group) < 2 or any(row.validation is None for row in group):
        return ranking
    group.sort(
        key=lambda row: (not row.accepted, row.kind is not Kind.EFFECT, surprise(row, leader))
    )
    rest = [row for row in ranking if row.candidate.name not in names]
    return (*_regrouped(group), *rest)


def surprise(row: Ranked, leader: Ranked) -> float:
    """-2 log L of the module's equation up to a constant that rivals share, errors above the noise.

    Raises
    ------
    ValueError
        If one of them was not validated.
    """
    if row.fit is None or row.validation is None or leader.validation is None:
        raise ValueError("the order of a tie needs what each leaves of the recordings held out")
    first = leader.validation.windows
    counted = ((first.weight > 0).sum(axis=2) / first.correlation).sum(axis=1)
    logs = [np.sum(np.log(_mean_squares(fit))) for fit in (row.fit, row.validation)]
    return float(np.mean(counted) * sum(logs))


def _mean_squares(fit: Fit) -> np.ndarray:
    """Mean square error of each output, shape (outputs,), never below its noise."""
    windows = fit.windows
    recorded = (windows.weight > 0).sum(axis=(1, 2))
    squares = ((fit.residual * windows.scale[:, :, None]) ** 2).sum(axis=(1, 2))
    return np.maximum(squares / np.maximum(recorded, 1), windows.noise**2)


def _regrouped(group: list[Ranked]) -> list[Ranked]:
    """Rows of what does the same, with the first three as the printed tie, the others the crowd."""
    names = [row.candidate.name for row in group]
    printed, crowd = names[:LARGEST_TIE], tuple(names[LARGEST_TIE:])
    return [
        replace(
            row,
            tied_with=tuple(n for n in printed if n != name) if name in printed else (),
            crowd=crowd if name == names[0] else (),
        )
        for name, row in zip(names, group, strict=True)
    ]
