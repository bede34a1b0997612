"""Adding what is missing, and watching the error fall: one effect, or until nothing helps.

Each round starts from the rig's own priors with the effects accepted so far free, so parameters
that had moved to imitate a missing effect can move back once it is there.

Source: diagnosis.md 1.10 (forward selection with a new scan after each acceptance).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from workbench.consistency import checked
from workbench.diagnosis.diagnose import WEAK_EVIDENCE, Progress, diagnose, silent
from workbench.diagnosis.refit import refit
from workbench.diagnosis.result import Diagnosis
from workbench.diagnosis.rough import rough_fit
from workbench.diagnosis.scan import scan
from workbench.fitting.errors import Errors, errors_of, per_sample
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.posterior import fitted_rig, posterior_deviation
from workbench.fitting.problem import Problem, pose, split
from workbench.plant import Candidate, require
from workbench.recording import Recording
from workbench.rig import Rig

MOST_ROUNDS = 8


@dataclass(frozen=True)
class Moved:
    """One parameter before and after: values, posterior and prior standard deviations in SI."""

    name: str
    before: float
    after: float
    deviation: float
    prior_deviation: float


@dataclass(frozen=True)
class Addition:
    """One effect added and fitted: the new rig, errors before and after, parameters."""

    rig: Rig
    candidate: Candidate
    before: Errors
    after: Errors
    drop_train: float
    drop_validation: float
    parameters: tuple[Moved, ...]
    fit: Fit = field(repr=False)
    validation_fit: Fit | None = field(repr=False)


@dataclass(frozen=True)
class Improvement:
    """Rounds of diagnosis and addition.

    budget    (label, chi2 per sample in training, the same in validation), from bare to final
    stopped   True where the user stopped it after at least one finished round
    """

    rig: Rig
    steps: tuple[Addition, ...]
    diagnoses: tuple[Diagnosis, ...]
    budget: tuple[tuple[str, float, float], ...]
    stopped: bool = False


def add(
    rig: Rig,
    name: str,
    train: Sequence[Recording],
    validation: Sequence[Recording] = (),
    progress: Progress = silent,
) -> Addition:
    """Add one effect of the catalogue to a rig and refit.

    Raises
    ------
    KeyError
        If the plant has no such effect for these recordings, with the nearest name.
    ValueError
        If the effect is there already, only a shift of a parameter that is fitted anyway, fixed by
        the rig, or a change of something that the plant lacks.
    """
    plant = rig.fit_for(train[0])
    require([name], plant.candidates, plant.name)
    train, validation = checked(rig, train, validation)
    if not validation:
        warnings.warn(WEAK_EVIDENCE, stacklevel=2)
        train, validation = split(train)
    candidate = plant.candidates[name]
    progress("prior fit")
    problem = pose(rig, train, validation)
    if candidate in problem.added or _present(problem, candidate):
        raise ValueError(f"{name}: {rig.name} has it already; fit moves it")
    if not plant.ready_for(candidate):
        raise ValueError(f"{name}: nothing without {candidate.member}.{candidate.cause.needs}")
    if candidate.strength in rig.fixed:
        raise ValueError(f"{name}: {rig.name} fixes {candidate.strength}: nothing to fit")
    progress(f"refit with {name}")
    base = problem.base
    profiles = scan(problem.whole, base.windows, base.unknowns, base.point, [candidate])
    found = refit(problem, rough_fit(problem, profiles[0]))
    drops = (found.drop_train, found.drop_validation)
    return _addition(rig, problem, candidate, found.fit, found.validation, drops)


def improve(
    rig: Rig,
    train: Sequence[Recording],
    validation: Sequence[Recording],
    progress: Progress = silent,
) -> Improvement:
    """Diagnose and add until nothing in the catalogue earns its place.

    The effect added is the first of the ranking where it passes every criterion, also where an
    empirical law would do better: a physical effect comes first.  An interrupt after the first
    finished round ends it there, with what is finished.

    Raises
    ------
    ValueError
        Without a validation recording: what is added again and again must hold elsewhere too.
    """
    if not validation:
        raise ValueError("improve needs a validation recording: another manoeuvre, held out")
    steps: list[Addition] = []
    diagnoses: list[Diagnosis] = []
    current, stopped = rig, False
    for count in range(1, MOST_ROUNDS + 1):
        try:
            progress(f"round {count}")
            diagnosis = diagnose(current, train, validation, progress)
        except KeyboardInterrupt:
            if not steps:
                raise
            progress(f"stopped in round {count}: {len(steps)} finished")
            stopped = True
            break
        diagnoses.append(diagnosis)
        best = diagnosis.ranking[0] if diagnosis.ranking else None
        if best is None or best.fit is None or not best.accepted:
            break
        progress(f"accepted {best.candidate.name}")
        steps.append(accept(current, diagnosis))
        freed = _freed(current, best.candidate, best.fit)
        current = replace(freed, notes=steps[-1].rig.notes)
    final = steps[-1].rig if steps else rig
    budget = _budget(diagnoses, steps)
    return Improvement(final, tuple(steps), tuple(diagnoses), budget, stopped)


def accept(rig: Rig, diagnosis: Diagnosis) -> Addition:
    """What the ranking of a diagnosis puts first, added to the rig as it was fitted there.

    Raises
    ------
    ValueError
        If the first of the ranking was not refitted.
    """
    best = diagnosis.ranking[0] if diagnosis.ranking else None
    if best is None or best.fit is None:
        raise ValueError(f"{diagnosis.rig_name}: the diagnosis followed no candidate to a refit")
    problem = pose_again(rig, diagnosis)
    drops = (best.drop_train, best.drop_validation)
    return _addition(rig, problem, best.candidate, best.fit, best.validation, drops)


def pose_again(rig: Rig, diagnosis: Diagnosis) -> Problem:
    """The problem that a diagnosis was made on, without fitting it again."""
    plant = rig.fit_for(diagnosis.base.windows.recordings[0])
    added = rig.added_to(plant)
    return Problem(rig, plant, added, diagnosis.base, diagnosis.base_validation)


def _present(problem: Problem, candidate: Candidate) -> bool:
    """True where the base fit moves the cause already."""
    moved = problem.base.unknowns.names
    return candidate.held in moved or (
        candidate.strength in moved and not candidate.cause.tolerated
    )


def _freed(rig: Rig, candidate: Candidate, fit: Fit) -> Rig:
    """The rig with its own priors and one more free effect; what was added starts where it is."""
    ours, values = rig.plant.values, fit.plant.values
    unknowns = fit.unknowns
    free = [n for n, w in zip(unknowns.names, unknowns.precision, strict=True) if w < 1.0]
    found = {name: values[name] for name in (*free, *unknowns.held) if name in ours}
    if not _is_new(rig, candidate):
        return replace(
            rig, plant=rig.plant.with_values(found), deviations=_loosened(rig, fit, free)
        )
    added = (*rig.added, candidate.name)
    return replace(rig, plant=rig.plant.with_values(found), added=added)


def _is_new(rig: Rig, candidate: Candidate) -> bool:
    """True for a cause that is absent from the rig's plant, not a shift of what it has."""
    known = rig.plant.parameters[candidate.strength]
    absent = rig.plant.values.get(candidate.strength, known.null) == known.null
    return candidate.held is None and absent


def _loosened(rig: Rig, fit: Fit, free: list[str]) -> dict[str, float]:
    """Standard deviations in which a parameter that left its prior is known as the fit knows it."""
    known = dict(zip(fit.unknowns.names, posterior_deviation(fit).tolist(), strict=True))
    return {**rig.deviations, **{name: known[name] for name in free}}


def _addition(
    rig: Rig,
    problem: Problem,
    candidate: Candidate,
    fit: Fit,
    held_out: Fit | None,
    drops: tuple[float, float],
) -> Addition:
    share, unseen = drops
    note = f"{candidate.name}: error {share:.0%} smaller in training, {unseen:.0%} in validation"
    return Addition(
        rig=fitted_rig(rig, fit, [candidate.name] if _is_new(rig, candidate) else [], note),
        candidate=candidate,
        before=errors_of(problem.base, problem.base_validation),
        after=errors_of(fit, held_out),
        drop_train=share,
        drop_validation=unseen,
        parameters=moved_parameters(fit),
        fit=fit,
        validation_fit=held_out,
    )


def moved_parameters(fit: Fit) -> tuple[Moved, ...]:
    """What a fit moved, with standard deviations."""
    values, unknowns = fit.plant.values, fit.unknowns
    deviation = posterior_deviation(fit)
    return tuple(
        Moved(name, float(prior), values[name], float(d), float(s) if w >= 1.0 else float("inf"))
        for name, prior, s, w, d in zip(
            unknowns.names,
            unknowns.prior,
            unknowns.scale,
            unknowns.precision,
            deviation,
            strict=True,
        )
    )


def _budget(
    diagnoses: Sequence[Diagnosis], steps: Sequence[Addition]
) -> tuple[tuple[str, float, float], ...]:
    """Error as it came and after every step: as the next round found it, or as it was fitted."""
    labels = ["as it came", *(f"+ {step.candidate.name}" for step in steps)]
    bases = [(each.base, each.base_validation) for each in diagnoses]
    fits = [*bases, *((step.fit, step.validation_fit) for step in steps[len(bases) - 1 :])]
    return tuple(
        (label, per_sample(fit), per_sample(held_out))
        for label, (fit, held_out) in zip(labels, fits, strict=False)
    )
