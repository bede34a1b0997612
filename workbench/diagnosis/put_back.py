"""The final model without one of its effects: its fit, the effect put back, and rivals there.

Source: diagnosis.md 1.10.
"""

from __future__ import annotations

from workbench.candidate import Candidate
from workbench.diagnosis.refit import Refit, refit, refit_from, refit_shaken, refit_shift
from workbench.diagnosis.rough import rough_fit
from workbench.diagnosis.scan import scan
from workbench.diagnosis.shifts import shifts
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.own_errors import consistent
from workbench.fitting.problem import Problem, improved_base


def fitted_without(problem: Problem, candidate: Candidate, final: Fit) -> tuple[Problem, Refit]:
    """The problem of a rig without an effect, with its best prior fit, and the effect put back.

    ``final`` is the fit with the effect: what is fitted without it begins there too, where both
    stand on the same windows, and at what the effect, put back, leaves of the nominal parameters.
    """
    same = final.windows.firsts == problem.base.windows.firsts
    near = final if same else None
    problem = (near and _improved(problem, near)) or problem
    found = _put_back(problem, candidate, final, near)
    if better := _improved(problem, found.fit):
        problem, found = better, _put_back(better, candidate, final, near)
    return problem, found


def in_its_place(problem: Problem, candidate: Candidate) -> Refit | None:
    """A rival in the place of an effect, from the scan's best sizes; None where it has none."""
    base = problem.base
    names = problem.whole.candidates
    if candidate.name not in names or not problem.whole.ready_for(candidate):
        return None
    if shifted := _shifted(problem, candidate):
        return shifted
    at = base.windows, base.unknowns, base.point
    profiles = scan(problem.whole, *at, [candidate], base.derivatives, problem.rig.fixed)
    if not profiles:
        return None
    return refit_shaken(problem, refit(problem, rough_fit(problem, profiles[0])))


def _improved(problem: Problem, near: Fit) -> Problem | None:
    """The problem with a better prior fit, where this fit leads to one, weighed by its own errors.

    By the errors of a fit that ended elsewhere, an output that it could not follow counts for
    nothing, and neither does what the better one leaves there.
    """
    better = improved_base(problem, [near])
    if better is None:
        return None
    base = consistent(better.base)
    return better if base is better.base else better.with_base(base)


def _put_back(problem: Problem, candidate: Candidate, final: Fit, near: Fit | None) -> Refit:
    """An effect again in the model without it, from where the final fit has it.

    ``near`` is a fit on the same windows whose start states are taken where they suit better.
    """
    alone = _shifted(problem, candidate) or refit_from(problem, candidate, final.plant.values, near)
    return refit_shaken(problem, alone)


def _shifted(problem: Problem, candidate: Candidate) -> Refit | None:
    """A fitted parameter without its prior; None where the cause is no shift of one."""
    moved = [each for each in shifts(problem) if each.candidate.name == candidate.name]
    return refit_shift(problem, moved[0]) if moved else None
