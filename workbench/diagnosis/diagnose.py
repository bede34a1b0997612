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
from workbench.diagnosis.judge import (
    CERTAIN_SHARE,
    CLOSE_DROP_SAME,
    LEAST_TRAINING,
    SAME_DIRECTION,
    SHARE_REASON,
    alignment,
    clearly_less,
    predicts,
    reasons_against,
    share_removed,
)
from workbench.diagnosis.law import empirical_law
from workbench.diagnosis.next_recording import recommended
from workbench.diagnosis.pairs import with_pairs
from workbench.diagnosis.ranking import ranked
from workbench.diagnosis.refit import Refit, refit, refit_from, refit_shaken, refit_shift
from workbench.diagnosis.result import NAMING, Diagnosis, Law, Ranked, Where
from workbench.diagnosis.rough import Rough, rough_fit
from workbench.diagnosis.scan import Profile, scan_catalogue, scan_from_priors
from workbench.diagnosis.settle import with_settled_sizes
from workbench.diagnosis.shifts import Shift, shifts
from workbench.diagnosis.verdict import far_above_noise, judged, sentence, unexplained, unsteady
from workbench.diagnosis.where import acts_in, locate
from workbench.effect import Kind
from workbench.fitting.errors import errors_of
from workbench.fitting.posterior import strained
from workbench.fitting.problem import Problem, improved_base, pose
from workbench.fitting.windows import MOST_WINDOWS
from workbench.recording import Recording
from workbench.rig import Rig

FITTED_FIRST = 8  # candidates that are followed beyond the scan at the most
WORTH_A_LOOK = 0.05  # of the best drop of the scan
REFITTED = 5  # of those, at the most
WORTH_A_REFIT = 0.4  # of the best share of the first fits
SHIFTS_REFITTED = 2  # parameters that leave their priors
WORTH_A_SHIFT = 0.25  # of the best refit
LOCATED = 2  # candidates that are followed because they act where the smoother finds a lack
IMITATED = 2  # candidates that are followed because they lead where no parameter has moved
KEEPS = 0.75  # of its drop in training, held out: an effect that keeps less may be an imitation
LEADERS = 2  # whose rivals are refitted from their places
LEAVES_MUCH = 0.5  # of the misfit removed: below it, rivals are refitted from the leader's place

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

    Without ``validation`` the last third of each recording is held out, and the verdict is at most
    a tie, with a warning; so it is where a recording stands in both, or one is doubtful (see
    :mod:`workbench.consistency`).  ``most_windows`` bounds the windows that are fitted: fewer are
    faster.

    Raises
    ------
    InputError
        If a recording contradicts the rig so plainly that nothing can be concluded from it.
    ValueError
        If the recordings are too short for a window or show no noise.
    """
    progress("the recordings against the rig")
    (train, validation), doubts = trusted(rig, train, validation)
    warnings = tuple(map(str, doubts))
    train, validation, evidence = held_out(train, validation)
    progress("prior fit")
    problem = pose(rig, train, validation, most_windows)
    evidence = weighed(evidence, problem.base_validation)
    if not evidence.strong:
        warnings += (WARNINGS[evidence],)
    if not problem.base.converged:
        warnings += ("the prior fit did not converge: the ranking is provisional",)
    progress("where it fails")
    where = locate(problem, train)
    followed = _followed(problem, where, progress)
    better = improved_base(problem, [each.fit for each in followed.refits])
    if better:
        progress("the prior fit is improved by what the refits found: once more")
        problem = better
        where = where and replace(where, by_regime=regime_shares(problem.base))
        followed = _followed(problem, where, progress)
    profiles, refits, moved = followed.profiles, followed.refits, followed.moved
    ranking = ranked(problem, profiles, refits, moved, followed.begun)
    ranking = with_pairs(problem, ranking, profiles, progress)
    law = _law(problem, ranking, profiles, where, progress)
    far = far_above_noise(problem.base_validation)
    verdict = judged(ranking, law, evidence.strong, far)
    if verdict in NAMING or (ranking and ranking[0].accepted):
        progress("sizes of what is named")
        ranking = with_settled_sizes(problem, ranking)
    best = ranking[0] if verdict in NAMING else None
    if best and best.fit and not best.fit.converged:
        warnings += (f"the refit with {best.candidate.name} did not converge: its size may be off",)
    after = (law.fit, law.validation) if law else (best and best.fit, best and best.validation)
    warnings += unexplained(far, verdict, ranking)
    found = credible(
        Diagnosis(
            rig_name=rig.name,
            verdict=verdict,
            sentence=sentence(verdict, ranking, law, evidence),
            ranking=ranking,
            where=where,
            before=errors_of(problem.base, problem.base_validation),
            after=errors_of(*after) if after[0] else {},
            law=law,
            warnings=warnings,
            base=problem.base,
            base_validation=problem.base_validation,
            next_recording=recommended(problem, verdict, ranking, progress),
            evidence=evidence,
            strained=strained(problem.base),
        ),
        doubts,
    )
    return replace(found, warnings=found.warnings + unsteady(ranking, profiles, found.verdict))


@dataclass(frozen=True)
class _Followed:
    """Scan, shares that first fits removed, refits (best first), shifts of fitted parameters."""

    profiles: list[Profile]
    begun: dict[str, float]
    refits: list[Refit]
    moved: list[Shift]


def _followed(problem: Problem, where: Where | None, progress: Progress) -> _Followed:
    """Scan the catalogue and refit the best few."""
    progress("scan of the catalogue")
    profiles = scan_catalogue(problem)
    looked = _shortlist(profiles, where, scan_from_priors(problem))
    progress(f"first fits of {len(looked)} candidates")
    begun = sorted((rough_fit(problem, p) for p in looked), key=lambda each: -each.share)
    refits: list[Refit] = []
    for each in _to_refit(begun, where):
        accepted = any(not reasons_against(problem.base, found) for found in refits)
        promising = each.share > WORTH_A_REFIT * begun[0].share
        hopeful = each.share > LEAST_TRAINING and (not accepted or _acts_there(each, where))
        if promising or hopeful or not refits:
            progress(f"refit with {each.profile.candidate.name}")
            refits.append(refit(problem, each))
    moved = shifts(problem)
    least = WORTH_A_SHIFT * max((each.drop_train for each in refits), default=0.0)
    for shift in [each for each in moved if each.leaves and each.drop > least][:SHIFTS_REFITTED]:
        progress(f"refit with {shift.name} free")
        refits.append(refit_shift(problem, shift, _best_share(refits)))
    progress("the best once more from beside where they ended")
    refits = _best_first(problem, _shaken(problem, refits))
    led = None
    for _ in range(LEADERS):
        if refits and refits[0].candidate != led:
            led = refits[0].candidate
            refits = _from_the_leader(problem, refits, profiles, progress)
    shares = {each.profile.candidate.name: each.share for each in begun}
    return _Followed(profiles, shares, refits, moved)


def _to_refit(begun: Sequence[Rough], where: Where | None) -> list[Rough]:
    """The best few first fits, and of the rest those that act where the smoother finds a lack.

    A constant force that a first fit leaves in a poor place is not to be lost behind four sensors.
    """
    there = [each for each in begun if _acts_there(each, where)][:LOCATED]
    return [b for k, b in enumerate(begun) if k < REFITTED or any(b is each for each in there)]


def _acts_there(begun: Rough, where: Where | None) -> bool:
    return where is not None and acts_in(begun.profile.candidate, where.balance)


def _shaken(problem: Problem, refits: Sequence[Refit]) -> list[Refit]:
    """The refits, those that come near the best shaken out of shallow valleys."""
    near = CLOSE_DROP_SAME * max((each.drop_train for each in refits), default=0.0)
    return [refit_shaken(problem, r) if r.drop_train > near else r for r in refits]


def _best_first(problem: Problem, refits: Sequence[Refit]) -> list[Refit]:
    """The accepted ones first, then those that predict, the largest drop first."""
    against = {id(each): bool(reasons_against(problem.base, each)) for each in refits}
    return sorted(refits, key=lambda r: (against[id(r)], not predicts(r), -r.drop_train))


def _from_the_leader(
    problem: Problem, refits: list[Refit], profiles: Sequence[Profile], progress: Progress
) -> list[Refit]:
    """Refits with those of the leader's rivals that begin once more where it ended.

    Fits end in different valleys, and then the leader may lead by its place alone.  Rivals are
    effects that do the same as an accepted leader, and where it leaves much all that were
    refitted; shifts of fitted parameters begin at the base.
    """
    by_name = {profile.candidate.name: profile for profile in profiles}
    leader = refits[0] if refits else None
    own = by_name.get(leader.candidate.name) if leader else None
    if leader is None or own is None or reasons_against(problem.base, leader):
        return refits
    found = {each.candidate.name: each for each in refits}
    rivals = [name for name in found if name in by_name and leader.drop_train < LEAVES_MUCH]
    rivals += [n for n, p in by_name.items() if abs(alignment(own, p)) > SAME_DIRECTION]
    for name in dict.fromkeys(rivals):
        if name != leader.candidate.name:
            progress(f"refit with {name} from another place")
            again = _beside(problem, leader, by_name[name], found.get(name))
            found[name] = min((again, found.get(name, again)), key=lambda each: each.fit.cost)
    return _best_first(problem, [*found.values()])


def _beside(problem: Problem, leader: Refit, rival: Profile, known: Refit | None) -> Refit:
    """A rival refitted from where the leader ended, with its own size, or else that of the scan."""
    size = {name: each.value for name, each in known.size.items()} if known else {}
    own = {**rival.trials[0].values, **size}
    values = {**leader.fit.plant.values, **own}
    return refit_from(problem, rival.candidate, values, leader.fit)


def _shortlist(
    profiles: list[Profile], where: Where | None, from_priors: list[Profile]
) -> list[Profile]:
    """The best of the scan, of those that act in the balance that lacks something, of the priors.

    The first two fail on different effects (diagnosis.md 4.1).  ``from_priors`` sees what the
    prior fit imitates.
    """
    best = [p for p in profiles[:FITTED_FIRST] if p.drop > WORTH_A_LOOK * profiles[0].drop]
    there = [p for p in profiles if p.drop > 0.0 and where and acts_in(p.candidate, where.balance)]
    hidden = [p.candidate for p in from_priors[:IMITATED] if p.drop > 0.0]
    others = [*there[:LOCATED], *(p for p in profiles if p.candidate in hidden)]
    return best + [p for k, p in enumerate(others) if p not in best and p not in others[:k]]


def _best_share(refits: list[Refit]) -> float:
    """Share of the misfit that the best refit so far removes, held out too."""
    return max((each.drop_train for each in refits if predicts(each)), default=0.0)


def _law(
    problem: Problem,
    ranking: tuple[Ranked, ...],
    profiles: list[Profile],
    where: Where | None,
    progress: Progress,
) -> Law | None:
    """An empirical law, unless an effect of the catalogue explains most of the misfit already.

    A parameter that leaves its prior is no such effect: it may well imitate the law.  So the law
    is to leave a fifth less than the best effect, and only less than the best shift; what fails
    another criterion than its share is no rival.  The scan of an effect that keeps little of its
    drop on what is held out bars no law, and neither does a share that a whole crowd removes: a
    sagging cable is a force to four sensors, and its curve is what they leave.
    """
    leader = ranking[0] if ranking else None
    certain = leader and leader.accepted and leader.kind is Kind.EFFECT
    if leader and certain and not leader.crowd and share_removed(leader) >= CERTAIN_SHARE:
        return None
    progress("empirical law")
    keeps = certain and not leader.drop_validation < KEEPS * leader.drop_train
    led_by = (p.drop for p in profiles if keeps and p.candidate == leader.candidate)
    law = empirical_law(problem, profiles, max(led_by, default=0.0), None if certain else where)
    followed = [r for r in ranking if r.accepted or r.reasons == (SHARE_REASON,)]
    effect, shift = (
        max((r.drop_train for r in followed if r.kind is kind), default=0.0)
        for kind in (Kind.EFFECT, Kind.PARAMETER)
    )
    if law is None or not clearly_less(1.0 - law.drop_train, 1.0 - effect):
        return None
    return law if law.drop_train > shift else None
