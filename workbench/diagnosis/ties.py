"""Ties: what a recording cannot tell apart, and which of these leads (diagnosis.md 1.6, 1.7)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from workbench.diagnosis.judge import (
    LEAST_HELD_OUT,
    LITTLE_LEFT,
    clearly_less,
    leaves_clearly_less,
    left_held_out,
    predicts,
    reasons_against,
)
from workbench.diagnosis.near_priors import left_of_both, near_priors
from workbench.diagnosis.refit import Refit, surplus
from workbench.diagnosis.scan import Profile
from workbench.diagnosis.size import DISTINCT
from workbench.fitting.problem import Problem

LARGEST_TIE = 3
SAME_DIRECTION = 0.9  # cosine of two signatures that are one
CLOSE_DROP = 0.25  # of the leader's drop: within it the order is not to be trusted
CLOSE_DROP_SAME = 0.50  # the same for signatures that are one
FAR_WORSE = 3.0  # times the misfit that is left of a recording: beyond, that one tells them apart

Nearer = Callable[[Problem, Refit], Refit]  # a rival where nuisances hardly move


def tie_group(
    problem: Problem,
    refits: list[Refit],
    profiles: dict[str, Profile],
    nearer: Nearer = near_priors,
) -> list[Refit]:
    """The leader and those that cannot be told from it, the leader first.

    A candidate is tied when its drop comes within a quarter of the best, or within half of it with
    a signature in the same direction: then only the nuisances decide between the two, and on the
    held-out recording too, unless one leaves several times as much of the misfit of either, as a
    fifth where the other leaves only noise, or fails to predict by more than a few held-out
    windows.  Among the tied those that pass every criterion come first, effects before parameters
    that would lie far off what is known of them, unless these leave clearly less of either
    recording, and among these the one leads with the least left of both recordings together, where
    nuisances may hardly bend for any: either recording alone orders rivals by what its few events
    happen to show, and where nuisances are free, what is left tells how far they bent.  But where
    one leaves at least a fifth less of the held-out misfit, and not in a few windows alone, free
    and near the priors, that recording
    decides.  Those that look most like the leader stand next to it: were it wrong, it would stand
    for one of them.

    Source: diagnosis.md 1.6.
    """
    tied = _close(refits, profiles)
    against = {id(each): bool(reasons_against(problem.base, each)) for each in tied}
    tied.sort(key=lambda each: against[id(each)])
    sound = [each for each in tied if not against[id(each)]] or tied[:LARGEST_TIE]
    tied = tied[: max(len(sound), LARGEST_TIE)]
    leader = _leader(problem, _may_lead(sound, profiles), nearer)
    others = [each for each in tied if each is not leader]
    others.sort(key=lambda r: (r not in sound, -abs(_alignment_of(leader, r, profiles))))
    return [leader, *others]


def _close(refits: Sequence[Refit], profiles: Mapping[str, Profile]) -> list[Refit]:
    """The first, the best in training of what is sound, and those that cannot be told from it."""
    best, *others = refits
    tied = [best]
    for other in others:
        gap = (best.drop_train - other.drop_train) / max(best.drop_train, 1e-12)
        same = abs(_alignment_of(best, other, profiles)) > SAME_DIRECTION
        told_apart = predicts(best) and not predicts(other)
        if told_apart and not (same or _refused_by_few(other, best)):
            continue
        if _far_worse(other, best):
            continue
        if gap < (CLOSE_DROP_SAME if same else CLOSE_DROP):
            tied.append(other)
    return tied


def _may_lead(sound: Sequence[Refit], profiles: Mapping[str, Profile]) -> list[Refit]:
    """Effects, and of shifts (no profile) those that leave clearly less of both sets than these.

    A friction of which there is more than the rig says was told as one that grows with pressure.
    """
    effects = [each for each in sound if each.candidate.name in profiles]
    shifts = [each for each in sound if each.candidate.name not in profiles]
    return [*effects, *(s for s in shifts if all(_leaves_less_of_both(s, e) for e in effects))]


def _leaves_less_of_both(one: Refit, other: Refit) -> bool:
    return leaves_clearly_less(one.drop_train, other.drop_train) and leaves_clearly_less(
        one.drop_validation, other.drop_validation
    )


def _far_worse(other: Refit, best: Refit) -> bool:
    """True where one recording tells another from the best: it leaves several times as much.

    The training recording does so where the held-out one does not speak for the other.
    """
    ours, theirs = (left_held_out(each) for each in (best, other))
    if theirs > FAR_WORSE * max(ours, LITTLE_LEFT):
        return True
    most = FAR_WORSE * max(1.0 - best.drop_train, LITTLE_LEFT)
    return 1.0 - other.drop_train > most and theirs >= ours


def _leader(problem: Problem, effects: Sequence[Refit], nearer: Nearer) -> Refit:
    """Which of the tied leads; see :func:`tie_group`."""
    may_lead = [each for each in effects if predicts(each)] or effects
    if len(may_lead) == 1:
        return may_lead[0]
    near = [nearer(problem, each) for each in may_lead]
    rows = range(len(may_lead))
    leads = min(rows, key=lambda k: left_of_both(near[k]))
    closest = min(rows, key=lambda k: left_held_out(may_lead[k]))
    pairs = ((each[closest], each[leads]) for each in (may_lead, near))
    apart = all(_told_apart_held_out(one, other) for one, other in pairs)
    return may_lead[closest if apart else leads]


def _told_apart_held_out(one: Refit, other: Refit) -> bool:
    """True where one leaves clearly less held out, by more than chance among windows explains."""
    if one.validation is None or other.validation is None:
        return False
    clearly = clearly_less(left_held_out(one), left_held_out(other))
    return clearly and surplus(one.validation, other.validation) > DISTINCT


def _refused_by_few(other: Refit, best: Refit) -> bool:
    """True where single held-out windows alone refuse what explains clearly more in training.

    Where no window counts too much it predicts better than without, and not clearly worse than the
    leader: so it may well be what the leader stands for.
    """
    if not other.drop_validation > LEAST_HELD_OUT:
        return False
    more = leaves_clearly_less(other.drop_train, best.drop_train)
    return more and not clearly_less(left_held_out(best), left_held_out(other))


def _alignment_of(one: Refit, other: Refit, profiles: Mapping[str, Profile]) -> float:
    """Cosine between two refitted candidates; 0 where one has no profile (a shift)."""
    a, b = profiles.get(one.candidate.name), profiles.get(other.candidate.name)
    return alignment(a, b) if a and b else 0.0


def alignment(one: Profile, other: Profile) -> float:
    """Cosine of the angle between two projected signatures, between -1 and 1."""
    a, b = one.signature, other.signature
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size > 0 else 0.0


def imitation(truth: Profile, other: Profile) -> float:
    """Share of the fall of the misfit by a truth that another would bring in its place.

    q = C^2, with C the cosine of their signatures; nothing where they point apart.

    Source: diagnosis.md 1.7.
    """
    return max(alignment(truth, other), 0.0) ** 2
