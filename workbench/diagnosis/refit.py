"""Refits of the best few: the candidate in the plant, everything nominal free again.

Each begins where its first fit (:mod:`workbench.diagnosis.rough`) ended (diagnosis.md 1.5).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.rough import KEPT, Rough, windows_for, with_shape
from workbench.diagnosis.scan import Profile
from workbench.diagnosis.shifts import Shift
from workbench.diagnosis.size import Size, sizes
from workbench.fitting.beyond_noise import beyond_noise, fall_beyond_noise
from workbench.fitting.continued import continued
from workbench.fitting.costs import best_of_each, points_costs
from workbench.fitting.error_model import OUTLYING
from workbench.fitting.errors import plain_chance, plain_ratio
from workbench.fitting.gauss_newton import Fit, fit_windows, leap
from workbench.fitting.linearised import Point
from workbench.fitting.problem import Problem, fitted_twice, training_drop
from workbench.fitting.pulled_in import pulled_in
from workbench.fitting.resized import points_of_sizes
from workbench.fitting.shaken import shaken
from workbench.fitting.start_states import carried
from workbench.fitting.unknowns import WIDE, Unknowns
from workbench.fitting.windows import Windows

ITERATIONS = 10
# Factors on a fitted strength or form.  Near break-aways the cost is rough, and a Gauss-Newton step
# in all unknowns at once may find no way down where a step in the strength alone does.
PROBES = (0.4, 0.6, 0.8, 0.9, 1.15, 1.4, 1.8, 2.5)
FIRST_ITERATIONS = 4  # of a shift, before it is followed or left
FAR_BEHIND = 0.4  # of the best share so far: a shift below it is not followed further

Begun = tuple[Windows, Unknowns, np.ndarray]  # windows with a candidate, what may move, and where


@dataclass(frozen=True)
class Refit:
    """A candidate in the plant, fitted and validated.

    size                strength and forms with standard deviations, by full parameter name
    drop_train          share of the misfit beyond noise that goes away, and
    drop_validation     the same on held-out recordings, where no window counts too much
    plain_validation    held-out squared error over that of the base, nothing capped, as the
                        geometric mean over outputs
    plain_chance        standard deviation of its logarithm, by chance among windows
    """

    candidate: Candidate
    fit: Fit
    validation: Fit | None
    size: dict[str, Size]
    drop_train: float
    drop_validation: float
    plain_validation: float
    plain_chance: float = 0.0


def refit(problem: Problem, begun: Rough) -> Refit:
    """Fit a candidate from where its first fit ended, and validate it."""
    base, candidate = problem.base, begun.profile.candidate
    windows, unknowns = begun.fit.windows, begun.fit.unknowns
    names = (candidate.strength, *candidate.forms)
    probes = [begun.fit.point, *points_of_sizes(begun.fit, names, PROBES)]
    start = points_costs(windows, unknowns, probes).best
    fit = fit_windows(windows, unknowns, start, ITERATIONS)
    if fit.cost > base.cost:  # a poor start: go on from the base, where it is absent
        values = {**windows.plant.values, **base.plant.values}
        starts = carried(base.point.starts, base.windows, windows)
        absent = Point(unknowns.clipped(unknowns.scaled(values)), starts)
        fit = fit_windows(windows, unknowns, absent, ITERATIONS)
    return _refit(problem, candidate, fit, names)


def refit_from(
    problem: Problem, candidate: Candidate, values: Mapping[str, float], near: Fit | None = None
) -> Refit:
    """Fit a candidate from where a fit of the same effects ended, by its parameter values.

    ``near`` is a fit on the same windows whose start states are taken where they suit better than
    those of the base.
    """
    begun = _begun_at(problem, candidate, values)
    fit = _fitted_near(begun, (problem.base, near) if near else (problem.base,))
    return _refit(problem, candidate, fit, (candidate.strength, *candidate.forms))


def _fitted_near(begun: Begun, fits: Sequence[Fit]) -> Fit:
    """A fit whose windows begin with the start states of one of these fits, as suits each."""
    windows, unknowns, t = begun
    points = [Point(t, carried(each.point.starts, each.windows, windows)) for each in fits]
    start = best_of_each(points_costs(windows, unknowns, points).rows)
    return fit_windows(windows, unknowns, start, ITERATIONS)


def _begun_at(problem: Problem, candidate: Candidate, values: Mapping[str, float]) -> Begun:
    """Windows with a candidate, what may move, and the scaled unknowns of parameter values."""
    windows = windows_for(problem, candidate)
    unknowns = problem.unknowns(windows.plant, candidate)
    shapes = [f"{c.member}.{key}" for c in candidate.singles for key in c.cause.shapes]
    told = {name: values[name] for name in shapes if name in values}
    unknowns = with_shape(problem, unknowns, told)
    t = unknowns.clipped(unknowns.scaled({**windows.plant.values, **values}))
    return windows, unknowns, t


def refit_from_priors(problem: Problem, profile: Profile) -> Refit:
    """Fit a candidate with its best size of a scan from the priors, from there, and validate it.

    So far from the base errors are many times those that its weights tell, and a fit may rest where
    it is lost by them: beside it one begins as a prior fit does, weighed by its own errors.  Start
    states that suited the base may not suit the plant either; earlier windows give others.
    """
    candidate, nominal = profile.candidate, problem.base.unknowns.values(problem.at_priors)
    values = {**nominal, **profile.trials[0].values}
    begun = windows, unknowns, t = _begun_at(problem, candidate, values)
    own = fit_windows(windows, unknowns, fitted_twice(windows, unknowns, t).point, ITERATIONS)
    fits = [continued(each, ITERATIONS) for each in (_fitted_near(begun, [problem.base]), own)]
    fit = min(fits, key=lambda each: each.cost)
    return _refit(problem, candidate, fit, (candidate.strength, *candidate.forms))


def refit_shaken(problem: Problem, found: Refit) -> Refit:
    """A refit, or a lower one from starts of earlier windows, nearer to the priors, or beside it.

    See :mod:`workbench.fitting.continued`, :mod:`workbench.fitting.pulled_in` and
    :mod:`workbench.fitting.shaken`.
    """
    nearer = pulled_in(continued(found.fit, ITERATIONS), ITERATIONS)
    fit = shaken(continued(nearer, ITERATIONS), ITERATIONS)
    return found if fit is found.fit else _refit(problem, found.candidate, fit, tuple(found.size))


def refit_shift(problem: Problem, shift: Shift, to_beat: float = 0.0) -> Refit:
    """Fit with the prior of one parameter taken away, and validate it.

    Where others have bent to imitate what was held at an end, every small step from there costs
    more: a shift that keeps little of what it promised begins again where the linear model has it.
    One that soon removes far less than ``to_beat``, the share of another refit, is left there.
    """
    base = problem.base
    row = base.unknowns.names.index(shift.name)
    precision = base.unknowns.precision.copy()
    precision[row] *= WIDE**-2
    unknowns = replace(base.unknowns, precision=precision)
    fit = fit_windows(base.windows, unknowns, base.point, FIRST_ITERATIONS, problem.linearised)
    if base.cost - fit.cost < KEPT * shift.drop * problem.misfit:
        begun = leap(replace(base, unknowns=unknowns))
        again = fit_windows(base.windows, unknowns, begun, FIRST_ITERATIONS)
        fit = min(fit, again, key=lambda each: each.cost)
    if base.cost - fit.cost > FAR_BEHIND * to_beat * problem.misfit:
        left = ITERATIONS - FIRST_ITERATIONS
        fit = fit_windows(base.windows, unknowns, fit.point, left, fit.derivatives)
    return _refit(problem, shift.candidate, fit, (shift.name,))


def _refit(problem: Problem, candidate: Candidate, fit: Fit, names: tuple[str, ...]) -> Refit:
    """A fit with a candidate, validated and measured against the base."""
    found = Refit(candidate, fit, problem.validated(fit), sizes(fit, names), nan, nan, nan)
    return counted_from(problem.base, problem.base_validation, found)


def counted_from(base: Fit, held_out: Fit | None, found: Refit) -> Refit:
    """The same refit, measured against a base on the training and on the held-out windows."""
    return replace(
        found,
        drop_train=training_drop(base, found.fit),
        drop_validation=held_out_drop(held_out, found.validation),
        plain_validation=plain_ratio(held_out, found.validation),
        plain_chance=plain_chance(held_out, found.validation),
    )


def held_out_drop(before: Fit | None, after: Fit | None) -> float:
    """Share of the held-out misfit that went away, NaN without both.

    No window counts more than an outlying one may: parameters are frozen there, and one break-away
    at the wrong instant would outweigh everything else.
    """
    if before is None or after is None:
        return float("nan")
    fall = fall_beyond_noise(before.windows, _bounded_squares(before), _bounded_squares(after))
    return fall / held_out_misfit(before)


def held_out_misfit(fit: Fit | None) -> float:
    """Squared error beyond noise of what is held out, no window counted too much; 0 without any."""
    return beyond_noise(fit.windows, _bounded_squares(fit), 0.0) if fit else 0.0


def surplus(one: Fit, other: Fit) -> float:
    """What another fit misses more of the held-out windows, in standard deviations by chance.

    Windows are a sample of what may be recorded: sum d / sqrt(n var d), with d their differences.
    One alone says nothing of chance: 0.
    """
    more = np.sum(_bounded_squares(other) - _bounded_squares(one), axis=0)
    if len(more) < 2:
        return 0.0
    return float(np.sum(more) / max(np.sqrt(len(more)) * np.std(more), 1e-300))


def bounded_error(fit: Fit) -> float:
    """Squared error of a fit, no window counted more than an outlying one."""
    return float(np.sum(_bounded_squares(fit)))


def _bounded_squares(fit: Fit) -> np.ndarray:
    """Squared error of each output and window up to that of an outlying one, (n_y, n_windows).

    One is worth its recorded samples over the correlation time of their errors.
    """
    windows = fit.windows
    recorded = (windows.weight > 0).sum(axis=2)
    return np.minimum(fit.squares, OUTLYING**2 * recorded / windows.correlation)
