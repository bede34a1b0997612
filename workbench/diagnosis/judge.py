"""Whether to believe a refit: four criteria (diagnosis.md 1.6).

With tens of thousands of correlated samples everything is "significant", so significance is not
the criterion.  A candidate is accepted when

1. the effective-sample BIC falls by more than 4: scales already carry the correlation time, so
   dBIC = dchi2 / s2 - k ln(n_eff) with s2 the misfit per effective sample of the better model and
   dchi2 what falls beyond noise (:mod:`workbench.fitting.beyond_noise`),
2. a held-out recording with frozen parameters is predicted better by more than 2 %, and its plain
   squared error, in which single windows may count for much, does not grow by more than 2 %, or
   by a quarter where chance among windows explains that; where only a few slow decays are held
   out, neither grows by more than chance,
3. at least 20 % of the misfit beyond noise goes away, as the mean over training and held-out
   recordings and with no less than 10 % in training: less may stand for something else,
4. its size is inside its bounds, more than 3 % of typical, and more than two standard deviations
   from none, as the curvature of the cost tells these with its forms held; of a parameter that is
   there already, from what is believed of it, which it is to leave by three of its deviations.

A pair pays for the parameters of both, takes twice the share, and both sizes must be sound.
"""

from __future__ import annotations

from collections.abc import Collection
from math import exp, isclose, isnan, log, sqrt

from workbench.candidate import Candidate
from workbench.diagnosis.refit import Refit
from workbench.diagnosis.result import Law, Ranked
from workbench.diagnosis.shifts import LEAVES_PRIOR, stays
from workbench.diagnosis.size import distinct
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.own_errors import effective_by_output
from workbench.fitting.problem import training_fall
from workbench.fitting.window_length import moves

LEAST_BIC = 4.0
LEAST_HELD_OUT = 0.02
MOST_PLAIN = 1.02
LEAST_SHARE = 0.20
LEAST_TRAINING = 0.10
LEAST_SIZE = 0.03
FEWEST_WINDOWS = 6  # held out, for recordings of what does not move to refuse anything
AT_BOUND = 1e-9  # relative: a value scaled and back is off by a rounding
CERTAIN_SHARE = 0.75  # an accepted candidate above it needs no comparison with a law
CLEARLY_LESS = 0.20  # of the held-out misfit that is left
LITTLE_LEFT = 0.05  # of a misfit: less is not compared
LEAST_PROXY = 0.05  # of the misfit: less stands for nothing

HELD_OUT_REASON = "does not predict the held-out recording better"
SIZE_REASON = "its size is not distinct from none"
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


def held_out_refuses(reasons: Collection[str]) -> bool:
    """True where the held-out recording alone refuses: a share of both is lacking by it only."""
    return {HELD_OUT_REASON} <= {*reasons} <= {HELD_OUT_REASON, SHARE_REASON}


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
    return refit.drop_validation > LEAST_HELD_OUT and not grows_plainly(refit)


def grows_plainly(found: Refit | Ranked) -> bool:
    """True where the plain held-out error grows, and not only a little by chance among windows.

    One break-away at another instant may outweigh all else: then the next recording may well say
    the opposite of this one.  But where a fifth of what is left then would be gone without it,
    whoever looks at the recordings sees it fail.
    """
    if clearly_less(1.0, found.plain_validation):
        return True
    return found.plain_validation > max(MOST_PLAIN, exp(found.plain_chance))


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
    return training_fall(base, fit) / spread - parameters * log(effective)


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
    size, null, least = found.size[name].value, absent, 0.0
    if name in there.names and there.with_prior[there.names.index(name)]:
        row = there.names.index(name)
        null, scale = float(there.prior[row]), float(there.scale[row])
        least = 0.0 if candidate.cause.tolerated else LEAVES_PRIOR * scale
    reasons = []
    if abs(size - null) < LEAST_SIZE * abs(known.typical):
        reasons.append("its size is negligible")
    elif abs(size - null) < least:
        reasons.append(stays(name))
    elif not distinct(found.size[name], null):
        reasons.append(SIZE_REASON)
    ends = (end for end in (known.lower, known.upper) if end not in (null, absent, known.typical))
    if any(isclose(size, end, rel_tol=AT_BOUND, abs_tol=0.0) for end in ends):
        reasons.append("its size is at a bound")
    return reasons


def clearly_less(left: float, than: float) -> bool:
    """True where one share of a misfit is smaller than another by a fifth at least."""
    return left < (1.0 - CLEARLY_LESS) * than


def leaves_clearly_less(drop: float, other: float) -> bool:
    """True where what removes one share leaves clearly less than what removes another.

    What is left of a misfit is not known to a twentieth of it: below that all leave as little.
    """
    return clearly_less(max(1.0 - drop, LITTLE_LEFT), max(1.0 - other, LITTLE_LEFT))


def left_held_out(each: Refit | Law | Ranked) -> float:
    """Share of the held-out misfit that is left, at least one percent."""
    return 1.0 if isnan(each.drop_validation) else max(1.0 - each.drop_validation, 0.01)
