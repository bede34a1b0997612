"""Rounds of diagnosis and addition: the forward part of :mod:`workbench.diagnosis.improve`.

A round adds what its diagnosis accepts first.  Where it accepts nothing, one effect may have failed
on the held-out recording alone because a second one is missing too: what imitates the second in
training misleads elsewhere.  So the effect that removes most, and at least half, is tried for one
round more; it stays if that round accepts another on top of it, if both together predict better
than neither, and if it then passes every criterion on top of that other one.

Source: diagnosis.md 1.9, 1.10 and 4.5 (accept, refit, scan again; judge the pair).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from workbench.diagnosis.addition import Addition, accept, addition_of, apart, assembled
from workbench.diagnosis.diagnose import Progress, diagnose
from workbench.diagnosis.improvement import Change, Stage
from workbench.diagnosis.judge import HELD_OUT_REASON, LEAST_HELD_OUT, SHARE_REASON
from workbench.diagnosis.passes import Kept, Passes, Removal, Swap
from workbench.diagnosis.result import Diagnosis, Law, Ranked
from workbench.effect import Kind
from workbench.fitting.errors import per_sample, plain_ratio
from workbench.fitting.gauss_newton import Fit
from workbench.recording import Recording
from workbench.rig import Rig

MOST_ROUNDS = 8
PROMISES = 0.5  # of the misfit in training: an effect that removes less is not tried further


@dataclass(frozen=True)
class Rounds:
    """How far the work has come."""

    rig: Rig
    kept: Kept | None = None
    steps: tuple[Addition, ...] = ()
    diagnoses: tuple[Diagnosis, ...] = ()
    removals: tuple[Removal, ...] = ()
    swaps: tuple[Swap, ...] = ()
    budget: tuple[Stage, ...] = ()
    law: Law | None = None
    stopped: bool = False

    def marked(self, label: str, fit: Fit, held_out: Fit | None, change: Change) -> Rounds:
        """The same with one more bar in the budget."""
        stage = Stage(label, per_sample(fit), per_sample(held_out), change)
        return replace(self, budget=(*self.budget, stage))

    def told(self, diagnosis: Diagnosis) -> Rounds:
        """The same with one more diagnosis, the first of which begins the budget."""
        done = replace(self, diagnoses=(*self.diagnoses, diagnosis))
        if self.budget:
            return done
        base = (diagnosis.base, diagnosis.base_validation)
        return done.marked(Change.START.value, *base, Change.START)

    def added(self, step: Addition) -> Rounds:
        """The same with one more addition, a pair as its two halves."""
        steps = (*self.steps, *apart(step))
        kept = Kept(steps, step.fit, step.validation_fit)
        done = replace(self, steps=steps, kept=kept)
        label = f"+ {step.candidate.name}"
        return done.marked(label, step.fit, step.validation_fit, Change.ADDED)


@dataclass(frozen=True)
class _Asked:
    """What every round is judged on."""

    train: Sequence[Recording]
    validation: Sequence[Recording]
    progress: Progress

    def diagnosis(self, rig: Rig) -> Diagnosis:
        """One round over a rig."""
        return diagnose(rig, self.train, self.validation, self.progress)


def forward(
    done: Rounds,
    train: Sequence[Recording],
    validation: Sequence[Recording],
    progress: Progress,
) -> Rounds:
    """Rounds of diagnosis and addition, until nothing is accepted any more.

    An interrupt keeps what finished rounds added; before the first it is passed on.
    """
    asked = _Asked(train, validation, progress)
    for count in range(1, MOST_ROUNDS + 1):
        try:
            progress(f"round {count}")
            later = _round(done, asked)
        except KeyboardInterrupt:
            if not done.steps:
                raise
            progress(f"stopped in round {count}: {len(done.steps)} finished")
            return replace(done, stopped=True)
        if len(later.steps) == len(done.steps):
            return later
        done = later
    return done


def _round(done: Rounds, asked: _Asked) -> Rounds:
    """One diagnosis, and what it adds; the same steps where that is nothing."""
    current = assembled(done.rig, done.steps)
    diagnosis = asked.diagnosis(current)
    done = done.told(diagnosis)
    if diagnosis.contradicted:
        asked.progress(f"stopped: {diagnosis.sentence}")
        return done
    if _accepts(diagnosis):
        asked.progress(f"accepted {diagnosis.ranking[0].candidate.name}")
        return done.added(accept(current, diagnosis))
    hopeful = _promising(diagnosis)
    return _further(done, addition_of(current, diagnosis, hopeful), asked) if hopeful else done


def _accepts(diagnosis: Diagnosis) -> bool:
    """True where the ranking puts something first that passes every criterion."""
    best = diagnosis.ranking[0] if diagnosis.ranking else None
    return best is not None and best.fit is not None and best.accepted


def _promising(diagnosis: Diagnosis) -> Ranked | None:
    """The single effect that removes most of those that the held-out recording alone refuses.

    What removes much in training can lack a share of both only by the held-out recording.
    """
    refused = [
        row
        for row in diagnosis.ranking
        if row.fit is not None and row.kind is Kind.EFFECT and row.drop_train >= PROMISES
        and {HELD_OUT_REASON} <= {*row.reasons} <= {HELD_OUT_REASON, SHARE_REASON}
        and row.candidate.singles == (row.candidate,)
    ]  # fmt: skip
    return max(refused, key=lambda row: row.drop_train, default=None)


def _further(done: Rounds, step: Addition, asked: _Asked) -> Rounds:
    """What a refused effect and the next one after it do together; as it was where they fail."""
    asked.progress(f"one round further with {step.candidate.name}")
    tried, without = done.added(step), done.diagnoses[-1].base_validation
    current = assembled(tried.rig, tried.steps)
    second = asked.diagnosis(current)
    if second.contradicted or not _accepts(second):
        return done
    both = tried.told(second).added(accept(current, second))
    if not plain_ratio(without, both.kept.validation) < 1.0 - LEAST_HELD_OUT:
        return done  # better than with a bad one alone, but no better than without
    passes = Passes(done.rig, asked.train, asked.validation, {}, asked.progress)
    removal, _ = passes.removal(both.kept, step)
    if removal.dropped:
        return done
    asked.progress(f"accepted {step.candidate.name} and {second.ranking[0].candidate.name}")
    return both
