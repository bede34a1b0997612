"""Adding what is missing, and watching the error fall, until nothing helps any more.

Each round starts from the rig's own priors with the effects accepted so far free, so parameters
that had moved to imitate a missing effect can move back once it is there.  In the end a backward
and a swap pass (:mod:`workbench.diagnosis.passes`) ask again for each effect whether it is needed.
Where nothing of the catalogue earns its place, an empirical law may, if it is asked for.

Source: diagnosis.md 1.9 and 1.10 (forward selection with a new scan after each acceptance).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from math import inf, nan

from workbench.comparison.free_run import free_run_errors
from workbench.consistency import checked
from workbench.diagnosis.absent import unknown_forms
from workbench.diagnosis.addition import Addition, accept, add, assembled
from workbench.diagnosis.diagnose import Progress, diagnose, silent
from workbench.diagnosis.improvement import Change, Improvement
from workbench.diagnosis.last_notes import with_last_notes
from workbench.diagnosis.law_addition import accept_law, add_law, reasons_beside
from workbench.diagnosis.passes import Kept, Passes, Removal, leaves_more
from workbench.diagnosis.result import Diagnosis
from workbench.diagnosis.rounds import Rounds, comes_first, forward
from workbench.fitting.errors import Errors, errors_of
from workbench.fitting.posterior import Moved, fitted_rig, moved_parameters
from workbench.fitting.problem import NO_EVIDENCE, proves_nothing
from workbench.recording import Recording
from workbench.rig import Rig

__all__ = ["Addition", "Improvement", "accept", "add", "add_law", "improve"]


def improve(
    rig: Rig,
    train: Sequence[Recording],
    validation: Sequence[Recording],
    progress: Progress = silent,
    law: bool = False,
) -> Improvement:
    """Diagnose and add until nothing in the catalogue earns its place, then think again.

    The effect added is the first of the ranking where it passes every criterion, also where an
    empirical law would do better: a physical effect comes first.  A shift of a parameter does not
    where a law is asked for: it may well imitate it.  What the held-out recording alone refuses may
    come in with the next one (:mod:`workbench.diagnosis.rounds`).  Where recording and rig
    contradict each other only two effects at once are added that end it; else what was added before
    stays.  With ``law`` an empirical law is taken in the end, where one passes the same criteria.
    An interrupt after the first finished round ends the work there, with what is finished.

    Raises
    ------
    ValueError
        Without a validation recording, or with one of the training: what is added again and again
        must hold elsewhere too.
    """
    if not validation:
        raise ValueError("improve needs a validation recording: another manoeuvre, held out")
    if proves_nothing(train, validation):
        raise ValueError(f"{NO_EVIDENCE}; expected another manoeuvre")
    kept = checked(rig, train, validation)
    done = forward(Rounds(rig), train, validation, progress, law)
    if not done.stopped:
        done = _thought_over(done, *kept, progress)
    last = None
    if law and not done.stopped:
        done, last = _asked_for_law(done, train, validation, progress)
    done = _with_notes(done)
    if last:
        done = _with_terms(done, last, progress)
    return _improvement(done, *kept, progress)


def _thought_over(
    done: Rounds,
    train: Sequence[Recording],
    validation: Sequence[Recording],
    progress: Progress,
) -> Rounds:
    """Backward pass, then swap pass; an interrupt keeps what is finished."""
    passes = Passes(done.rig, train, validation, done.origins, progress, done.opened)
    try:
        for step in passes.in_turn(done.steps):
            done = _removed(done, passes, step)
        for step in passes.in_turn(done.kept.steps if done.kept else ()):
            done = _swapped(done, passes, step)
    except KeyboardInterrupt:
        progress("stopped in the second thoughts: what is finished stays")
        done = replace(done, stopped=True)
    return done


def _with_notes(done: Rounds) -> Rounds:
    """What is kept with its last notes, once all that goes again is gone."""
    if done.kept is None:
        return done
    return replace(done, kept=with_last_notes(done.kept, done.steps, done.removals, done.swaps))


def _removed(done: Rounds, passes: Passes, step: Addition) -> Rounds:
    """Backward pass over one effect; one that came in alone was judged in its round.

    One that is left alone was not: it came in on top of another.
    """
    if done.kept is None or (len(done.kept.steps) < 2 and done.kept.judged(step)):
        return done
    removal, kept = passes.removal(done.kept, step)
    done = replace(done, removals=(*done.removals, removal), kept=kept)
    if not removal.dropped:
        return done
    label = f"- {step.candidate.name}"
    return done.marked(label, kept.fit, kept.validation, Change.DROPPED)


def _swapped(done: Rounds, passes: Passes, step: Addition) -> Rounds:
    """Swap pass over one effect."""
    if done.kept is None:
        return done
    tried, kept = passes.swaps(done.kept, step)
    done = replace(done, swaps=(*done.swaps, *tried), kept=kept)
    if not (tried and tried[-1].replaced):
        return done
    label = f"{tried[-1].rival.name} for {step.candidate.name}"
    return done.marked(label, kept.fit, kept.validation, Change.SWAPPED)


def _asked_for_law(
    done: Rounds,
    train: Sequence[Recording],
    validation: Sequence[Recording],
    progress: Progress,
) -> tuple[Rounds, Diagnosis | None]:
    """The diagnosis with a law, where one passes and nothing of the catalogue earns its place.

    Without those effects to which the law leaves nothing; None where no law is to be taken.  The
    second thoughts asked only what was there.  Where they changed it, another effect may be missing
    now: then no law is taken, and it is told.
    """
    steps = done.kept.steps if done.kept else ()
    current, last = assembled(done.rig, steps), done.diagnoses[-1]
    try:
        if [step.candidate for step in steps] != [step.candidate for step in done.steps]:
            progress("diagnosis of what is kept")
            last = diagnose(current, train, validation, progress)
            done = done.told(last).fitted_again(last)
            done = replace(
                done, left_out=last.ranking[0].candidate.name if comes_first(last) else ""
            )
    except KeyboardInterrupt:
        progress("stopped before the empirical law")
        return replace(done, stopped=True), None
    if last.law is None or comes_first(last):
        return done, None
    try:
        return _without_needless(done, last, train, validation, progress)
    except KeyboardInterrupt:
        progress("stopped beside the empirical law")
        return replace(done, stopped=True), None


def _with_terms(done: Rounds, last: Diagnosis, progress: Progress) -> Rounds:
    """The terms of the law that a diagnosis tells on top of what is kept."""
    current = assembled(done.rig, done.kept.steps if done.kept else ())
    for step in accept_law(current, last.law, last.before, last.evidence):
        progress(f"empirical: {step.candidate.name}")
        done = replace(done, steps=(*done.steps, step))
        label = f"+ {step.candidate.name}"
        done = done.marked(label, step.fit, step.validation_fit, Change.LAW)
    return replace(done, law=last.law)


def _without_needless(
    done: Rounds,
    last: Diagnosis,
    train: Sequence[Recording],
    validation: Sequence[Recording],
    progress: Progress,
) -> tuple[Rounds, Diagnosis]:
    """What is kept without those to which a law leaves nothing, and the diagnosis with its law.

    A force that stood for a curve is none any more beside the law that has it.  All stay where the
    diagnosis without them tells no law, or one that leaves more, and where what stays needs one.
    """
    steps = done.kept.steps if done.kept else ()
    gone = {s.candidate.name: why for s in steps if (why := reasons_beside(last, s, done.rig))}
    if not gone:
        return done, last
    rest = tuple(step for step in steps if step.candidate.name not in gone)
    bare = assembled(done.rig, rest)
    if not all(bare.plant.ready_for(step.candidate) for step in rest):
        return done, last
    progress(f"diagnosis without {', '.join(gone)}, to which the law leaves nothing")
    again = diagnose(bare, train, validation, progress)
    if again.law is None or again.law.fit is None:
        return done, last
    kept = Kept(rest, again.base, again.base_validation)
    had, has = (Kept((), law.fit, law.validation) for law in (last.law, again.law))
    if leaves_more(had, has):
        return done, last
    taken = (step.candidate for step in steps if step.candidate.name in gone)
    out = (Removal(each, nan, nan, gone[each.name], True) for each in taken)
    done = replace(done.told(again), kept=kept, removals=(*done.removals, *out))
    label = ", ".join(f"- {name}" for name in gone)
    return done.marked(label, kept.fit, kept.validation, Change.DROPPED), again


def _improvement(
    done: Rounds,
    train: Sequence[Recording],
    validation: Sequence[Recording],
    progress: Progress,
) -> Improvement:
    """The result, with errors before and after and all that the final fit moved."""
    first = done.diagnoses[0]
    fit, held_out = first.base, first.base_validation
    final, parameters = done.rig, ()
    if done.law:
        final, fit, held_out = done.steps[-1].rig, done.law.fit or fit, done.law.validation
    elif done.kept and done.kept.steps:
        fit, held_out = done.last_fit
        final = fitted_rig(assembled(done.rig, done.kept.steps), fit)
    terms = done.law.steps if done.law else ()
    kept = (*(done.kept.names if done.kept else ()), *(term.candidate.name for term in terms))
    if final is not done.rig:
        steps = (*(done.kept.steps if done.kept else ()), *(done.steps if done.law else ()))
        added = unknown_forms(done.rig, (step.candidate for step in steps))
        parameters = tuple(_counted_from(done.rig, added, row) for row in moved_parameters(fit))
    sets, windows = {"train": train, "validation": validation}, fit.windows
    noise = dict(zip(windows.plant.measured, windows.noise.tolist(), strict=True))
    free: tuple[Errors, Errors] = {}, {}
    try:
        progress("free runs")
        free = free_run_errors(done.rig, sets, noise), free_run_errors(final, sets, noise)
    except KeyboardInterrupt:  # all else is finished
        done = replace(done, stopped=True)
    return Improvement(
        rig=final,
        steps=done.steps,
        kept=kept,
        diagnoses=done.diagnoses,
        removals=done.removals,
        swaps=done.swaps,
        ahead=done.ahead,
        law=done.law,
        before=first.before,
        after=done.came if final is done.rig else errors_of(fit, held_out),
        free_before=free[0],
        free_after=free[1],
        parameters=parameters,
        budget=done.budget,
        stopped=done.stopped,
        used_up=done.used_up,
        left_out=done.left_out,
        fit=fit,
        validation_fit=held_out,
        came=done.came,
    )


def _counted_from(rig: Rig, added: Collection[str], row: Moved) -> Moved:
    """A fitted parameter against the rig as it came, where it was absent or had a prior.

    ``added`` are forms of what was absent, whatever held them in the fit.  What is absent and has a
    prior in the fit is tolerated: every fit may use a little of it.
    """
    known = rig.plant.parameters.get(row.name)
    if known is None:  # an empirical term
        return replace(row, before=0.0, prior_deviation=inf)
    before = rig.plant.values[row.name]
    if row.name in added:
        return replace(row, before=before, prior_deviation=inf)
    if before == known.null:
        return replace(row, before=before)
    return replace(row, before=before, prior_deviation=rig.standard_deviation(row.name) or inf)
