"""What a diagnosis follows: the scan, first fits of the few in front, refits of the best few.

Those that come near the best are shaken, and rivals of a leader begin once more where it ended.
Where the prior fit has left the priors behind, what leads there is refitted from there too.

Source: diagnosis.md 1.4 and 1.5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from workbench.candidate import Candidate
from workbench.diagnosis.judge import (
    LEAST_PROXY,
    LEAST_SHARE,
    LEAST_TRAINING,
    SHARE_REASON,
    predicts,
    reasons_against,
    share_removed,
)
from workbench.diagnosis.located import Where
from workbench.diagnosis.refit import (
    Refit,
    counted_from,
    refit,
    refit_from,
    refit_from_priors,
    refit_shaken,
    refit_shift,
)
from workbench.diagnosis.rough import KEPT, Rough, rough_fit
from workbench.diagnosis.scan import Profile, scan_catalogue, scan_from_priors
from workbench.diagnosis.shifts import Shift, shifts
from workbench.diagnosis.ties import CLOSE_DROP_SAME, SAME_DIRECTION, alignment
from workbench.diagnosis.where import acts_in
from workbench.fitting.problem import Problem
from workbench.fitting.pulled_in import gone_far
from workbench.units import public_name

FITTED_FIRST = 8  # candidates that are followed beyond the scan at the most
WORTH_A_LOOK = 0.05  # of the best drop of the scan
REFITTED = 5  # of those, at the most
WORTH_A_REFIT = 0.4  # of the best share of the first fits
SHIFTS_REFITTED = 2  # parameters that leave their priors
WORTH_A_SHIFT = 0.25  # of the best refit
LOCATED = 2  # candidates that are followed because they act where the smoother finds a lack
IMITATED = 2  # candidates that are followed because they lead where no parameter has moved
IMPLAUSIBLE = 4.0  # prior deviations: one of 16 000 right values is further off
AS_MUCH = 0.5  # of the best drop where no parameter has moved
LEADERS = 2  # whose rivals are refitted from their places
LEAVES_MUCH = 0.5  # of the misfit removed: below it, rivals are refitted from the leader's place

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Followed:
    """Scan, shares that first fits removed, refits (best first), shifts of fitted parameters."""

    profiles: list[Profile]
    begun: dict[str, float]
    refits: list[Refit]
    moved: list[Shift]


def follow(
    problem: Problem, where: Where | None, progress: Progress, earlier: Sequence[Refit] = ()
) -> Followed:
    """Scan the catalogue and refit the best few.

    Refits from an ``earlier`` base on the same windows stay where they are lower: from another base
    the same candidate may end in a worse valley.
    """
    progress("scan of the catalogue")
    profiles = scan_catalogue(problem)
    imitated = scan_from_priors(problem)
    looked = _shortlist(profiles, where, imitated)
    progress(f"first fits of {len(looked)} candidates")
    begun = sorted((rough_fit(problem, p) for p in looked), key=lambda each: -each.share)
    refits: list[Refit] = []
    for each in _to_refit(begun, where):
        accepted = any(not reasons_against(problem.base, found) for found in refits)
        promising = each.share > WORTH_A_REFIT * begun[0].share
        hopeful = each.share > LEAST_TRAINING and (not accepted or _begun_there(each, where))
        if promising or hopeful or not refits:
            progress(f"refit with {each.profile.candidate.name}")
            refits.append(refit(problem, each))
    refits = _lowest(refits, _from_priors(problem, imitated, begun, refits, progress))
    moved = shifts(problem)
    for shift in _shifts_to_refit(moved, where, refits):
        progress(f"refit with {public_name(shift.name)} free")
        refits.append(refit_shift(problem, shift, _best_share(refits)))
    refits = _lowest_of_each(problem, refits, earlier)
    progress("the best once more from beside where they ended")
    refits = _best_first(problem, _shaken(problem, refits))
    led = None
    for _ in range(LEADERS):
        if refits and refits[0].candidate != led:
            led = refits[0].candidate
            refits = _from_the_leader(problem, refits, profiles, progress)
    shares = {each.profile.candidate.name: each.share for each in begun}
    return Followed(profiles, shares, refits, moved)


def _to_refit(begun: Sequence[Rough], where: Where | None) -> list[Rough]:
    """The best few first fits, and of the rest those that act where the smoother finds a lack.

    A constant force that a first fit leaves in a poor place is not to be lost behind four sensors.
    """
    there = [each for each in begun if _begun_there(each, where)][:LOCATED]
    return [b for k, b in enumerate(begun) if k < REFITTED or any(b is each for each in there)]


def _begun_there(begun: Rough, where: Where | None) -> bool:
    return _acts_there(begun.profile.candidate, where)


def _acts_there(candidate: Candidate, where: Where | None) -> bool:
    return where is not None and acts_in(candidate, where.balance)


def _shifts_to_refit(
    moved: Sequence[Shift], where: Where | None, refits: Sequence[Refit]
) -> list[Shift]:
    """The best of what leaves its prior and promises enough, or acts where something is lacking.

    What a shift promises is a guess of the linear model: of a friction that was held at a third of
    its size it said a fifth of the misfit, where nearly all of it was to go.
    """
    least = WORTH_A_SHIFT * max((each.drop_train for each in refits), default=0.0)

    def promising(each: Shift) -> bool:
        there = _acts_there(each.candidate, where) and each.drop > WORTH_A_LOOK
        return there or each.drop > least

    return [each for each in moved if each.leaves and promising(each)][:SHIFTS_REFITTED]


def _lowest_of_each(
    problem: Problem, refits: Sequence[Refit], earlier: Sequence[Refit]
) -> list[Refit]:
    """The lowest refit of every candidate, all measured from the base there is now."""
    base, held_out = problem.base, problem.base_validation
    return _lowest(refits, (counted_from(base, held_out, each) for each in earlier))


def _lowest(refits: Sequence[Refit], others: Iterable[Refit]) -> list[Refit]:
    """The lowest refit of every candidate of two lists, in the order in which they come up."""
    found = {each.candidate.name: each for each in refits}
    for each in others:
        name = each.candidate.name
        found[name] = min(found.get(name, each), each, key=lambda one: one.fit.cost)
    return [*found.values()]


def _from_priors(
    problem: Problem,
    imitated: Sequence[Profile],
    begun: Sequence[Rough],
    refits: Sequence[Refit],
    progress: Progress,
) -> Iterator[Refit]:
    """Refits of what leads where no parameter has moved, from there; none near the priors.

    Parameters that have gone as far as is believed may stand in for a delay together, and hold each
    other there: no first fit from the base gives one of them back.  Nearer, most first fits do; so
    there one that loses what leading promises is refitted, while all others leave much.
    """
    far = gone_far(problem.base, IMPLAUSIBLE)
    lost = gone_far(problem.base) and _best_share(refits) < LEAVES_MUCH
    kept = {each.profile.candidate.name: each.share for each in begun}
    for profile in imitated[:IMITATED]:
        if profile.drop <= AS_MUCH * imitated[0].drop:
            continue
        promised = profile.drop / problem.misfit
        loses = kept.get(profile.candidate.name, 0.0) < KEPT * min(promised, 1.0)
        if (far and promised > 1.0) or (lost and loses and promised > LEAST_SHARE):
            progress(f"refit with {profile.candidate.name} from the priors")
            yield refit_from_priors(problem, profile)


def _shaken(problem: Problem, refits: Sequence[Refit]) -> list[Refit]:
    """The refits, those that come near the best shaken out of shallow valleys."""
    near = CLOSE_DROP_SAME * max((each.drop_train for each in refits), default=0.0)
    return [refit_shaken(problem, r) if r.drop_train > near else r for r in refits]


def _best_first(problem: Problem, refits: Sequence[Refit]) -> list[Refit]:
    """The accepted ones first, then what fails by its share alone, then those that predict.

    Among these the largest drop first.
    """
    against = {id(each): reasons_against(problem.base, each) for each in refits}

    def order(each: Refit) -> tuple[int, bool, float]:
        small = against[id(each)] == (SHARE_REASON,) and share_removed(each) > LEAST_PROXY
        refused = 1 if small else 2
        return refused if against[id(each)] else 0, not predicts(each), -each.drop_train

    return sorted(refits, key=order)


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
            known = found.get(name)
            again = _beside(problem, leader, by_name[name], known)
            if known or again.drop_train > 0.0:  # above the base it tells nothing of a rival
                found[name] = min(again, known or again, key=lambda each: each.fit.cost)
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
