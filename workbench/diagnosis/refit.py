"""Refits of the best few: the candidate in the plant, everything nominal free again.

A refit from one poor start can end far from the minimum, and the scan hands over good ones: its
best sizes with the linear step of the nuisances, and with none, each tried and the best followed
(diagnosis.md 1.5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.diagnosis.problem import Problem, misfit
from workbench.diagnosis.result import Size
from workbench.diagnosis.scan import Profile, Trial, staged
from workbench.fitting.gauss_newton import (
    Fit,
    Point,
    best_start,
    fit_windows,
    linearise,
    normal_equations,
)
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows
from workbench.plant import Candidate

STARTS = 3
ITERATIONS = 8


@dataclass(frozen=True)
class Refit:
    """A candidate in the plant, fitted and validated.

    size    strength and forms with standard deviations, by full parameter name
    """

    candidate: Candidate
    fit: Fit
    validation: Fit | None
    size: dict[str, Size]
    drop_train: float
    drop_validation: float


def refit(problem: Problem, profile: Profile) -> Refit:
    """Fit the candidate of a profile from its best sizes, and validate it."""
    candidate = profile.candidate
    windows = problem.base.windows
    if not any(member.name == candidate.member for member in windows.plant.members):
        needed = [c.member for c in problem.added] + [candidate.member]
        windows = windows.with_plant(staged(problem.whole, *needed))
    unknowns = problem.unknowns(windows.plant, candidate)
    starts = [
        _start(problem, windows, unknowns, trial, share)
        for trial in _distinct(profile.trials)
        for share in (1.0, 0.5, 0.0)
    ]
    fit = fit_windows(windows, unknowns, best_start(windows, unknowns, starts), ITERATIONS)
    validation = problem.validated(fit)
    return Refit(
        candidate=candidate,
        fit=fit,
        validation=validation,
        size=sizes(fit, (candidate.strength, *candidate.forms)),
        drop_train=_drop(problem.base, fit),
        drop_validation=_drop(problem.base_validation, validation),
    )


def sizes(fit: Fit, names: tuple[str, ...]) -> dict[str, Size]:
    """Values and posterior standard deviations of fitted parameters."""
    deviation = posterior_deviation(fit)
    values = fit.unknowns.values(fit.point.t)
    index = {name: k for k, name in enumerate(fit.unknowns.names)}
    return {n: Size(values[n], float(deviation[index[n]])) for n in names if n in index}


def posterior_deviation(fit: Fit) -> np.ndarray:
    """Standard deviation of each unknown from the curvature of the cost, shape (n_p,).

    Scales already carry the correlation time of the residuals, so no further inflation is due.
    """
    normal = normal_equations(linearise(fit.windows, fit.unknowns, fit.point), fit.unknowns)
    variance = np.diag(np.linalg.inv(normal.hessian)) if len(fit.unknowns) else np.zeros(0)
    return np.sqrt(np.maximum(variance, 0.0)) * fit.unknowns.scale


def _drop(before: Fit | None, after: Fit | None) -> float:
    """Share of the misfit beyond noise that went away, NaN without both."""
    if before is None or after is None:
        return float("nan")
    return (before.chi2 - after.chi2) / misfit(before)


def _distinct(trials: tuple[Trial, ...]) -> list[Trial]:
    """The best trials, and among them both signs and shapes where the scan had them."""
    chosen = [trials[0]]
    for trial in trials[1:]:
        if len(chosen) < STARTS and trial.drop > 0.3 * trials[0].drop:
            chosen.append(trial)
    return chosen


def _start(
    problem: Problem, windows: Windows, unknowns: Unknowns, trial: Trial, share: float
) -> Point:
    """Base values moved by a share of the trial's linear step, with the candidate at the trial's size."""
    base = problem.base
    moved = base.unknowns.clipped(base.point.t + share * trial.nuisance)
    values = {**windows.plant.values, **base.unknowns.values(moved), **trial.values}
    starts = windows.start.copy()
    names = list(windows.plant.state_list)
    for row, name in enumerate(base.windows.plant.state_list):
        starts[names.index(name)] = base.point.starts[row]
    return Point(unknowns.clipped(unknowns.scaled(values)), starts)
