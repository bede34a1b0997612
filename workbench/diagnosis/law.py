"""An empirical law for what no effect of the catalogue explains.

The terms of :mod:`workbench.effects.empirical` go through the same projected scan and the same
refit by shooting as every effect (coefficients regressed from a smoothed term would be attenuated),
at most three, one after the other, as long as each takes another tenth of the misfit.  The result
is judged like an effect and labelled empirical.

Source: diagnosis.md 1.9.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.judge import reasons_against
from workbench.diagnosis.refit import Refit, held_out_drop, refit
from workbench.diagnosis.result import Law, LawTerm
from workbench.diagnosis.rough import rough_fit
from workbench.diagnosis.scan import scan
from workbench.fitting.problem import Problem, misfit
from workbench.law_range import seen_in
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig_laws import is_law, law_terms, with_laws

MOST_TERMS = 3
LEAST_TERM_SHARE = 0.10  # of the misfit that another term must take


def empirical_law(problem: Problem, to_beat: float = 0.0) -> Law | None:
    """The law of up to three terms that passes every criterion; None where none does.

    None, too, where the scan of its first term promises less than ``to_beat``, which the scan of
    an effect promised.
    """
    problem = with_terms(problem)
    first = problem
    steps: list[LawTerm] = []
    best: Refit | None = None
    for _ in range(MOST_TERMS):
        found = _next_term(problem, 0.0 if steps else to_beat)
        if not found or found.drop_train * misfit(problem.base) < LEAST_TERM_SHARE * first.misfit:
            break
        counted = _counted_from(first, found)
        if reasons_against(first.base, counted, parameters=len(steps) + 1):
            break
        before = best.validation if best else first.base_validation
        unseen = held_out_drop(before, found.validation)
        steps.append(
            LawTerm(found.candidate, found.fit, found.validation, found.drop_train, unseen)
        )
        best = counted
        # The next term is scanned at this fit, and its drop still counts from the first base.
        problem = replace(problem, added=(*problem.added, found.candidate), base=found.fit)
    if best is None:
        return None
    return _law(best, steps)


def with_terms(problem: Problem) -> Problem:
    """The problem with all empirical terms that its plants have a place for, absent."""
    recordings = problem.base.windows.recordings

    def more(plant: Plant) -> Plant:
        return plant_with_terms(plant, recordings)

    base = problem.base
    fit = replace(base, windows=replace(base.windows, plant=more(base.windows.plant)))
    held_out = problem.base_validation
    if held_out:
        windows = replace(held_out.windows, plant=fit.windows.plant)
        held_out = replace(held_out, windows=windows)
    return replace(problem, whole=more(problem.whole), base=fit, base_validation=held_out)


def plant_with_terms(
    plant: Plant, recordings: Iterable[Recording], names: Iterable[str] = ()
) -> Plant:
    """A plant with empirical terms, absent, around the middles of the recorded strokes.

    All that it has a place for, or the named ones.
    """
    there = {effect.name for effect in plant.effects}
    names = [name for name in (names or law_terms(plant)) if name not in there]
    plant = with_laws(plant, names)
    middles = {
        f"{effect.name}.middle_m": _middle(effect.body, recordings)
        for effect in plant.effects
        if effect.name in names and "middle_m" in effect.parameters()
    }
    return plant.with_values(middles)


def _middle(body: str, recordings: Iterable[Recording]) -> float:
    """Middle of the recorded stroke of a body in m, 0 where no position was recorded."""
    name = f"{body}.position_m"
    values = [r[name] for r in recordings if name in r.channels]
    if not values:
        return 0.0
    low, high = (end([end(v) for v in values]) for end in (np.nanmin, np.nanmax))
    return float((low + high) / 2)


def _next_term(problem: Problem, to_beat: float) -> Refit | None:
    """The refit of the term that the scan puts first, on top of those that are there."""
    at = problem.base
    candidates = problem.whole.candidates.values()
    left = [c for c in candidates if is_law(c.name) and c not in problem.added]
    profiles = scan(problem.whole, at.windows, at.unknowns, at.point, left, at.derivatives)
    if not profiles or profiles[0].drop <= to_beat:
        return None
    return refit(problem, rough_fit(problem, profiles[0]))


def _counted_from(first: Problem, found: Refit) -> Refit:
    """The same refit with its drop in training counted from the problem before any term.

    Its validation is counted from there already: the held-out base stays that of the problem.
    """
    train = (first.base.cost - found.fit.cost) / misfit(first.base)
    return replace(found, drop_train=train)


def _law(best: Refit, steps: list[LawTerm]) -> Law:
    values = best.fit.plant.values
    accepted = [step.candidate for step in steps]
    terms = {c.strength: values[c.strength] for c in accepted}
    text = " and ".join(
        f"a term in {c.cause.drivers[0]} on {c.place} ({c.cause.strength} = {size:.3g})"
        for c, size in zip(accepted, terms.values(), strict=True)
    )
    windows = best.fit.windows
    ranges = seen_in(windows.plant.lean(keep=_members(accepted)), windows.recordings)
    balance = f"{accepted[0].place}.{accepted[0].cause.balance.value}"
    drops = (best.drop_train, best.drop_validation)
    return Law(balance, terms, ranges, *drops, text, tuple(steps), best.fit, best.validation)


def _members(candidates: Iterable[Candidate]) -> list[str]:
    return [candidate.member for candidate in candidates]
