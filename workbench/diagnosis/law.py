"""An empirical law for what no effect of the catalogue explains.

The terms of :mod:`workbench.effects.empirical` go through the same projected scan and the same
refit by shooting as every effect (coefficients regressed from a smoothed term would be attenuated),
at most three, one after the other, as long as each takes another tenth of the misfit.  The result
is judged like an effect and labelled empirical.

Source: diagnosis.md 1.9.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.diagnosis.judge import reasons_against
from workbench.diagnosis.refit import Refit, refit
from workbench.diagnosis.result import Law
from workbench.diagnosis.rough import rough_fit
from workbench.diagnosis.scan import scan
from workbench.effects.empirical import EmpiricalFlow, EmpiricalForce
from workbench.fitting.problem import Problem, misfit
from workbench.parts import Body, Chamber
from workbench.plant import Candidate, Plant

MOST_TERMS = 3
LEAST_TERM_SHARE = 0.10  # of the misfit that another term must take


def empirical_law(problem: Problem, to_beat: float = 0.0) -> Law | None:
    """The law of up to three terms that passes every criterion; None where none does.

    None, too, where the scan of its first term promises less than ``to_beat``, which the scan of
    an effect promised.
    """
    problem = _with_terms(problem)
    first = problem
    accepted: list[Candidate] = []
    best: Refit | None = None
    for _ in range(MOST_TERMS):
        found = _next_term(problem, accepted, 0.0 if accepted else to_beat)
        if not found or found.drop_train * misfit(problem.base) < LEAST_TERM_SHARE * first.misfit:
            break
        counted = _counted_from(first, found)
        if reasons_against(first.base, counted, parameters=len(accepted) + 1):
            break
        best = counted
        accepted.append(found.candidate)
        # The next term is scanned at this fit, and its drop still counts from the first base.
        problem = replace(problem, added=(*problem.added, found.candidate), base=found.fit)
    if best is None:
        return None
    return _law(problem, best, accepted)


def _with_terms(problem: Problem) -> Problem:
    """The problem with all empirical terms at null in its plants."""
    bodies = [p for p in problem.whole.parts if isinstance(p, Body)]
    chambers = [p for p in problem.whole.parts if isinstance(p, Chamber)]
    terms = [
        EmpiricalForce(name=f"law@{body.name}", body=body.name, middle_m=_middle(problem, body))
        for body in bodies
    ]
    terms += [EmpiricalFlow(name=f"law@{c.name}", chamber=c.name, body=c.body) for c in chambers]

    def more(plant: Plant) -> Plant:
        return plant.with_effects(*terms)

    base = problem.base
    fit = replace(base, windows=replace(base.windows, plant=more(base.windows.plant)))
    held_out = problem.base_validation
    if held_out:
        windows = replace(held_out.windows, plant=fit.windows.plant)
        held_out = replace(held_out, windows=windows)
    return replace(problem, whole=more(problem.whole), base=fit, base_validation=held_out)


def _middle(problem: Problem, body: Body) -> float:
    """Middle of the recorded stroke of a body in m."""
    windows = problem.base.windows
    name = f"{body.name}.position_m"
    if name not in windows.plant.measured:
        return 0.0
    values = windows.measured[windows.plant.measured.index(name)]
    return float((np.nanmin(values) + np.nanmax(values)) / 2)


def _next_term(problem: Problem, accepted: list[Candidate], to_beat: float) -> Refit | None:
    """The refit of the term that the scan puts first, on top of those accepted."""
    at = problem.base
    left = [
        c
        for c in problem.whole.candidates.values()
        if c.cause.name.startswith("law[") and c not in accepted
    ]
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


def _law(problem: Problem, best: Refit, accepted: list[Candidate]) -> Law:
    values = best.fit.plant.values
    terms = {c.strength: values[c.strength] for c in accepted}
    text = " and ".join(
        f"a term in {c.cause.drivers[0]} on {c.place} ({c.cause.strength} = {size:.3g})"
        for c, size in zip(accepted, terms.values(), strict=True)
    )
    windows = best.fit.windows
    ranges = {
        name: (float(np.nanmin(rows)), float(np.nanmax(rows)))
        for name, rows in zip(windows.plant.measured, windows.measured, strict=True)
    }
    balance = f"{accepted[0].place}.{accepted[0].cause.balance.value}"
    drops = (best.drop_train, best.drop_validation)
    return Law(balance, terms, ranges, *drops, text, best.fit, best.validation)
