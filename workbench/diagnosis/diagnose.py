"""One round of diagnosis: which physical effect is missing.

Prior fit, projected profile scan over the catalogue, first fits of the few that it puts in front,
refits of the best few, pairs where single effects fail, judgement on a held-out recording, ties,
and the verdict in words.  Nothing is changed and nothing is written.

Source: diagnosis.md 1.2 to 1.9.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from workbench.comparison.regimes import regime_shares
from workbench.consistency import trusted
from workbench.diagnosis.credible import credible
from workbench.diagnosis.evidence import WARNINGS, held_out, weighed
from workbench.diagnosis.follow import follow
from workbench.diagnosis.judge import (
    CERTAIN_SHARE,
    SHARE_REASON,
    clearly_less,
    leaves_clearly_less,
    left_held_out,
    share_removed,
)
from workbench.diagnosis.law import better_base, empirical_law, standing
from workbench.diagnosis.law_told import settled_law
from workbench.diagnosis.located import Where
from workbench.diagnosis.next_recording import recommended
from workbench.diagnosis.pairs import with_pairs
from workbench.diagnosis.ranking import ranked
from workbench.diagnosis.result import (
    NAMING,
    Diagnosis,
    Evidence,
    Law,
    Ranked,
    Verdict,
)
from workbench.diagnosis.scan import Profile
from workbench.diagnosis.settle import with_settled_sizes
from workbench.diagnosis.told_apart import told_apart
from workbench.diagnosis.verdict import (
    far_above_noise,
    held,
    judged,
    more_missing,
    not_converged,
    refused_rivals,
    sentence,
    too_short,
    too_short_text,
    unexplained,
    unsteady,
    worsened,
)
from workbench.diagnosis.warned import Warned
from workbench.diagnosis.where import locate
from workbench.diagnosis.where_stateless import of_residual
from workbench.effect import Kind
from workbench.fitting.errors import errors_of
from workbench.fitting.posterior import strained
from workbench.fitting.problem import BELIEVED, Problem, improved_base, pose
from workbench.fitting.windows import MOST_WINDOWS
from workbench.recording import Recording
from workbench.rig import Rig

MOST_SHARE = 0.5  # of the misfit: beside an effect that leaves more there may be a law
KEEPS = 0.75  # of its drop in training, held out: an effect that keeps less may be an imitation

Progress = Callable[[str], None]


def silent(message: str) -> None:
    """Progress that nobody reads."""


def diagnose(
    rig: Rig,
    train: Sequence[Recording],
    validation: Sequence[Recording] = (),
    progress: Progress = silent,
    most_windows: int = MOST_WINDOWS,
) -> Diagnosis:
    """Which effect of the catalogue is missing, judged on held-out recordings.

    Without ``validation`` the last third of each recording is held out, and nothing is called found
    but told as one of a tie, with a warning; so it is where a recording stands in both, or one is
    doubtful (see :mod:`workbench.consistency`).  ``most_windows`` bounds the windows that are
    fitted: fewer are faster.  What is there goes no further than what is believed of it
    (:data:`workbench.fitting.problem.BELIEVED`); what would go on is among the ``strained``.

    Raises
    ------
    InputError
        If a recording contradicts the rig so plainly that nothing can be concluded from it.
    ValueError
        If the recordings are too short for a window or show no noise.
    """
    progress("the recordings against the rig")
    (train, validation), doubts = trusted(rig, train, validation)
    warned = tuple(Warned(str(doubt)) for doubt in doubts)
    train, validation, evidence = held_out(train, validation)
    problem = pose(rig, train, validation, most_windows, BELIEVED, progress)
    evidence = weighed(evidence, problem.base_validation)
    if not evidence.strong:
        warned += (Warned(WARNINGS[evidence]),)
    progress("where it fails")
    where, begun = locate(problem, train), problem.base
    found = _asked_at_best(problem, where, progress)
    if not found.problem.base.converged:
        warned += (not_converged("the prior fit", "the ranking is provisional"),)
    if where and found.problem.base is not begun:
        where = replace(where, by_regime=regime_shares(found.problem.base))
    where = where or of_residual(found.problem.base)
    told = _concluded(rig.name, found, where, evidence, progress)
    told = credible(replace(told, warned=warned + told.warned), doubts)
    told = replace(told, where=_where_told(problem, train, told.where, told.law))
    unsure = unsteady(told.ranking, found.profiles, told.verdict)
    told = replace(told, warned=told.warned + unsure)
    if told.contradicted and not told.too_short:
        return told
    asked = recommended(found.problem, told.verdict, told.ranking, progress)
    return replace(told, next_recording=asked)


def _where_told(
    problem: Problem, train: Sequence[Recording], where: Where | None, law: Law | None
) -> Where | None:
    """The missing term in the balance of a law that is told; else where the smoother puts it.

    They differ where outputs tell more of another balance, sample by sample, than of the law's own.
    """
    if law is None or where is None or where.balance in law.balances:
        return where
    own = locate(problem, train, law.balances)
    return replace(own, by_regime=where.by_regime) if own else where


@dataclass(frozen=True)
class _Asked:
    """The problem with its last prior fit, the scan and the ranking at it, and the law."""

    problem: Problem
    profiles: list[Profile]
    ranking: tuple[Ranked, ...]
    law: Law | None


def _asked_at_best(problem: Problem, where: Where | None, progress: Progress) -> _Asked:
    """All of it; once more where the law finds a better prior fit."""
    found = _asked(problem, where, progress)
    better = better_base(found.problem, found.law)
    if not better:
        return found
    progress("the prior fit is improved by what the law found: once more")
    found = _asked(better, where, progress)
    return replace(found, law=standing(found.problem, found.law))


def _asked(problem: Problem, where: Where | None, progress: Progress) -> _Asked:
    """The catalogue, pairs and a law; once more where the refits find a better prior fit."""
    followed = follow(problem, where, progress)
    better = improved_base(problem, [each.fit for each in followed.refits])
    if better:
        progress("the prior fit is improved by what the refits found: once more")
        problem, followed = better, follow(better, where, progress, followed.refits)
    profiles = followed.profiles
    progress("the order of what does the same")
    ranking = ranked(problem, profiles, followed.refits, followed.moved, followed.begun)
    ranking = with_pairs(problem, ranking, profiles, progress)
    law = _law(problem, ranking, profiles, where, progress)
    return _Asked(problem, profiles, ranking, law)


def _law(
    problem: Problem,
    ranking: tuple[Ranked, ...],
    profiles: list[Profile],
    where: Where | None,
    progress: Progress,
) -> Law | None:
    """An empirical law, unless an effect of the catalogue explains most of the misfit already.

    A parameter that leaves its prior is no such effect: it may well imitate the law.  So the law
    is to leave a fifth less than every effect, and only less than the best shift; what fails
    another criterion than its share is no rival.  The scan of an effect that leaves half, or keeps
    little of its drop on what is held out, bars no law, and neither does a share that a whole crowd
    removes: a sagging cable is a force to four sensors, and its curve is what they leave.  A pair
    is as free as a law is, and bars none either: an offset and a scale of one sensor followed a
    bypass valve.

    A law is an unknown input to a balance: where none of them gains by any course of one there is
    none, and what a law removes is what small differences leave near the noise.
    """
    if where is not None and not where.certain:
        return None
    leader = ranking[0] if ranking else None
    certain = leader and leader.accepted and leader.kind is Kind.EFFECT
    alone = leader and not leader.crowd and len(leader.candidate.singles) == 1
    if certain and alone and share_removed(leader) >= CERTAIN_SHARE:
        return None
    progress("empirical law")
    most = certain and share_removed(leader) >= MOST_SHARE
    keeps = most and not leader.drop_validation < KEEPS * leader.drop_train
    led_by = (p.drop for p in profiles if keeps and p.candidate == leader.candidate)
    law = empirical_law(problem, profiles, max(led_by, default=0.0), None if most else where)
    followed = [r for r in ranking if r.accepted or r.reasons == (SHARE_REASON,)]
    effects = [r for r in followed if r.kind is Kind.EFFECT]
    shift = max((r.drop_train for r in followed if r.kind is Kind.PARAMETER), default=0.0)
    if law is None or not _leaves_less(law, effects):
        return None
    return law if law.drop_train > shift else None


def _leaves_less(law: Law, effects: Sequence[Ranked]) -> bool:
    """True where a law leaves a fifth less than every effect in training.

    Or of what is held out, with no more left in training: where next to nothing is left there by
    both, nobody can tell a fifth of it.
    """
    best = max((each.drop_train for each in effects), default=0.0)
    if leaves_clearly_less(law.drop_train, best):
        return True
    least = min(map(left_held_out, effects), default=0.0)
    return law.drop_train > best and clearly_less(left_held_out(law), least)


def _concluded(
    rig_name: str, found: _Asked, where: Where | None, evidence: Evidence, progress: Progress
) -> Diagnosis:
    """What is said of it, with warnings of what it rests on."""
    problem, ranking, law = found.problem, found.ranking, found.law
    far = far_above_noise(problem.base_validation)
    verdict = judged(ranking, law, evidence.strong, far)
    short = too_short(problem.base) and (law is not None or verdict in NAMING)
    said = too_short_text(problem.base) if short else ""
    if short:
        verdict, law = Verdict.RECORDING_TOO_WEAK, None
    if verdict in NAMING or (ranking and ranking[0].accepted):
        progress("sizes of what is named")
        ranking = with_settled_sizes(problem, ranking)
        if law is None and not short:
            ranking = told_apart(ranking)
            verdict = judged(ranking, None, evidence.strong, far)
    if law:
        progress("sizes of the law")
        law = settled_law(problem, law)
    best = ranking[0] if verdict in NAMING else None
    named = law or best
    left = far_above_noise(named.validation if named else None)
    warned = unexplained(far, verdict, ranking) or more_missing(left, named)
    warned += refused_rivals(ranking, best)
    if best and best.fit and not best.fit.converged:
        what = f"the refit with {best.candidate.name}"
        warned = (not_converged(what, "its size may be off"), *warned)
    last, unseen = (named.fit, named.validation) if named else (None, None)
    before = errors_of(problem.base, problem.base_validation)
    after = errors_of(last, unseen) if last else {}
    warned += (*worsened(before, after), *held(last or problem.base))
    return Diagnosis(
        rig_name=rig_name,
        verdict=verdict,
        sentence=said or sentence(verdict, ranking, law, evidence),
        ranking=ranking,
        where=where,
        before=before,
        after=after,
        law=law,
        warned=warned,
        base=problem.base,
        base_validation=problem.base_validation,
        evidence=evidence,
        contradicted=short,
        too_short=short,
        strained=strained(problem.base),
    )
