"""What is told of an empirical law: coefficients, ranges, and the errors that are left with it.

A law is found, judged and measured by the weights of the model without it, as every refit is.  Told
it is like an effect that leads (:mod:`workbench.diagnosis.settle`): each of its terms, with those
before it, fitted on by its own errors, and held-out start states on that yardstick too.  The shares
stay those of the common weights.

Source: diagnosis.md 1.9, 1.4.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import nan

from workbench.candidate import Candidate
from workbench.diagnosis.refit import Refit, counted_from
from workbench.diagnosis.result import Law, LawTerm
from workbench.diagnosis.settle import on_its_own_yardstick, settled_leader, with_fit
from workbench.diagnosis.size import Size, distinct, sizes
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.problem import Problem
from workbench.law_range import seen_in
from workbench.linkage import JointRod
from workbench.plant import Plant
from workbench.units import display_scale, display_unit


def law_of(found: Refit, steps: Sequence[LawTerm]) -> Law:
    """The law of some terms, as the refit with all of them has it."""
    accepted = [step.candidate for step in steps]
    terms = sizes_of(found.fit, accepted)
    windows = found.fit.windows
    plant = windows.plant.lean(keep=[term.member for term in accepted])
    ranges = seen_in(plant, windows.recordings)
    drops = (found.drop_train, found.drop_validation)
    told = _text(accepted, terms.values())
    balances = _balances(windows.plant, accepted)
    return Law(balances, terms, ranges, *drops, told, tuple(steps), found.fit, found.validation)


def _balances(plant: Plant, terms: Iterable[Candidate]) -> tuple[str, ...]:
    """Those of the terms, as plants name them: a force on a rod is in the balance of its joint."""
    joints = {part.name: part.joint for part in plant.parts if isinstance(part, JointRod)}
    at = ((joints.get(c.place or "", c.place), c.cause.balance.value) for c in terms)
    return tuple(dict.fromkeys(f"{place}.{balance}" for place, balance in at))


def settled_law(problem: Problem, law: Law) -> Law:
    """The law and every term on the way to it, as their own errors weigh them.

    A term stays as it was where that would predict worse, or leave one that is not distinct from
    none.
    """
    steps = [_settled_step(problem, law.steps[:count]) for count in range(1, len(law.steps) + 1)]
    last, accepted = steps[-1], [step.candidate for step in steps]
    terms = sizes_of(last.fit, accepted)
    return replace(
        law,
        terms=terms,
        text=_text(accepted, terms.values()),
        steps=tuple(steps),
        fit=last.fit,
        validation=last.validation,
    )


def sizes_of(fit: Fit, terms: Iterable[Candidate]) -> dict[str, Size]:
    """The coefficients of terms in a fit, by full parameter name."""
    return sizes(fit, tuple(term.strength for term in terms))


def all_there(fit: Fit, terms: Iterable[Candidate]) -> bool:
    """True where each term is distinct from none: one that is not only bends what others do."""
    return all(map(distinct, sizes_of(fit, terms).values()))


def _settled_step(problem: Problem, steps: Sequence[LawTerm]) -> LawTerm:
    """The last of some terms that were fitted together."""
    last, terms = steps[-1], [step.candidate for step in steps]
    there = sizes_of(last.fit, terms)
    found = Refit(last.candidate, last.fit, last.validation, there, nan, nan, nan)
    found = counted_from(problem.base, problem.base_validation, found)
    now = with_fit(problem, found, settled_leader(last.fit, *terms))
    if now is found or (all_there(last.fit, terms) and not all_there(now.fit, terms)):
        return last
    now = on_its_own_yardstick(now)
    return replace(last, fit=now.fit, validation=now.validation)


def _text(accepted: Sequence[Candidate], found: Iterable[Size]) -> str:
    """The terms in words."""
    return " and ".join(
        f"a term in {c.cause.drivers[0]} on {c.place} of {_spoken(c.strength, size)}"
        for c, size in zip(accepted, found, strict=True)
    )


def _spoken(name: str, size: Size) -> str:
    """A coefficient with its unit and its deviation."""
    per = 1.0 / display_scale(name).factor
    return f"{per * size.value:.3g} ± {per * size.deviation:.2g} {display_unit(name)}"
