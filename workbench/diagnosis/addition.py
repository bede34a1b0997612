"""One effect, or one term of an empirical law, added to a rig and fitted."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from workbench.candidate import TOGETHER, Candidate
from workbench.consistency import checked
from workbench.diagnosis.absent import is_new, require_place
from workbench.diagnosis.diagnose import Progress, silent
from workbench.diagnosis.evidence import WARNINGS, Recordings, held_out, weighed
from workbench.diagnosis.law import better_base, empirical_law, plant_with_terms, standing
from workbench.diagnosis.pairs import pair_fit
from workbench.diagnosis.refit import Refit, refit, refit_shaken
from workbench.diagnosis.result import Diagnosis, Evidence, Law, Ranked, told
from workbench.diagnosis.rough import rough_fit
from workbench.diagnosis.scan import scan, scan_catalogue
from workbench.diagnosis.settle import settled_leader
from workbench.diagnosis.where import locate
from workbench.fitting.errors import Errors, errors_of
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.posterior import (
    Moved,
    fitted_rig,
    moved_parameters,
    posterior_deviation,
)
from workbench.fitting.problem import BELIEVED, Problem, pose
from workbench.law_range import ranges_text
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.rig_laws import is_law

NO_LAW = "no empirical law of up to three terms passes every criterion"


@dataclass(frozen=True)
class Addition:
    """One effect added and fitted: the new rig, errors before and after, parameters.

    ``evidence`` says what its errors on held-out recordings are worth.
    """

    rig: Rig
    candidate: Candidate
    before: Errors
    after: Errors
    drop_train: float
    drop_validation: float
    parameters: tuple[Moved, ...]
    fit: Fit = field(repr=False)
    validation_fit: Fit | None = field(repr=False)
    evidence: Evidence = Evidence.VALIDATION


def add(
    rig: Rig,
    name: str,
    train: Sequence[Recording],
    validation: Sequence[Recording] = (),
    progress: Progress = silent,
) -> Addition:
    """Add one effect of the catalogue, two (``a + b``), or one empirical term to a rig and refit.

    Raises
    ------
    InputError
        If the plant has no such effect, with the nearest name, or the recordings measure it.
    ValueError
        If the effect is there already, only a shift of a parameter that is fitted anyway, fixed by
        the rig, or a change of something that the plant lacks; or if there are more than two.
    """
    train, validation, evidence = _with_held_out(rig, train, validation)
    if is_law(name):
        rig = replace(rig, plant=plant_with_terms(rig.plant, train, [name]))
    plant = rig.fit_for(train[0])
    names = _names_in(name)
    require_place(rig, plant, names)
    candidates = [plant.candidates[each] for each in names]
    problem = pose(rig, train, validation, believed=BELIEVED, progress=progress)
    for candidate in candidates:
        _require_absent(rig, plant, problem, candidate)
    progress(f"refit with {name}")
    base = problem.base
    profiles = scan(problem.whole, base.windows, base.unknowns, base.point, candidates)
    begun = rough_fit(problem, profiles[0]) if len(names) == 1 else pair_fit(problem, profiles)
    found = refit_shaken(problem, refit(problem, begun))
    return refitted_addition(rig, problem, found, weighed(evidence, problem.base_validation))


def refitted_addition(rig: Rig, problem: Problem, found: Refit, evidence: Evidence) -> Addition:
    """A refit as an addition to the rig of its problem, with its size settled."""
    fit = settled_leader(found.fit, found.candidate)
    before = errors_of(problem.base, problem.base_validation)
    drops = (found.drop_train, found.drop_validation)
    return addition(rig, before, found.candidate, fit, problem.validated(fit), drops, evidence)


def _names_in(name: str) -> list[str]:
    """The names of one effect, or of the two of a pair."""
    names = name.split(TOGETHER)
    if len(names) > 2 or len(set(names)) < len(names):
        raise ValueError(f"{name}: {len(names)} effects; expected one, or two different ones")
    return names


def _require_absent(rig: Rig, plant: Plant, problem: Problem, candidate: Candidate) -> None:
    """Raise ValueError where a candidate is there already or has nothing to be fitted."""
    name = candidate.name
    if candidate in problem.added or _present(problem, candidate):
        raise ValueError(f"{name}: {rig.name} has it already; fit moves it")
    if not plant.ready_for(candidate):
        raise ValueError(f"{name}: nothing without {candidate.member}.{candidate.cause.needs}")
    if candidate.strength in rig.fixed:
        raise ValueError(f"{name}: {rig.name} fixes {candidate.strength}: nothing to fit")


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
    train, validation, evidence = _with_held_out(rig, train, validation)
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
    evidence = weighed(evidence, problem.base_validation)
    return accept_law(rig, law, errors_of(problem.base, problem.base_validation), evidence)


def _with_held_out(
    rig: Rig, train: Recordings, validation: Recordings
) -> tuple[Recordings, Recordings, Evidence]:
    """As :func:`held_out` of recordings that fit the rig; warns where they prove little."""
    train, validation, evidence = held_out(*checked(rig, train, validation))
    if not evidence.strong:
        warnings.warn(WARNINGS[evidence], stacklevel=3)
    return train, validation, evidence


def accept(rig: Rig, diagnosis: Diagnosis) -> Addition:
    """What the ranking of a diagnosis puts first, added to the rig as it was fitted there.

    Raises
    ------
    ValueError
        If the first of the ranking was not refitted, or recording and rig contradict each other.
    """
    if diagnosis.contradicted:
        raise ValueError(f"{diagnosis.rig_name}: {diagnosis.sentence}")
    best = diagnosis.ranking[0] if diagnosis.ranking else None
    if best is None or best.fit is None:
        raise ValueError(f"{diagnosis.rig_name}: the diagnosis followed no candidate to a refit")
    return addition_of(rig, diagnosis, best)


def addition_of(rig: Rig, diagnosis: Diagnosis, row: Ranked) -> Addition:
    """A refitted row of a ranking added to the diagnosed rig as it was fitted there."""
    return addition(
        rig,
        diagnosis.before,
        row.candidate,
        row.fit,
        row.validation,
        (row.drop_train, row.drop_validation),
        diagnosis.evidence,
    )


def apart(step: Addition) -> tuple[Addition, ...]:
    """An addition of a pair as two that share their fit, each with a note of its own."""
    pair = step.candidate.singles
    if len(pair) < 2:
        return (step,)
    *before, last = step.rig.notes
    said = last.removeprefix(step.candidate.name)
    halves = []
    for one, other in ((pair[0], pair[1]), (pair[1], pair[0])):
        before.append(f"{one.name}, together with {other.name}{said}")
        halves.append(replace(step, candidate=one, rig=replace(step.rig, notes=tuple(before))))
    return tuple(halves)


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


def _present(problem: Problem, candidate: Candidate) -> bool:
    """True where the base fit moves the cause already."""
    moved = problem.base.unknowns.names
    return candidate.held in moved or (
        candidate.strength in moved and not candidate.cause.tolerated
    )


def assembled(rig: Rig, steps: Sequence[Addition]) -> Rig:
    """The rig with its own priors, what the steps added free, and their notes.

    What an earlier or later step moved beside its own effect stays as the rig has it; the halves of
    a pair share their fit, and each brings its own effect.
    """
    own: set[str] = set()
    found = rig
    for step in steps:
        own.update(step.candidate.moved)
        found = freed(found, step, own)
    kept = [line for step in steps for line in step.rig.notes[-1:]]
    return replace(found, notes=(*rig.notes, *kept))


def freed(rig: Rig, step: Addition, own: Iterable[str] | None = None) -> Rig:
    """The rig with its own priors and one more free effect; what was added starts where it is.

    A shift is known no better there than before: how sure its fit is came of the recordings that
    are fitted again, without what is found later.  ``own`` are the parameters that may be set: by
    default all that the fit set free.
    """
    ours, fit, unknowns = rig.plant.values, step.fit, step.fit.unknowns
    values = fit.plant.values
    free = [n for n, w in zip(unknowns.names, unknowns.precision, strict=True) if w < 1.0]
    free = [name for name in free if own is None or name in own]
    found = {name: values[name] for name in (*free, *unknowns.held) if name in ours}
    plant = rig.plant.with_values(found)
    if is_new(rig, step.candidate):
        return rig.with_added(plant, [step.candidate.name])
    known = dict(zip(unknowns.names, posterior_deviation(fit).tolist(), strict=True))
    looser = {n: known[n] for n in free if known[n] > rig.standard_deviation(n)}
    return replace(rig, plant=plant, deviations={**rig.deviations, **looser})


def addition(
    rig: Rig,
    before: Errors,
    candidate: Candidate,
    fit: Fit,
    unseen_fit: Fit | None,
    drops: tuple[float, float],
    evidence: Evidence = Evidence.VALIDATION,
) -> Addition:
    """A fit with one more effect as an addition to the rig that it was fitted for."""
    share, unseen = drops
    new = [each.name for each in candidate.singles if is_new(rig, each)]
    found = fitted_rig(rig, fit, new)
    kind = ""
    if is_law(candidate.name):
        kind = f"empirical, not a physical effect, seen for {ranges_text(found.seen)}; "
    trained, held = f"{told(share):.0%}", f"{told(unseen):.0%}"
    falls = f"weighted misfit {trained} smaller in training, {held} in {evidence.value}"
    return Addition(
        rig=replace(found, notes=(*rig.notes, f"{candidate.name}: {kind}{falls}")),
        candidate=candidate,
        before=before,
        after=errors_of(fit, unseen_fit),
        drop_train=share,
        drop_validation=unseen,
        parameters=moved_parameters(fit),
        fit=fit,
        validation_fit=unseen_fit,
        evidence=evidence,
    )
