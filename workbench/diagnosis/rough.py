"""First fits of the candidates that a scan puts in front: a few steps each.

The scan is linear in the nuisances, and where they have moved far to imitate an effect its order is
not to be trusted.  A short fit with the derivatives of the base is cheap, and tells the few that
are worth a long one.  A fit from one poor start can end far from the minimum, and the scan
hands over good ones: its best sizes with the linear step of the nuisances, with more of it, and
with none, each tried and the best followed.  One that keeps little of what the scan promised begins
once more from a larger size, and where the base has gone far from the priors between the two.

Source: diagnosis.md 1.5; the idea of following many for a short time and few for long is that of
successive halving (Jamieson and Talwalkar 2016).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.blind_starts import blind_starts, settled
from workbench.diagnosis.scan import Profile, Trial
from workbench.fitting.costs import points_costs
from workbench.fitting.gauss_newton import Fit, fit_windows, follow
from workbench.fitting.linearised import Point, borrowed
from workbench.fitting.problem import Problem, staged, training_drop
from workbench.fitting.pulled_in import gone_far, towards_priors
from workbench.fitting.start_states import carried
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows

STARTS = 2  # sizes of the scan that are tried
SHARES = (2.0, 1.0, 0.5, 0.0)  # of the linear step of the nuisances that goes with each
ITERATIONS = 4
KEPT = 0.5  # of what the scan promised: a first fit that keeps less begins from other places too
WORTH_LARGER = 0.1  # of the misfit, that the scan must promise for that
NEARER = (0.7, 0.5)  # of the way from the priors to the base
WORTH_TRYING = 5.0  # times the cost of the best start


@dataclass(frozen=True)
class Rough:
    """The first fit of a candidate, and the share of the base's misfit that goes away."""

    profile: Profile
    fit: Fit
    share: float


def rough_fit(problem: Problem, profile: Profile, most: int = STARTS) -> Rough:
    """Fit the candidate of a profile from its best sizes, at most ``most``, in a few steps."""
    candidate, base = profile.candidate, problem.base
    windows = windows_for(problem, candidate)
    unknowns = problem.unknowns(windows.plant, *candidate.singles)
    unknowns = with_shape(problem, unknowns, profile.trials[0].values)
    blind = blind_starts(base.windows.plant, base.derivatives)
    started = _starts(problem, windows, unknowns, profile, most)
    if blind:
        started = [[settled(windows, unknowns, point) for point in each] for each in started]
    begun = [points_costs(windows, unknowns, points).best for points in started]
    most = WORTH_TRYING * min(each.cost for each in begun)
    tried = []
    known = (base.windows, base.unknowns)
    for start in (each for each in begun if each.cost <= most):
        if blind:
            tried.append(fit_windows(windows, unknowns, start, ITERATIONS))
            continue
        lent = (base.derivatives, known, windows, unknowns, start.point, start.residual)
        tried.append(follow(windows, unknowns, start, borrowed(*lent), ITERATIONS))
    fit = min(tried, key=lambda each: each.cost)
    worth = profile.drop > WORTH_LARGER * problem.misfit
    if worth and base.cost - fit.cost < KEPT * profile.drop:
        further = _from_larger(problem, windows, unknowns, profile)
        further += _from_nearer(problem, windows, unknowns, profile)
        fit = min((fit, *further), key=lambda each: each.cost)
    return Rough(profile, fit, training_drop(base, fit))


def _from_larger(
    problem: Problem, windows: Windows, unknowns: Unknowns, profile: Profile
) -> list[Fit]:
    """The fit from the next larger size of the scan, where there is one.

    A fit that keeps little of what the scan promised ended in a valley beside.  The scan is linear
    in the nuisances: where the base has moved them far to imitate what is missing, the size that
    it puts first is too small, and at the right one it sees a loss.
    """
    best = profile.trials[0]
    larger = sorted((t for t in profile.trials if _beyond(t, best)), key=lambda t: t.size)
    if not larger:
        return []
    points, _ = _starts(problem, windows, unknowns, replace(profile, trials=(larger[0],)), 1)
    start = points_costs(windows, unknowns, points).best
    return [fit_windows(windows, unknowns, start, 2 * ITERATIONS)]


def _from_nearer(
    problem: Problem, windows: Windows, unknowns: Unknowns, profile: Profile
) -> list[Fit]:
    """Fits from between the base and the priors, where the base has gone far from them.

    A base that imitates what is missing rests in a narrow valley beside the one of the effect: with
    the effect in its place no step leads out of it, and from the priors the way is long.
    """
    base = problem.base
    if not gone_far(base):
        return []
    fits = []
    for share in NEARER:
        between = towards_priors(base, share)
        trials = _distinct(profile.trials, STARTS)
        points = [_point(problem, windows, unknowns, between, trial) for trial in trials]
        start = points_costs(windows, unknowns, points).best
        fits.append(fit_windows(windows, unknowns, start, 2 * ITERATIONS))
    return fits


def _beyond(trial: Trial, best: Trial) -> bool:
    """True for a larger size of the same sign and shape."""
    strength = best.candidate.strength
    same = {k: v for k, v in best.values.items() if k != strength}
    alike = same.items() <= trial.values.items()
    return alike and trial.size > best.size and trial.values[strength] * best.values[strength] > 0


def windows_for(problem: Problem, candidate: Candidate) -> Windows:
    """The windows of the base, their plant with the states that a candidate needs."""
    windows = problem.base.windows
    if all(each.strength in windows.plant.values for each in candidate.singles):
        return windows
    needed = [c.member for c in (*problem.added, *candidate.singles)]
    return windows.with_plant(staged(problem.whole, *needed))


def with_shape(problem: Problem, unknowns: Unknowns, shape: Mapping[str, float]) -> Unknowns:
    """Shapes that no fit moves stay as they are told, those that the rig fixes as it has them."""
    settled = {*unknowns.names, *problem.rig.fixed}
    held = {name: value for name, value in shape.items() if name not in settled}
    return replace(unknowns, held={**unknowns.held, **held})


def _distinct(trials: tuple[Trial, ...], most: int) -> list[Trial]:
    """The best trial, and the next ones where the scan found them nearly as good."""
    chosen = [trials[0]]
    for trial in trials[1:]:
        if len(chosen) < most and trial.drop > 0.3 * trials[0].drop:
            chosen.append(trial)
    return chosen


def _starts(
    problem: Problem, windows: Windows, unknowns: Unknowns, profile: Profile, most: int
) -> tuple[list[Point], list[Point]]:
    """Points near the base, and points at the priors.

    Near the base: the best trials with more and less of the linear step of the nuisances.  At the
    priors: all trials, since the base may have moved its parameters to imitate what is missing, and
    then the size that is best there is too small.  How many deviations that are says nothing: under
    wide priors little does as much.
    """
    base, placed = problem.base, (problem, windows, unknowns)
    trials = _distinct(profile.trials, most)
    steps = [(t, share * t.nuisance) for t in trials for share in SHARES]
    near = [_point(*placed, base.point.t + step, trial) for trial, step in steps]
    return near, [_point(*placed, problem.at_priors, trial) for trial in profile.trials]


def _point(
    problem: Problem, windows: Windows, unknowns: Unknowns, t: np.ndarray, trial: Trial
) -> Point:
    """A size of a candidate with all else at scaled unknowns (n_p,) of the base."""
    base = problem.base
    nominal = base.unknowns.values(base.unknowns.clipped(t))
    values = {**windows.plant.values, **nominal, **trial.values}
    starts = carried(base.point.starts, base.windows, windows)
    return Point(unknowns.clipped(unknowns.scaled(values)), starts)
