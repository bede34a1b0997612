"""Rounds of diagnosis and addition: the forward part of :mod:`workbench.diagnosis.improve`.

A round adds what its diagnosis accepts first.  Where it accepts nothing, one effect may have failed
on the held-out recording alone because a second one is missing too: what imitates the second in
training misleads elsewhere.  So the effect that removes most, and at least half, is tried for one
round more.  So is one that passes every criterion where nothing is named, because what is left with
it contradicts the recording still: what else is missing may be as large.  Where that round accepts
another effect on top of it, the two come in as a pair: if together they pass the criteria for a
pair against the model without both and leave a fifth less held out, and each of them passes those
of a single effect on top of the other.

Source: diagnosis.md 1.9, 1.10 and 4.5 (accept, refit, scan again; judge the pair).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from workbench.candidate import Candidate, together
from workbench.consistency import trusted
from workbench.diagnosis.addition import (
    Addition,
    accept,
    addition_of,
    apart,
    assembled,
    refitted_addition,
)
from workbench.diagnosis.diagnose import Progress, diagnose
from workbench.diagnosis.improvement import Ahead, Change, Stage
from workbench.diagnosis.judge import (
    CLEARLY_LESS,
    HELD_OUT_REASON,
    clearly_less,
    held_out_refuses,
    left_held_out,
    reasons_against,
)
from workbench.diagnosis.passes import Kept, Opened, Passes, Removal, Swap
from workbench.diagnosis.refit import Refit, refit_from, refit_shaken
from workbench.diagnosis.result import Diagnosis, Law, Ranked
from workbench.effect import Kind
from workbench.fitting.errors import Errors, errors_of, per_sample
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.problem import posed
from workbench.fitting.start_states import as_it_came
from workbench.recording import Recording
from workbench.rig import Rig

MOST_ROUNDS = 8
PROMISES = 0.5  # of the misfit in training: an effect that removes less is not tried further
LESS = 0.98  # of the error that is left: a fit that leaves no less is as good as it was


@dataclass(frozen=True)
class Rounds:
    """How far the work has come.

    ``origins`` is the diagnosis by which each effect came in, by its public name; ``opened`` are
    models without one effect that are fitted already; ``came`` are errors of the rig as it came.
    ``left_out`` is an effect that the diagnosis before a law accepts and nothing adds; ``used_up``
    is True where the last round that there is added something.
    ``again`` are the fits of the last diagnosis where it fits the model of the last bar and lower.
    """

    rig: Rig
    kept: Kept | None = None
    steps: tuple[Addition, ...] = ()
    diagnoses: tuple[Diagnosis, ...] = ()
    removals: tuple[Removal, ...] = ()
    swaps: tuple[Swap, ...] = ()
    budget: tuple[Stage, ...] = ()
    ahead: tuple[Ahead, ...] = ()
    origins: Mapping[str, Diagnosis] = field(default_factory=dict, repr=False)
    opened: Opened = field(default_factory=dict, repr=False)
    law: Law | None = None
    stopped: bool = False
    used_up: bool = False
    left_out: str = ""
    came: Errors = field(default_factory=dict)
    again: tuple[Fit, Fit | None] | None = field(default=None, repr=False)

    @property
    def last_fit(self) -> tuple[Fit, Fit | None]:
        """The fits of what is kept, as low as the last bar."""
        return self.again or (self.kept.fit, self.kept.validation)

    def marked(self, label: str, fit: Fit, held_out: Fit | None, change: Change) -> Rounds:
        """The same with one more bar in the budget."""
        stage = Stage(label, per_sample(fit), per_sample(held_out), change)
        return replace(self, budget=(*self.budget, stage), again=None)

    def told(self, diagnosis: Diagnosis) -> Rounds:
        """The same with one more diagnosis.

        The first begins the budget: the rig as it came, then with its parameters refitted.
        """
        done = replace(self, diagnoses=(*self.diagnoses, diagnosis))
        if self.budget:
            return done
        refitted = (diagnosis.base, diagnosis.base_validation)
        came = as_it_came(*refitted)
        done = replace(done, came=errors_of(*came))
        done = done.marked(Change.START.value, *came, Change.START)
        return done.marked(Change.REFITTED.value, *refitted, Change.REFITTED)

    def fitted_again(self, diagnosis: Diagnosis) -> Rounds:
        """The same, the last bar as low as the next diagnosis begins.

        So no step is credited with what another fit of the model before it would give.  A diagnosis
        chooses its windows anew: errors over longer ones are no measure of those over shorter ones.
        """
        length = diagnosis.base.windows.length
        if self.kept is not None and self.kept.fit.windows.length != length:
            return self
        *earlier, last = self.budget
        fits = (diagnosis.base, diagnosis.base_validation)
        if not leaves_less(fits, (last.train, last.validation)):
            return self
        train, validation = map(per_sample, fits)
        lower = last._replace(train=train, validation=validation)
        return replace(self, budget=(*earlier, lower), again=fits)

    def looked(self, candidate: Candidate, outcome: str) -> Rounds:
        """The same with what came of trying an effect for one round more."""
        return replace(
            self, ahead=(*self.ahead, Ahead(len(self.diagnoses), candidate.name, outcome))
        )

    def added(self, step: Addition, *origins: Diagnosis) -> Rounds:
        """The same with one more addition, a pair as its two halves; each has an origin."""
        halves = apart(step)
        steps = (*self.steps, *halves)
        kept = Kept(steps, step.fit, step.validation_fit)
        names = (half.candidate.name for half in halves)
        known = {**self.origins, **dict(zip(names, origins, strict=True))}
        done = replace(self, steps=steps, kept=kept, origins=known)
        change = Change.SHIFTED if step.kind is Kind.PARAMETER else Change.ADDED
        return done.marked(f"+ {step.candidate.name}", step.fit, step.validation_fit, change)


@dataclass(frozen=True)
class _Asked:
    """What every round is judged on, as it was read: each diagnosis says what is doubtful in it."""

    train: Sequence[Recording]
    validation: Sequence[Recording]
    progress: Progress
    law: bool

    def diagnosis(self, rig: Rig) -> Diagnosis:
        """One round over a rig."""
        return diagnose(rig, self.train, self.validation, self.progress)


def forward(
    done: Rounds,
    train: Sequence[Recording],
    validation: Sequence[Recording],
    progress: Progress,
    law: bool,
) -> Rounds:
    """Rounds of diagnosis and addition, until nothing is accepted any more.

    With ``law`` an empirical law is taken in the end, and no shift comes in where one explains
    more.  An interrupt keeps what finished rounds added; before the first it is passed on.
    """
    asked = _Asked(train, validation, progress, law)
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
    progress(f"all {MOST_ROUNDS} rounds added something")
    return replace(done, used_up=True)


def _round(done: Rounds, asked: _Asked) -> Rounds:
    """One diagnosis, and what it adds; the same steps where that is nothing."""
    current = assembled(done.rig, done.steps)
    diagnosis = asked.diagnosis(current)
    done = done.told(diagnosis).fitted_again(diagnosis)
    if comes_first(diagnosis) if asked.law else accepts(diagnosis):
        asked.progress(f"accepted {diagnosis.ranking[0].candidate.name}")
        step = accept(current, diagnosis)
        return done.added(step, *(diagnosis for _ in step.candidate.singles))
    later, hopeful = done, _promising(diagnosis)
    if hopeful is not None:
        try:
            later = _further(done, current, hopeful, asked)
        except KeyboardInterrupt:
            asked.progress(f"stopped beside {hopeful.candidate.name}: what is finished stays")
            return replace(done, stopped=True)
    if diagnosis.contradicted and len(later.steps) == len(done.steps):
        asked.progress(f"stopped: {diagnosis.sentence}")
    return later


def leaves_less(fits: Sequence[Fit | None], errors: Sequence[float]) -> bool:
    """Whether fits on both sets leave clearly less than these errors per sample.

    A refit weighs errors as the model without its effect made them, and where that effect was large
    it ends before what is left counts for anything.  The next diagnosis fits the same model once
    more, weighed by its own errors.
    """
    pairs = zip(fits, errors, strict=True)
    return all(per_sample(fit) < LESS * error for fit, error in pairs)


def accepts(diagnosis: Diagnosis) -> bool:
    """True where the ranking puts something first that passes every criterion and may be added."""
    best = diagnosis.ranking[0] if diagnosis.ranking else None
    if best is None or diagnosis.contradicted:
        return False
    return best.fit is not None and best.accepted


def comes_first(diagnosis: Diagnosis) -> bool:
    """True where what is accepted is to come in before an empirical law that explains more.

    A physical effect is; a parameter that leaves its prior may well imitate the law.
    """
    return accepts(diagnosis) and not (
        diagnosis.law and diagnosis.ranking[0].kind is Kind.PARAMETER
    )


def _promising(diagnosis: Diagnosis) -> Ranked | None:
    """The single effect that removes most of those that the held-out recording alone refuses.

    What removes much in training can lack a share of both only by the held-out recording.  Where
    one that passes every criterion leads, and rig and recording contradict each other all the same,
    it is that one; what was fitted to too little promises nothing.
    """
    singles = [row for row in diagnosis.ranking if row.fit is not None and _is_effect(row)]
    if diagnosis.too_short:
        return None
    leading = [row for row in singles if row.accepted and row is diagnosis.ranking[0]]
    if leading:
        return leading[0]
    refused = [
        row for row in singles if row.drop_train >= PROMISES and held_out_refuses(row.reasons)
    ]
    return max(refused, key=lambda row: row.drop_train, default=None)


def _further(done: Rounds, current: Rig, row: Ranked, asked: _Asked) -> Rounds:
    """An effect with the next one that passes on top of it; as it was where they fail."""
    first, refused = done.diagnoses[-1], row.candidate
    asked.progress(f"one round further with {refused.name}")
    steps = (*done.steps, addition_of(current, first, row))
    second = asked.diagnosis(assembled(done.rig, steps))
    if not accepts(second) or not _is_effect(second.ranking[0]):
        return done.looked(refused, "no effect passes every criterion on top of it")
    leader = second.ranking[0]
    problem = posed(current, first.base, first.base_validation)
    pair = together(refused, leader.candidate)
    asked.progress(f"refit with {pair.name}")
    found = refit_shaken(problem, refit_from(problem, pair, leader.fit.plant.values))
    if against := _against_both(problem.base, found):
        return done.looked(refused, f"with {leader.candidate.name} it {'; '.join(against)}")
    step = refitted_addition(current, problem, found, first.evidence)
    both = done.told(second).added(step, first, second)
    if needless := _needless(both, asked):
        return done.looked(refused, f"with {leader.candidate.name}, {needless}")
    asked.progress(f"accepted {pair.name}")
    ahead = done.looked(refused, f"comes in with {leader.candidate.name}").ahead
    return replace(both, ahead=ahead)


def _needless(both: Rounds, asked: _Asked) -> str:
    """Which half of the pair added last fails a criterion on top of the other, and which one."""
    (train, validation), _ = trusted(both.rig, asked.train, asked.validation)
    passes = Passes(both.rig, train, validation, both.origins, asked.progress, both.opened)
    for half in both.kept.steps[-2:]:
        removal, _ = passes.removal(both.kept, half)
        if removal.dropped:
            return f"{half.candidate.name} {'; '.join(removal.reasons)}"
    return ""


def _against_both(base: Fit, found: Refit) -> tuple[str, ...]:
    """The criteria that a pair fails; it has to predict clearly better, as its half did not."""
    against = reasons_against(base, found)
    if against or clearly_less(left_held_out(found), 1.0):
        return against
    return (f"{HELD_OUT_REASON} by {CLEARLY_LESS:.0%}",)


def _is_effect(row: Ranked) -> bool:
    """True for a single effect: no pair, and no shift of a parameter."""
    return row.kind is Kind.EFFECT and row.candidate.singles == (row.candidate,)
