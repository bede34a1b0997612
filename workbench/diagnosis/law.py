"""An empirical law for what no effect of the catalogue explains.

Of the terms of :mod:`workbench.effects.empirical` a law takes at most three, one after the other,
as long as each takes another tenth of the misfit.  The next one is chosen by
:mod:`workbench.diagnosis.law_choice` and goes through the same projected scan and the same refit by
shooting as every effect; :mod:`workbench.diagnosis.law_seed` reads several at once off the smoothed
missing term.  The result is judged like an effect and labelled empirical.

Source: diagnosis.md 1.9.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import nan

from workbench.candidate import Candidate
from workbench.diagnosis.judge import leaves_clearly_less, reasons_against, share_removed
from workbench.diagnosis.law_choice import worth_scanning
from workbench.diagnosis.law_seed import refitted, seeds
from workbench.diagnosis.law_told import all_there, law_of
from workbench.diagnosis.located import Where
from workbench.diagnosis.refit import (
    Refit,
    counted_from,
    held_out_drop,
    refit,
    refit_shaken,
)
from workbench.diagnosis.result import Law, LawTerm
from workbench.diagnosis.rough import rough_fit
from workbench.diagnosis.scan import Profile, scan
from workbench.fitting.problem import Problem, improved_base, training_drop
from workbench.law_scales import scales
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig_laws import is_law, law_terms, laws_of, with_laws

MOST_TERMS = 3
LEAST_TERM_SHARE = 0.10  # of the misfit that another term must take
LEAST_PROMISE = 0.03  # of the misfit, of the secant of a term on top of others


def empirical_law(
    problem: Problem,
    known: Sequence[Profile],
    to_beat: float = 0.0,
    where: Where | None = None,
) -> Law | None:
    """The law of up to three terms that passes every criterion; None where none does.

    ``known`` are the profiles of the catalogue at the base: what they do is no law.  Nor is it one
    where the scan of its first term promises less than ``to_beat``, which the scan of an effect
    promised.  The missing term of ``where`` is asked for several terms at once
    (:mod:`workbench.diagnosis.law_seed`); they are taken where they leave clearly less.
    """
    problem = with_terms(problem)
    laws = (c for c in problem.whole.candidates.values() if is_law(c.name))
    terms = [each for each in laws if each not in problem.added]
    law = _term_by_term(problem, terms, known, to_beat)
    other = _at_once(problem, terms, where)
    if law is None or other is None:
        return law or other
    return other if leaves_clearly_less(share_removed(other), share_removed(law)) else law


def better_base(problem: Problem, law: Law | None) -> Problem | None:
    """The problem with a better prior fit, where the fit of its law found one; None where not.

    Then the prior fit had stopped early, what the law removes is partly that, and whoever asked
    for it asks again from there.
    """
    return improved_base(problem, [law.fit]) if law else None


def standing(problem: Problem, law: Law | None) -> Law | None:
    """A law that passes every criterion from each prior fit that it leads to as well, or None."""
    better = better_base(problem, law)
    if law is None or better is None:
        return law
    last = law.steps[-1].candidate
    found = Refit(last, law.fit, law.validation, law.terms, nan, nan, nan)
    counted = counted_from(better.base, better.base_validation, found)
    return None if reasons_against(better.base, counted, parameters=len(law.terms)) else law


def _at_once(problem: Problem, terms: Sequence[Candidate], where: Where | None) -> Law | None:
    """The law that the smoothed missing term suggests, as long as each term takes its tenth."""
    best: Law | None = None
    before = problem.base, problem.base_validation
    steps: list[LawTerm] = []
    for count, seed in enumerate(seeds(problem.whole, where, terms, MOST_TERMS), start=1):
        found = refitted(problem, seed)
        fit, held_out = (steps[-1].fit, steps[-1].validation) if steps else before
        drops = training_drop(fit, found.fit), held_out_drop(held_out, found.validation)
        steps.append(LawTerm(found.candidate, found.fit, found.validation, *drops))
        gained = found.drop_train - (best.drop_train if best else 0.0)
        more = count - (len(best.steps) if best else 0)
        sound = not reasons_against(problem.base, found, parameters=count)
        enough = gained >= more * LEAST_TERM_SHARE
        if sound and enough and all_there(found.fit, [step.candidate for step in steps]):
            best = law_of(found, steps)
    return best


def _term_by_term(
    problem: Problem, terms: list[Candidate], known: Sequence[Profile], to_beat: float
) -> Law | None:
    """The law that grows by the term that the windows choose."""
    first, before = problem, problem.base_validation
    steps: list[LawTerm] = []
    best: Law | None = None
    for _ in range(MOST_TERMS):
        # What has a name at the base has none to offer on top of a term that imitates it either.
        terms = [term for term in terms if term not in problem.added]
        least = LEAST_PROMISE * first.misfit if steps else 0.0
        chosen, terms = worth_scanning(problem, terms, () if steps else known, least)
        found = _refitted(problem, chosen, 0.0 if steps else to_beat)
        if not found or found.drop_train * problem.misfit < LEAST_TERM_SHARE * first.misfit:
            break
        counted = counted_from(first.base, first.base_validation, found)
        if reasons_against(first.base, counted, parameters=len(steps) + 1):
            break
        unseen = held_out_drop(before, found.validation)
        steps.append(
            LawTerm(found.candidate, found.fit, found.validation, found.drop_train, unseen)
        )
        before = found.validation
        if all_there(found.fit, [step.candidate for step in steps]):
            best = law_of(counted, steps)
        # The next term is scanned at this fit, and its drop still counts from the first base.
        problem = replace(problem, added=(*problem.added, found.candidate), base=found.fit)
    return best


def with_terms(problem: Problem) -> Problem:
    """The problem with all empirical terms that its plant has a place for, absent."""
    recordings = problem.base.windows.recordings
    return replace(problem, whole=plant_with_terms(problem.whole, recordings))


def plant_with_terms(
    plant: Plant, recordings: Iterable[Recording], names: Iterable[str] = ()
) -> Plant:
    """A plant with empirical terms, absent, in the sizes of the recordings.

    All that it has a place for, or the named ones.
    """
    there = {effect.name for effect in plant.effects}
    names = [name for name in (names or law_terms(plant)) if name not in there]
    plant = with_laws(plant, names)
    new = [law for law in laws_of(plant) if law.name in names]
    return plant.with_values(scales(new, [*recordings]))


def _refitted(problem: Problem, chosen: Sequence[Candidate], to_beat: float) -> Refit | None:
    """The refit of the term that the scan puts first, on top of those that are there."""
    at = problem.base
    profiles = scan(problem.whole, at.windows, at.unknowns, at.point, chosen, at.derivatives)
    if not profiles or profiles[0].drop <= to_beat:
        return None
    return refit_shaken(problem, refit(problem, rough_fit(problem, profiles[0])))
