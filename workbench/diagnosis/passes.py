"""Second thoughts on what was accepted: is each effect still needed, and is it the right one.

Forward selection judges an effect against the model of its round.  What came later may have made it
needless, or may have turned the scales for a rival.  So in the end each is taken out once, all else
is fitted again, and it is put back: the criteria of its round must hold again (backward pass).  But
held out, errors are weighed there as by a model that misses far more: what is refused by that alone
stays where both errors grow without it.  At the same place its rivals are tried, and one that is
clearly better in training and held out takes its place (swap pass).

Source: diagnosis.md 1.10.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import nan

from workbench.candidate import Candidate
from workbench.diagnosis.addition import Addition, assembled, refitted_addition
from workbench.diagnosis.diagnose import Progress
from workbench.diagnosis.evidence import weighed
from workbench.diagnosis.judge import (
    CLEARLY_LESS,
    held_out_refuses,
    leaves_clearly_less,
    reasons_against,
)
from workbench.diagnosis.put_back import fitted_without, in_its_place
from workbench.diagnosis.refit import Refit
from workbench.diagnosis.result import Diagnosis, Evidence, Ranked
from workbench.effect import Kind
from workbench.fitting.errors import per_sample
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.problem import BELIEVED, Problem, pose
from workbench.recording import Recording
from workbench.rig import Rig

MOST_RIVALS = 2


@dataclass(frozen=True)
class Removal:
    """One accepted effect taken out of the final model and put back.

    share_train, share_validation
        Of the misfit of the fitted model without it: what it removes.  NaN where it was not put
        back, or where this says the opposite of both errors.
    reasons
        The criteria that it fails there, or why it stays without them; empty where it earns its
        place.
    dropped
        True where it was left out.
    """

    candidate: Candidate
    share_train: float
    share_validation: float
    reasons: tuple[str, ...]
    dropped: bool


@dataclass(frozen=True)
class Swap:
    """One accepted effect against a rival in its place, each share of the misfit without both.

    ``replaced`` is True where the rival took the place: then ``addition`` is that of the rival.
    ``leaves_more`` is True where it is clearly better there, and yet leaves more than what is kept.
    """

    candidate: Candidate
    rival: Candidate
    share_train: float
    share_validation: float
    rival_train: float
    rival_validation: float
    replaced: bool
    leaves_more: bool = False
    addition: Addition | None = field(default=None, repr=False)

    @property
    def clearly_worse(self) -> bool:
        """True where the rival leaves clearly more than what it was tried for, held out too."""
        pairs = (
            (self.share_train, self.rival_train),
            (self.share_validation, self.rival_validation),
        )
        return all(leaves_clearly_less(own, rival) for own, rival in pairs)


@dataclass(frozen=True)
class Kept:
    """The accepted effects as they stand: their additions, and the fit of all of them."""

    steps: tuple[Addition, ...]
    fit: Fit = field(repr=False)
    validation: Fit | None = field(repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Public names with their places."""
        return tuple(step.candidate.name for step in self.steps)

    def judged(self, step: Addition) -> bool:
        """True for what was accepted last: the model of its round is the final one without it.

        Of a pair neither half was judged so.
        """
        alone = all(each is step or each.fit is not step.fit for each in self.steps)
        return step is self.steps[-1] and step.fit is self.fit and alone

    def without(self, step: Addition) -> tuple[Addition, ...]:
        """All steps but one."""
        return tuple(each for each in self.steps if each is not step)


@dataclass(frozen=True)
class _Opened:
    """The final model without one effect, fitted, and the refit with it."""

    problem: Problem
    found: Refit


Opened = dict[tuple[str, ...], _Opened]


@dataclass(frozen=True)
class Passes:
    """Backward and swap pass over a rig: its recordings, and the diagnosis of each acceptance.

    ``diagnoses`` go by the public name of what was accepted; ``opened`` are the models without one
    effect that are fitted already, by its name and those that are kept.
    """

    rig: Rig
    train: Sequence[Recording]
    validation: Sequence[Recording]
    diagnoses: Mapping[str, Diagnosis]
    progress: Progress
    opened: Opened = field(default_factory=dict, repr=False)

    def in_turn(self, steps: Sequence[Addition]) -> tuple[Addition, ...]:
        """The order to ask in: as they came in, but each after those that mean nothing without it.

        So what is needed by one that goes is asked itself, when that one is gone.
        """
        left, order = list(steps), []
        while left:
            rests = ([*left[:k], *left[k + 1 :]] for k in range(len(left)))
            k = next((k for k, rest in enumerate(rests) if not self._needing(rest)), 0)
            order.append(left.pop(k))
        return tuple(order)

    def removal(self, kept: Kept, step: Addition) -> tuple[Removal, Kept]:
        """Take one effect out: whether it earns its place, and what is kept after that."""
        candidate, rest = step.candidate, kept.without(step)
        if needy := self._needing(rest):
            return Removal(candidate, nan, nan, (f"{needy} needs it",), False), kept
        if kept.judged(step):
            return Removal(candidate, step.drop_train, step.drop_validation, (), False), kept
        at = self._open(kept, step)
        found = at.found
        bare = Kept(rest, at.problem.base, at.problem.base_validation)
        against = reasons_against(bare.fit, found)
        if held_out_refuses(against) and leaves_more(kept, bare):
            return Removal(candidate, nan, nan, (_growth_text(kept, bare),), False), kept
        dropped = bool(against)
        removal = Removal(candidate, found.drop_train, found.drop_validation, against, dropped)
        return removal, bare if dropped else kept

    def swaps(self, kept: Kept, step: Addition) -> tuple[list[Swap], Kept]:
        """Try the rivals of one effect in its place; the first that is clearly better takes it.

        Both errors must not grow with it.  None is tried in the place of what another kept effect
        needs.
        """
        tried: list[Swap] = []
        if self._needing(kept.without(step)):
            return tried, kept
        for row in self._rivals(kept, step):
            if kept.judged(step):
                own = (step.drop_train, step.drop_validation)
                rival = (row.drop_train, row.drop_validation)
                tried.append(Swap(step.candidate, row.candidate, *own, *rival, False))
                continue
            at = self._open(kept, step)
            self.progress(f"{row.candidate.name} in place of {step.candidate.name}")
            found = in_its_place(at.problem, row.candidate)
            if found is None:
                continue
            clearly = clearly_better(at.problem.base, found, at.found)
            now = self._with(kept.without(step), at.problem, found) if clearly else kept
            grows = clearly and leaves_more(kept, now)
            better = clearly and not grows
            own = (at.found.drop_train, at.found.drop_validation)
            rival = (found.drop_train, found.drop_validation)
            tried.append(Swap(step.candidate, row.candidate, *own, *rival, better, grows))
            if better:
                tried[-1] = replace(tried[-1], addition=now.steps[-1])
                return tried, now
        return tried, kept

    def _needing(self, rest: Sequence[Addition]) -> str:
        """The name of a kept effect that means nothing without the one left out, if there is."""
        bare = assembled(self.rig, rest).plant
        return next((s.candidate.name for s in rest if not bare.ready_for(s.candidate)), "")

    def _open(self, kept: Kept, step: Addition) -> _Opened:
        """The final model without one effect, from its values too; two passes may ask for it."""
        key = (step.candidate.name, *kept.names)
        if key not in self.opened:
            self.progress(f"without {step.candidate.name}")
            bare = assembled(self.rig, kept.without(step))
            problem = pose(bare, self.train, self.validation, believed=BELIEVED)
            self.opened[key] = _Opened(*fitted_without(problem, step.candidate, kept.fit))
        return self.opened[key]

    def _rivals(self, kept: Kept, step: Addition) -> list[Ranked]:
        """Those tied with an effect in its round, else the best runner-up that was followed.

        A shift of a parameter is no rival of an effect: it may well imitate it.
        """
        found = self.diagnoses.get(step.candidate.name)
        if found is None:
            return []
        own = next(r for r in found.ranking if r.candidate.name == step.candidate.name)
        others = [
            row
            for row in found.ranking
            if row.fit is not None and row.candidate.name not in kept.names
            and row.candidate.singles == (row.candidate,) and row.kind in (Kind.EFFECT, own.kind)
        ]  # fmt: skip
        tied = [row for row in others if row.candidate.name in own.tied_with]
        return tied[:MOST_RIVALS] or others[:1]

    def _with(self, rest: tuple[Addition, ...], problem: Problem, found: Refit) -> Kept:
        """What is kept with a rival in the place of an effect, its size settled."""
        evidence = weighed(Evidence.VALIDATION, problem.base_validation)
        added = refitted_addition(assembled(self.rig, rest), problem, found, evidence)
        return Kept((*rest, added), added.fit, added.validation_fit)


def leaves_more(kept: Kept, other: Kept) -> bool:
    """Whether both errors grow with other effects, or without one, and one of them by a quarter.

    Errors over longer windows are no measure of those over shorter ones.
    """
    if kept.fit.windows.length != other.fit.windows.length:
        return False
    shares = [had / left for had, left in _errors_of(kept, other)]
    return max(shares) < 1.0 and min(shares) < 1.0 - CLEARLY_LESS


def _growth_text(kept: Kept, bare: Kept) -> str:
    """How both errors grow without an effect, in words."""
    (was, now), (was_held, now_held) = _errors_of(kept, bare)
    grows = f"without it chi2 per sample grows from {was:.4g} to {now:.4g} in training, from "
    return f"{grows}{was_held:.4g} to {now_held:.4g} held out"


def _errors_of(kept: Kept, other: Kept) -> list[tuple[float, float]]:
    """Errors per sample of both, in training and held out."""
    pairs = ((kept.fit, other.fit), (kept.validation, other.validation))
    return [(per_sample(had), per_sample(left)) for had, left in pairs]


def clearly_better(base: Fit, one: Refit, other: Refit) -> bool:
    """True where one passes every criterion and leaves a fifth less misfit, held out too."""
    ahead = leaves_clearly_less(one.drop_train, other.drop_train)
    ahead = ahead and leaves_clearly_less(one.drop_validation, other.drop_validation)
    return ahead and not reasons_against(base, one)
