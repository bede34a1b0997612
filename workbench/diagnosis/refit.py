"""Refits of the best few: the candidate in the plant, everything nominal free again.

A refit from one poor start can end far from the minimum, and the scan hands over good ones: its
best sizes with the linear step of the nuisances, and with none, each tried and the best followed
(diagnosis.md 1.5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from workbench.diagnosis.result import Size
from workbench.diagnosis.scan import Profile, Trial
from workbench.diagnosis.shifts import Shift
from workbench.fitting.error_model import OUTLYING
from workbench.fitting.errors import per_sample
from workbench.fitting.gauss_newton import Fit, best_start, fit_windows
from workbench.fitting.linearised import Linearised, Point, borrowed
from workbench.fitting.posterior import posterior_deviation
from workbench.fitting.problem import Problem, misfit, staged
from workbench.fitting.start_states import carried
from workbench.fitting.unknowns import WIDE, Unknowns
from workbench.fitting.windows import Windows
from workbench.plant import Candidate

STARTS = 2  # sizes of the scan that are tried
SHARES = (1.0, 0.5, 0.0)  # of the linear step of the nuisances that goes with each
FIRST_ITERATIONS = 4  # before other strengths are probed
ITERATIONS = 10
PROBES = (0.4, 0.6, 0.8, 0.9, 1.15, 1.4, 1.8, 2.5)  # factors on a fitted strength


@dataclass(frozen=True)
class Refit:
    """A candidate in the plant, fitted and validated.

    size                strength and forms with standard deviations, by full parameter name
    drop_train          share of the misfit beyond noise that goes away, and
    drop_validation     the same on held-out recordings, where no window counts too much
    plain_validation    held-out squared error over that of the base, nothing capped
    """

    candidate: Candidate
    fit: Fit
    validation: Fit | None
    size: dict[str, Size]
    drop_train: float
    drop_validation: float
    plain_validation: float


def refit(problem: Problem, profile: Profile) -> Refit:
    """Fit the candidate of a profile from its best sizes, and validate it."""
    candidate = profile.candidate
    windows = problem.base.windows
    if not any(member.name == candidate.member for member in windows.plant.members):
        needed = [c.member for c in problem.added] + [candidate.member]
        windows = windows.with_plant(staged(problem.whole, *needed))
    unknowns = _with_shape(problem, problem.unknowns(windows.plant, candidate), profile)
    tried = []
    for points in _starts(problem, windows, unknowns, profile):
        start = best_start(windows, unknowns, points)
        at = _nearby(problem, windows, unknowns, start)
        tried.append(fit_windows(windows, unknowns, start, FIRST_ITERATIONS, at))
    rough = min(tried, key=lambda each: each.cost)
    probed = best_start(windows, unknowns, _probes(rough, (candidate.strength, *candidate.forms)))
    fit = fit_windows(windows, unknowns, probed, ITERATIONS)
    if fit.cost > problem.base.cost:  # a poor start: go on from the base, where it is absent
        values = {**windows.plant.values, **problem.base.plant.values}
        starts = carried(problem.base.point.starts, problem.base.windows, windows)
        absent = Point(unknowns.clipped(unknowns.scaled(values)), starts)
        fit = fit_windows(windows, unknowns, absent, ITERATIONS)
    return _refit(problem, candidate, fit, (candidate.strength, *candidate.forms))


def _with_shape(problem: Problem, unknowns: Unknowns, profile: Profile) -> Unknowns:
    """Shapes that no fit moves stay as the best size of the scan had them."""
    settled = {*unknowns.names, *problem.rig.fixed}
    shape = {k: v for k, v in profile.trials[0].values.items() if k not in settled}
    return replace(unknowns, held={**unknowns.held, **shape})


def _nearby(
    problem: Problem, windows: Windows, unknowns: Unknowns, start: Point
) -> Linearised | None:
    """The base's derivatives with columns for what is new, where the states are the same."""
    if windows is not problem.base.windows:
        return None
    return borrowed(problem.linearised, problem.base.unknowns, windows, unknowns, start)


def refit_shift(problem: Problem, shift: Shift) -> Refit:
    """Fit with the prior of one parameter taken away, and validate it."""
    base = problem.base
    row = base.unknowns.names.index(shift.name)
    precision = base.unknowns.precision.copy()
    precision[row] *= WIDE**-2
    unknowns = replace(base.unknowns, precision=precision)
    fit = fit_windows(base.windows, unknowns, base.point, ITERATIONS, problem.linearised)
    return _refit(problem, shift.candidate, fit, (shift.name,))


def _refit(problem: Problem, candidate: Candidate, fit: Fit, names: tuple[str, ...]) -> Refit:
    """A fit with a candidate, validated and measured against the base."""
    before, validation = problem.base_validation, problem.validated(fit)
    return Refit(
        candidate=candidate,
        fit=fit,
        validation=validation,
        size=sizes(fit, names),
        drop_train=_drop(problem.base, fit),
        drop_validation=held_out_drop(before, validation),
        plain_validation=per_sample(validation) / per_sample(before),
    )


def _probes(fit: Fit, names: tuple[str, ...]) -> list[Point]:
    """The point of a fit and others with another strength or form: a way out of rough places.

    Near break-aways the cost is rough, and a Gauss-Newton step in all unknowns at once may find no
    way down where a step in the strength alone does.
    """
    probes = [fit.point]
    for row in (fit.unknowns.names.index(name) for name in names if name in fit.unknowns.names):
        at = fit.unknowns.prior[row] / fit.unknowns.scale[row] + fit.point.t[row]
        for factor in PROBES:
            t = fit.point.t.copy()
            t[row] += (factor - 1.0) * at
            probes.append(replace(fit.point, t=fit.unknowns.clipped(t)))
    return probes


def sizes(fit: Fit, names: tuple[str, ...]) -> dict[str, Size]:
    """Values and posterior standard deviations of fitted parameters."""
    deviation = posterior_deviation(fit)
    values = fit.unknowns.values(fit.point.t)
    index = {name: k for k, name in enumerate(fit.unknowns.names)}
    return {n: Size(values[n], float(deviation[index[n]])) for n in names if n in index}


def _drop(before: Fit | None, after: Fit | None) -> float:
    """Share of the misfit beyond noise that went away, NaN without both."""
    if before is None or after is None:
        return float("nan")
    return (before.cost - after.cost) / misfit(before)


def held_out_drop(before: Fit | None, after: Fit | None) -> float:
    """Share of the held-out misfit that went away, NaN without both.

    No window counts more than an outlying one may: parameters are frozen there, and one break-away
    at the wrong instant would outweigh everything else.
    """
    if before is None or after is None:
        return float("nan")
    gained = float(np.sum(_bounded(before)) - np.sum(_bounded(after)))
    return gained / max(float(np.sum(_bounded(before))) - before.windows.floor, 1.0)


def _bounded(fit: Fit) -> np.ndarray:
    """Squared error of each output and window up to that of an outlying one, (n_y, n_windows)."""
    windows = fit.windows
    squares = (fit.residual**2).sum(axis=2)
    return np.minimum(squares, OUTLYING**2 * windows.length / windows.correlation)


def _distinct(trials: tuple[Trial, ...]) -> list[Trial]:
    """The best trials, and among them both signs and shapes where the scan had them."""
    chosen = [trials[0]]
    for trial in trials[1:]:
        if len(chosen) < STARTS and trial.drop > 0.3 * trials[0].drop:
            chosen.append(trial)
    return chosen


def _starts(
    problem: Problem, windows: Windows, unknowns: Unknowns, profile: Profile
) -> tuple[list[Point], list[Point]]:
    """Points near the base, and points at the priors, for the best trials.

    Near the base: with more and less of the linear step of the nuisances.  At the priors: the base
    may have moved its parameters far to imitate what is missing.
    """
    base = problem.base
    starts = carried(base.point.starts, base.windows, windows)

    def point(t: np.ndarray, trial: Trial) -> Point:
        nominal = base.unknowns.values(base.unknowns.clipped(t))
        values = {**windows.plant.values, **nominal, **trial.values}
        return Point(unknowns.clipped(unknowns.scaled(values)), starts)

    trials = _distinct(profile.trials)
    near = [point(base.point.t + share * t.nuisance, t) for t in trials for share in SHARES]
    own = np.array([name in {c.strength for c in problem.added} for name in base.unknowns.names])
    prior = [point(np.where(own, base.point.t, 0.0), trial) for trial in trials]
    return near, prior
