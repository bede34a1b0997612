"""Two effects that only work together: tried where single effects fail.

Where no single candidate passes, the pairs that gain most beyond their better half
(:mod:`workbench.diagnosis.pair_gains`) are fitted from several sizes of both and judged as single
ones are.  A pair pays for the parameters of both and must take twice the least share; each half
must pass the criteria on top of the other alone, as the backward pass will ask again; and what is
left must be clearly less than what the best single one leaves.

Source: diagnosis.md 1.5, 1.6 and 1.10.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf, isnan

from workbench.candidate import Candidate
from workbench.diagnosis.judge import (
    LEAST_SHARE,
    LEAST_TRAINING,
    clearly_less,
    leaves_clearly_less,
    left_held_out,
    predicts,
    reasons_against,
)
from workbench.diagnosis.pair_gains import FACTORS, pair_gains
from workbench.diagnosis.power import needed
from workbench.diagnosis.ranking import grouped, predicts_row, refitted_row
from workbench.diagnosis.refit import Refit, counted_from, refit, refit_from
from workbench.diagnosis.result import Ranked
from workbench.diagnosis.rough import Rough, rough_fit
from workbench.diagnosis.scan import Profile
from workbench.diagnosis.ties import CLOSE_DROP, tie_group
from workbench.fitting.problem import Problem

MOST_PAIRS = 3  # that are fitted
NOT_ALONE = "leaves hardly less than a single effect"

Progress = Callable[[str], None]


def with_pairs(
    problem: Problem,
    ranking: tuple[Ranked, ...],
    profiles: Sequence[Profile],
    progress: Progress,
) -> tuple[Ranked, ...]:
    """The ranking with the pairs that were fitted: those that pass first, others after refits."""
    if not _wanted(problem, ranking):
        return ranking
    best = max((r.drop_train for r in ranking if r.fit and predicts_row(r)), default=0.0)
    begun = _begun(problem, profiles, best, progress)
    scanned = {each.profile.candidate.name: each.profile for each in begun}
    refits = _refits(problem, begun, progress)
    against = {r.candidate.name: _reasons(problem, r, ranking) for r in refits}
    sound = [each for each in refits if not against[each.candidate.name]]
    group = tie_group(problem, sound, scanned) if sound else []
    names = [each.candidate.name for each in group]
    rows = {}
    for each in refits:
        name = each.candidate.name
        own = replace(refitted_row(problem, each), compensable=scanned[name].compensation)
        rows[name] = replace(own, accepted=not against[name], reasons=against[name])
    accepted = grouped([rows[name] for name in names])
    refused = [row for name, row in rows.items() if name not in names]
    followed = [row for row in ranking if row.fit is not None]
    rest = [row for row in ranking if row.fit is None]
    return (*accepted, *followed, *refused, *rest)


def pair_fit(problem: Problem, profiles: Sequence[Profile]) -> Rough:
    """The first fit of two effects together, whatever they gain by that."""
    (asked,) = pair_gains(problem, profiles, least=-inf)
    return _first_fit(problem, asked.profile)


def _first_fit(problem: Problem, profile: Profile) -> Rough:
    """The first fit of a pair, from more and less of each half."""
    return rough_fit(problem, profile, most=len(FACTORS) ** 2)


def _wanted(problem: Problem, ranking: tuple[Ranked, ...]) -> bool:
    """True where single effects fail, and there is misfit that two parameters could earn."""
    leader = ranking[0] if ranking else None
    settled = leader is not None and leader.accepted
    return not settled and needed(problem, 2) < problem.misfit


def _begun(
    problem: Problem, profiles: Sequence[Profile], best: float, progress: Progress
) -> list[Rough]:
    """First fits of pairs, best first, that beat ``best``, the share of the best single effect."""
    gains = pair_gains(problem, profiles, LEAST_SHARE * problem.misfit, MOST_PAIRS)
    if not gains:
        return []
    progress(f"first fits of {len(gains)} pairs")
    least = max(2 * LEAST_TRAINING, best)
    begun = [_first_fit(problem, each.profile) for each in gains]
    begun = sorted((b for b in begun if b.share > least), key=lambda each: -each.share)
    return [each for each in begun if each.share > (1.0 - CLOSE_DROP) * begun[0].share]


def _refits(problem: Problem, begun: Sequence[Rough], progress: Progress) -> list[Refit]:
    """Refits of the most promising pairs, best first."""
    refits = []
    for each in begun:
        progress(f"refit with {each.profile.candidate.name}")
        refits.append(refit(problem, each))
    return sorted(refits, key=lambda each: (not predicts(each), -each.drop_train))


def _reasons(problem: Problem, found: Refit, ranking: Sequence[Ranked]) -> tuple[str, ...]:
    """Why a pair is not accepted, in words; empty where it is."""
    against = reasons_against(problem.base, found)
    if against:
        return against
    singles = [row for row in ranking if row.fit is not None and predicts_row(row)]
    if any(not _leaves_less(found, row) for row in singles):
        return (NOT_ALONE,)
    first, second = found.candidate.singles
    halves = ((first, second), (second, first))
    return tuple(
        f"{one.name} adds too little to {other.name}"
        for one, other in halves
        if _beside(problem, found, one, other)
    )


def _leaves_less(found: Refit, single: Ranked) -> bool:
    """True where a pair leaves a fifth less than a single one, in training and held out."""
    if not leaves_clearly_less(found.drop_train, single.drop_train):
        return False
    held_out = left_held_out(found), left_held_out(single)
    return isnan(found.drop_validation) or clearly_less(*held_out)


def _beside(problem: Problem, found: Refit, one: Candidate, other: Candidate) -> tuple[str, ...]:
    """The criteria that one half fails on top of the other alone, fitted from where the pair is."""
    alone = refit_from(problem, other, found.fit.plant.values, found.fit)
    half = replace(found, candidate=one)
    return reasons_against(alone.fit, counted_from(alone.fit, alone.validation, half))
