"""Whether to believe a refit: four criteria, ties, and the verdict in words (diagnosis.md 1.6).

With tens of thousands of correlated samples everything is "significant", so significance is not
the criterion.  A candidate is accepted when

1. the effective-sample BIC falls by more than 4: scales already carry the correlation time, so
   dBIC = dchi2 / s2 - k ln(n_eff) with s2 the misfit per effective sample of the better model,
2. a held-out recording with frozen parameters is predicted better by more than 2 %, and its plain
   squared error, in which single windows may count for much, does not grow by more than 2 %;
   where only a few slow decays are held out, it does not grow by more than chance explains,
3. at least 20 % of the misfit beyond noise goes away, as the mean over training and held-out
   recordings and with no less than 10 % in training: less may stand for something else,
4. its size is inside its bounds, more than 3 % of typical, and more than two standard deviations
   from none, as the curvature of the cost tells these; of a parameter that is there already, from
   what is believed of it.

A pair pays for the parameters of both, takes twice the share, and both sizes must be sound.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isclose, isnan, log, sqrt

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.near_priors import left_near_priors
from workbench.diagnosis.refit import Refit, surplus
from workbench.diagnosis.result import Law, Ranked
from workbench.diagnosis.scan import Profile
from workbench.diagnosis.size import DISTINCT, distinct
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.own_errors import effective_by_output
from workbench.fitting.problem import Problem
from workbench.fitting.window_length import moves

LEAST_BIC = 4.0
LEAST_HELD_OUT = 0.02
MOST_PLAIN = 1.02
LEAST_SHARE = 0.20
LEAST_TRAINING = 0.10
LEAST_SIZE = 0.03
FEWEST_WINDOWS = 6  # held out, for recordings of what does not move to refuse anything
AT_BOUND = 1e-9  # relative: a value scaled and back is off by a rounding
LARGEST_TIE = 3
SAME_DIRECTION = 0.9  # cosine of two signatures that are one
CLOSE_DROP = 0.25  # of the leader's drop: within it the order is not to be trusted
CERTAIN_SHARE = 0.75  # an accepted candidate above it needs no comparison with a law
CLEARLY_LESS = 0.20  # of the held-out misfit that is left
CLOSE_DROP_SAME = 0.50  # the same for signatures that are one
FAR_WORSE = 3.0  # times the misfit that is left of a recording: beyond, that one tells them apart
LITTLE_LEFT = 0.05  # of a misfit: less is not compared
LEAST_PROXY = 0.05  # of the misfit: less stands for nothing

Left = Callable[[Problem, Refit], float]  # squared error that a rival leaves

HELD_OUT_REASON = "does not predict the held-out recording better"
SHARE_REASON = f"explains less than {LEAST_SHARE:.0%} of the misfit"


def reasons_against(base: Fit, refit: Refit, parameters: int = 0) -> tuple[str, ...]:
    """The criteria that a refit fails, in words; empty where it is accepted.

    ``parameters`` is how many more it has than the base: by default those of its candidate.
    """
    against = []
    count = parameters or 1 + len(refit.candidate.forms)
    if _bic_gain(base, refit.fit, count) <= LEAST_BIC:
        against.append("gains less than its parameters cost")
    if not predicts(refit):
        against.append(HELD_OUT_REASON)
    each = len(refit.candidate.singles)
    if share_removed(refit) < each * LEAST_SHARE or refit.drop_train < each * LEAST_TRAINING:
        against.append(SHARE_REASON if each == 1 else f"{SHARE_REASON} each")
    return (*against, *size_reasons(base, refit))


def predicts(refit: Refit) -> bool:
    """True where the held-out recording is predicted better, or there is none.

    A handful of windows refuses nothing that chance explains: the misfit of n independent samples
    is known to sqrt(2/n).
    """
    if isnan(refit.drop_validation):
        return True
    if too_few(refit.validation):
        chance = sqrt(2.0 / effective_samples(refit.validation))
        return refit.drop_validation > -chance and refit.plain_validation < 1.0 + chance
    grows = refit.plain_validation > MOST_PLAIN
    return refit.drop_validation > LEAST_HELD_OUT and not grows


def too_few(held_out: Fit | None) -> bool:
    """True where what is held out does not move and fills no more than a few windows.

    So it is with a decay slower than its recording, which is one window: a sensor that wanders by
    as much as the pressure falls says a few things in a minute, not six hundred.
    """
    if held_out is None or moves(held_out.windows.plant):
        return False
    return len(held_out.windows) < FEWEST_WINDOWS


def share_removed(found: Refit | Law | Ranked) -> float:
    """Share of the misfit that goes away, mean of training and held-out."""
    train = min(found.drop_train, 1.0)
    return train if isnan(found.drop_validation) else (train + min(found.drop_validation, 1.0)) / 2


def _bic_gain(base: Fit, fit: Fit, parameters: int) -> float:
    effective = max(effective_samples(base), 2.0)
    spread = max(fit.chi2 / effective, 1e-12)
    return (base.cost - fit.cost) / spread - parameters * log(effective)


def effective_samples(fit: Fit) -> float:
    """Recorded values over the correlation times of their errors."""
    return float(effective_by_output(fit.windows).sum())


def size_reasons(base: Fit, found: Refit | Ranked) -> list[str]:
    """Size criteria: not negligible, not at a bound."""
    return [why for each in found.candidate.singles for why in _reasons_of_size(base, found, each)]


def _reasons_of_size(base: Fit, found: Refit | Ranked, candidate: Candidate) -> list[str]:
    """Of what is there already, a shift, the size is how far it goes from what is believed."""
    name = candidate.strength if candidate.strength in found.size else candidate.held
    if name not in found.size or found.fit is None:
        return []
    known, there = found.fit.plant.parameters[name], base.unknowns
    absent = known.null or 0.0
    size, null = found.size[name].value, absent
    if name in there.names and there.with_prior[there.names.index(name)]:
        null = float(there.prior[there.names.index(name)])
    reasons = []
    if abs(size - null) < LEAST_SIZE * abs(known.typical):
        reasons.append("its size is negligible")
    elif not distinct(found.size[name], null):
        reasons.append("its size is not distinct from none")
    ends = (end for end in (known.lower, known.upper) if end not in (null, absent, known.typical))
    if any(isclose(size, end, rel_tol=AT_BOUND, abs_tol=0.0) for end in ends):
        reasons.append("its size is at a bound")
    return reasons


def tie_group(
    problem: Problem,
    refits: list[Refit],
    profiles: dict[str, Profile],
    left: Left = left_near_priors,
) -> list[Refit]:
    """The leader and those that cannot be told from it, the leader first.

    A candidate is tied when its drop comes within a quarter of the best, or within half of it with
    a signature in the same direction: then only the nuisances decide between the two, and on the
    held-out recording too, unless one leaves several times as much of the misfit of either, as a
    fifth where the other leaves only noise, or fails to predict by more than a few held-out
    windows.  Among the tied those that pass every criterion come first, effects before parameters
    that would lie far off what is known of them, and among these the one leads with the
    least ``left`` of both recordings together, where nuisances may hardly bend for any: either
    recording alone orders rivals by what its few events happen to show.  But where one leaves at
    least a fifth less of the held-out misfit, and not in a few windows alone, that recording
    decides.  And where the leader needs more than is usual of one that is always there and leaves
    hardly less than that one, the other leads.  Those that look most like the leader stand next to
    it: were it wrong, it would stand for one of them.

    Source: diagnosis.md 1.6; Vuong 1989, "Likelihood ratio tests for model selection and non-nested
    hypotheses", for what chance explains.
    """
    tied = _close(refits, profiles)
    against = {id(each): bool(reasons_against(problem.base, each)) for each in tied}
    tied.sort(key=lambda each: against[id(each)])
    sound = [each for each in tied if not against[id(each)]] or tied[:LARGEST_TIE]
    tied = tied[: max(len(sound), LARGEST_TIE)]
    effects = [each for each in sound if each.candidate.name in profiles] or sound
    leader = _leader(problem, effects, left)
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


def _far_worse(other: Refit, best: Refit) -> bool:
    """True where one recording tells another from the best: it leaves several times as much.

    The training recording does so where the held-out one does not speak for the other.
    """
    ours, theirs = (left_held_out(each) for each in (best, other))
    if theirs > FAR_WORSE * max(ours, LITTLE_LEFT):
        return True
    most = FAR_WORSE * max(1.0 - best.drop_train, LITTLE_LEFT)
    return 1.0 - other.drop_train > most and theirs >= ours


def _leader(problem: Problem, effects: Sequence[Refit], left: Left) -> Refit:
    """Which of the tied leads; see :func:`tie_group`."""
    may_lead = [each for each in effects if predicts(each)] or effects
    if len(may_lead) == 1:
        return may_lead[0]
    leader = min(may_lead, key=lambda each: left(problem, each))
    closest = min(may_lead, key=left_held_out)
    leader = closest if _told_apart_held_out(closest, leader) else leader
    return next((each for each in may_lead if _leans_on(leader, each)), leader)


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


def _leans_on(leader: Refit, other: Refit) -> bool:
    """True where a leader needs more of another than is usual, and leaves hardly less than it.

    A command delay of two milliseconds is in every fit: a tube that needs more than that, and makes
    the commands later still, is one more cause for what a longer delay explains alone.
    """
    name, unknowns = other.candidate.strength, leader.fit.unknowns
    if other is leader or not other.candidate.cause.tolerated or name not in unknowns.names:
        return False
    usual = leader.fit.point.t[unknowns.names.index(name)] < 1.0
    sides = ((1.0 - share_removed(each), left_held_out(each)) for each in (leader, other))
    ours, theirs = ([max(left, LITTLE_LEFT) for left in each] for each in sides)
    return not usual and not any(map(clearly_less, ours, theirs))


def clearly_less(left: float, than: float) -> bool:
    """True where one share of a misfit is smaller than another by a fifth at least."""
    return left < (1.0 - CLEARLY_LESS) * than


def leaves_clearly_less(drop: float, other: float) -> bool:
    """True where what removes one share leaves clearly less than what removes another.

    What is left of a misfit is not known to a twentieth of it: below that all leave as little.
    """
    return clearly_less(max(1.0 - drop, LITTLE_LEFT), max(1.0 - other, LITTLE_LEFT))


def left_held_out(each: Refit | Ranked) -> float:
    """Share of the held-out misfit that is left, at least one percent."""
    return 1.0 if isnan(each.drop_validation) else max(1.0 - each.drop_validation, 0.01)


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
