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
from workbench.diagnosis.judge import reasons_against
from workbench.diagnosis.law import plant_with_terms
from workbench.diagnosis.pairs import pair_fit
from workbench.diagnosis.refit import Refit, refit, refit_shaken
from workbench.diagnosis.result import Diagnosis, Evidence, Ranked, percent_told
from workbench.diagnosis.rough import rough_fit
from workbench.diagnosis.scan import scan
from workbench.diagnosis.settle import settled_refit
from workbench.effect import Kind
from workbench.fitting.errors import Errors, errors_of, require_simulated
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.posterior import (
    Moved,
    fitted_rig,
    moved_parameters,
    posterior_deviation,
)
from workbench.fitting.problem import BELIEVED, Problem, pose, staged
from workbench.fitting.unknowns import nominal_unknowns
from workbench.law_range import ranges_text
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.rig_laws import is_law
from workbench.units import public_name

ALIKE_SHOWN = 3  # names of what a recording does not tell from what was added


@dataclass(frozen=True)
class Addition:
    """One effect added and fitted: the new rig, errors before and after, parameters.

    ``evidence`` says what its errors on held-out recordings are worth, ``against`` which criteria
    of acceptance it fails: whoever adds an effect by name may know more than the recordings.
    ``alike`` is what its diagnosis did not tell it from, ``kind`` whether it only shifts what was
    there.
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
    against: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()
    kind: Kind = Kind.EFFECT


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
    ArithmeticError
        If most samples of an output cannot be simulated with it.
    """
    train, validation, evidence = with_held_out(rig, train, validation)
    if TOGETHER in name and any(map(is_law, name.split(TOGETHER))):
        raise ValueError(f"{name}: terms of a law are added one at a time, or all as `law`")
    if is_law(name):
        rig = replace(rig, plant=plant_with_terms(rig.plant, train, [name]))
    plant = rig.fit_for(train[0])
    names = _names_in(name)
    require_place(rig, plant, names)
    candidates = [plant.candidates[each] for each in names]
    for candidate in candidates:
        _require_absent(rig, plant, candidate)
    problem = pose(rig, train, validation, believed=BELIEVED, progress=progress)
    progress(f"refit with {name}")
    base = problem.base
    at = base.windows, base.unknowns, base.point
    profiles = scan(problem.whole, *at, candidates, fixed=rig.fixed)
    begun = rough_fit(problem, profiles[0]) if len(names) == 1 else pair_fit(problem, profiles)
    found = refit_shaken(problem, refit(problem, begun))
    require_simulated(f"with {name}", found.fit, found.validation)
    evidence = weighed(evidence, problem.base_validation)
    step = refitted_addition(rig, problem, found, evidence)
    return with_objections(step, reasons_against(problem.base, found))


def with_objections(step: Addition, against: tuple[str, ...]) -> Addition:
    """The addition with the criteria that it fails, in its note too."""
    if not against:
        return step
    told = f"added by name, a diagnosis would refuse it: {', '.join(against)}"
    return replace(noted(step, f"{step.rig.notes[-1]}; {told}"), against=against)


def noted(step: Addition, note: str) -> Addition:
    """The addition with another note of its own."""
    return replace(step, rig=replace(step.rig, notes=(*step.rig.notes[:-1], note)))


def refitted_addition(rig: Rig, problem: Problem, found: Refit, evidence: Evidence) -> Addition:
    """A refit as an addition to the rig of its problem, with its size settled."""
    now = settled_refit(problem, found)
    before = errors_of(problem.base, problem.base_validation)
    drops = (found.drop_train, found.drop_validation)
    return addition(rig, before, found.candidate, now.fit, now.validation, drops, evidence)


def _names_in(name: str) -> list[str]:
    """The names of one effect, or of the two of a pair."""
    names = name.split(TOGETHER)
    if len(names) > 2 or len(set(names)) < len(names):
        raise ValueError(f"{name}: {len(names)} effects; expected one, or two different ones")
    return names


def _require_absent(rig: Rig, plant: Plant, candidate: Candidate) -> None:
    """Raise ValueError where a candidate is there already or has nothing to be fitted."""
    name, added = candidate.name, rig.added_to(plant)
    if candidate in added or _present(rig, plant, added, candidate):
        shifted = candidate.held and f"it shifts {public_name(candidate.held)}, which fit moves"
        raise ValueError(f"{name}: {shifted or f'{rig.name} has it already; fit moves it'}")
    if not plant.ready_for(candidate):
        raise ValueError(f"{name}: nothing without {public_name(candidate.needed)}")
    if candidate.strength in rig.fixed:
        fixed = public_name(candidate.strength)
        raise ValueError(f"{name}: {rig.name} fixes {fixed}: nothing to fit")


def with_held_out(
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
    """A refitted row of a ranking added to the diagnosed rig as it was fitted there.

    Its note says what does the same to these recordings: the rig file says one cause, they do not.
    """
    step = addition(
        rig,
        diagnosis.before,
        row.candidate,
        row.fit,
        row.validation,
        (row.drop_train, row.drop_validation),
        diagnosis.evidence,
    )
    note = f"{step.rig.notes[-1]}{alike_text(row.alike)}"
    return replace(noted(step, note), alike=row.alike, kind=row.kind)


def alike_text(names: Sequence[str]) -> str:
    """What something was not told apart from, at the end of a note; nothing without names."""
    if not names:
        return ""
    more = f" and {len(names) - ALIKE_SHOWN} more" if len(names) > ALIKE_SHOWN else ""
    return f"; not told apart from {', '.join(names[:ALIKE_SHOWN])}{more}"


def falls(share: float, unseen: float, evidence: Evidence) -> str:
    """How much of the misfit goes away in training and held out, in words."""
    trained, held = percent_told(share), percent_told(unseen)
    return f"weighted misfit {trained} smaller in training, {held} in {evidence.value}"


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


def _present(rig: Rig, plant: Plant, added: Sequence[Candidate], candidate: Candidate) -> bool:
    """True where the prior fit moves the cause already; no fit is needed to know."""
    lean = staged(plant, *(each.member for each in added))
    moved = nominal_unknowns(lean, rig.deviations, rig.held, added).names
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
    said = f"{candidate.name}: {kind}{falls(share, unseen, evidence)}"
    return Addition(
        rig=replace(found, notes=(*rig.notes, said)),
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
