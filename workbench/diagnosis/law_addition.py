"""A whole empirical law added to a rig, term by term."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import nan

from workbench.diagnosis.absent import is_new
from workbench.diagnosis.addition import Addition, addition, freed, with_held_out
from workbench.diagnosis.diagnose import Progress, silent
from workbench.diagnosis.evidence import weighed
from workbench.diagnosis.judge import size_reasons
from workbench.diagnosis.law import better_base, empirical_law, plant_with_terms, standing
from workbench.diagnosis.law_told import settled_law
from workbench.diagnosis.refit import Refit
from workbench.diagnosis.result import Diagnosis, Evidence, Law
from workbench.diagnosis.scan import scan_catalogue
from workbench.diagnosis.size import sizes
from workbench.diagnosis.where import locate
from workbench.fitting.errors import Errors, errors_of
from workbench.fitting.problem import BELIEVED, pose
from workbench.recording import Recording
from workbench.rig import Rig

NO_LAW = "no empirical law of up to three terms passes every criterion"


def add_law(
    rig: Rig,
    train: Sequence[Recording],
    validation: Sequence[Recording] = (),
    progress: Progress = silent,
) -> tuple[Addition, ...]:
    """Add the empirical law of up to three terms that explains most, term by term.

    Raises
    ------
    ValueError
        If none passes the criteria that an effect must pass.
    """
    train, validation, evidence = with_held_out(rig, train, validation)
    problem = pose(rig, train, validation, believed=BELIEVED, progress=progress)
    progress("empirical law")
    where = locate(problem, train)
    law = empirical_law(problem, scan_catalogue(problem), where=where)
    better = better_base(problem, law)
    if better:
        progress("the prior fit is improved by what the law found: once more")
        problem = better
        law = empirical_law(problem, scan_catalogue(problem), where=where)
        law = standing(problem, law)
    if law is None:
        raise ValueError(f"{rig.name}: {NO_LAW}")
    progress("sizes of the law")
    law = settled_law(problem, law)
    evidence = weighed(evidence, problem.base_validation)
    return accept_law(rig, law, errors_of(problem.base, problem.base_validation), evidence)


def accept_law(
    rig: Rig, law: Law, before: Errors, evidence: Evidence = Evidence.VALIDATION
) -> tuple[Addition, ...]:
    """The terms of an empirical law added to the rig one after the other, as they were fitted.

    ``before`` are the errors without any of them.
    """
    steps: list[Addition] = []
    for term in law.steps:
        name, recordings = term.candidate.name, term.fit.windows.recordings
        rig = replace(rig, plant=plant_with_terms(rig.plant, recordings, [name]))
        drops = (term.drop_train, term.drop_validation)
        step = addition(rig, before, term.candidate, term.fit, term.validation, drops, evidence)
        steps.append(step)
        rig = replace(freed(rig, step), notes=step.rig.notes)
        before = step.after
    return tuple(steps)


def reasons_beside(found: Diagnosis, step: Addition, rig: Rig) -> tuple[str, ...]:
    """Why an effect that was added to a rig is nothing beside the law of a later diagnosis.

    Empty where it keeps a size of its own there.  A shift of a parameter is not asked: the rig as
    it was diagnosed has its prior where it was shifted to.
    """
    law, candidate = found.law, step.candidate
    if law is None or law.fit is None or found.base is None or not is_new(rig, candidate):
        return ()
    there = sizes(law.fit, (candidate.strength,))
    beside = Refit(candidate, law.fit, law.validation, there, nan, nan, nan)
    return tuple(f"beside the law {reason}" for reason in size_reasons(found.base, beside))
