"""Named effects fitted once more, weighed by the errors that are left with them.

A refit weighs errors as the model without its effect made them.  Its rivals must share these
weights, or their drops could not be compared.  But where the effect was large, windows that show it
best count least, and what the nominal parameters have moved to imitate it stays with them: sizes
come out too small.  With weights of its own the fit goes on to where the effect has its size.  The
leader's size is then looked for beside it too (:mod:`workbench.fitting.resized`).  The drops stay
those of the common weights.

Source: diagnosis.md 1.4 (scales from the residuals of the model itself), repeated as in iteratively
reweighted least squares (Holland and Welsch 1977).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from workbench.candidate import Candidate
from workbench.diagnosis.judge import grows_plainly, reasons_against, size_reasons
from workbench.diagnosis.refit import ITERATIONS, Refit
from workbench.diagnosis.result import Ranked
from workbench.diagnosis.size import Size, sizes
from workbench.fitting.errors import plain_chance, plain_ratio
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.own_errors import weighed_anew
from workbench.fitting.problem import Problem, held_out_fit
from workbench.fitting.resized import resized

ROUNDS = 4
STEADY = 0.02  # of a size, by which the last round may still move it

Found = TypeVar("Found", Refit, Ranked)


def with_settled_sizes(problem: Problem, ranking: tuple[Ranked, ...]) -> tuple[Ranked, ...]:
    """The ranking with its leader and all that do the same settled; the order stays."""
    leader = ranking[0]
    named = {leader.candidate.name, *leader.alike}
    return tuple(
        _settled_row(problem, row, row is leader)
        if row.fit and row.candidate.name in named
        else row
        for row in ranking
    )


def settled(fit: Fit, *added: Candidate) -> Fit:
    """A fit with what was added, repeated with weights of its own errors until its sizes stay."""
    names = tuple(name for all_of in added for each in all_of.singles for name in each.moved)
    before = sizes(fit, names)
    for _ in range(ROUNDS):
        fit = weighed_anew(fit, ITERATIONS)
        now = sizes(fit, names)
        if _steady(before, now):
            break
        before = now
    return fit


def settled_leader(fit: Fit, *added: Candidate) -> Fit:
    """:func:`settled`, and its sizes looked for beside it too."""
    singles = (each for all_of in added for each in all_of.singles)
    moved = tuple(name for each in singles for name in (each.strength, each.held) if name)
    return resized(settled(fit, *added), moved, ITERATIONS)


def settled_refit(problem: Problem, found: Refit) -> Refit:
    """A refit with the fit of :func:`settled_leader`, or as it was; see :func:`_settled_row`."""
    now = with_fit(problem, found, settled_leader(found.fit, found.candidate))
    if now is found or (
        size_reasons(problem.base, now) and not reasons_against(problem.base, found)
    ):
        return found
    return on_its_own_yardstick(now)


def _settled_row(problem: Problem, row: Ranked, leads: bool) -> Ranked:
    """The row with its size settled; as it was where that would no longer pass.

    What was accepted for its size is not to be told with a fit of another.
    """
    now = with_fit(problem, row, (settled_leader if leads else settled)(row.fit, row.candidate))
    if now is row or (row.accepted and size_reasons(problem.base, now)):
        return row
    return on_its_own_yardstick(now) if leads else now


def with_fit(problem: Problem, found: Found, fit: Fit) -> Found:
    """The same found with another fit; as it was where that predicts worse than the base and it.

    What was accepted for predicting better is not to be told with a fit that does not.
    """
    validation = problem.validated(fit)
    now = replace(
        found,
        fit=fit,
        validation=validation,
        plain_validation=plain_ratio(problem.base_validation, validation),
        plain_chance=plain_chance(problem.base_validation, validation),
        size=sizes(fit, tuple(found.size)),
    )
    worse = grows_plainly(now) and now.plain_validation > found.plain_validation
    return found if worse else now


def on_its_own_yardstick(found: Found) -> Found:
    """The same, held-out start states fitted with the weights of its own errors.

    By those of the base, which misses far more, an output that the base could not follow counts for
    nothing, and what is told of the held-out recording would be several times too large there.  The
    judgement stays that of the weights which all share.
    """
    before = found.validation
    if before is None:
        return found
    return replace(found, validation=held_out_fit(before.windows, found.fit, before))


def _steady(before: Mapping[str, Size], now: Mapping[str, Size]) -> bool:
    return all(
        abs(each.value - before[name].value) <= STEADY * abs(each.value)
        for name, each in now.items()
    )
