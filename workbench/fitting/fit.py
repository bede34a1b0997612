"""Parameter estimation with priors: what moved, how well it is known, what cannot be told apart."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from workbench.consistency import checked
from workbench.fitting.begun_anew import begun_anew
from workbench.fitting.errors import Errors, errors_of
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.no_worse import no_worse_than_it_came
from workbench.fitting.own_errors import by_own_errors
from workbench.fitting.posterior import (
    FLAT,
    fitted_rig,
    posterior_covariance,
    posterior_deviation,
)
from workbench.fitting.problem import NO_EVIDENCE, pose, proves_nothing
from workbench.fitting.short_windows import better_from_short_windows
from workbench.fitting.start_states import as_it_came
from workbench.fitting.unknowns import nominal_unknowns
from workbench.plant import require
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.units import public_name

AT_BOUND = 1e-9


@dataclass(frozen=True)
class FittedParameter:
    """One parameter: prior and posterior in SI.

    flat        the recording left its prior as it was
    at_bound    the fit pushed it to the end of its range

    An added cause has no prior: its deviation is infinite there.  One that the fit holds at a bound
    has no deviation after it, NaN.
    """

    name: str
    prior: float
    prior_deviation: float
    value: float
    deviation: float
    at_bound: bool
    flat: bool


@dataclass(frozen=True)
class FitReport:
    """A fitted rig: parameters, their correlations (n_p, n_p) and errors before and after."""

    rig: Rig
    rows: tuple[FittedParameter, ...]
    correlations: np.ndarray
    before: Errors
    after: Errors
    converged: bool
    fit: Fit = field(repr=False)
    validation_fit: Fit | None = field(default=None, repr=False)


def fit(
    rig: Rig,
    train: Sequence[Recording],
    validation: Sequence[Recording] = (),
    only: Sequence[str] = (),
    progress: Callable[[str], None] = lambda message: None,
) -> FitReport:
    """Fit what is uncertain in a rig, within its priors.

    ``only`` restricts the fit to the named parameters (full names); all others stay.  Everything
    in ``train`` is fitted: nothing is held out unless it comes as ``validation``.

    Raises
    ------
    UnknownNameError
        If ``only`` names what the plant does not have, with the nearest name.
    ValueError
        If ``only`` names nothing that is uncertain, or nothing at all is.
    """
    plant = rig.fit_for(train[0])
    require(only, plant.values, plant.name)
    if only:
        others = frozenset(name for name in plant.values if name not in only)
        asked = replace(rig, fixed=rig.fixed | others)
    else:
        asked = rig
    free = nominal_unknowns(plant, asked.deviations, asked.held, asked.added_to(plant)).names
    if not free:
        names = ", ".join(map(public_name, only)) or "the plant"
        counted = set(only) & (rig.held - rig.fixed)
        why = "is what gauge pressures count from" if counted else "is fixed or has no uncertainty"
        raise ValueError(f"nothing to fit: {names} {why} in {rig.name}")
    train, validation = checked(rig, train, validation)
    if proves_nothing(train, validation):
        warnings.warn(NO_EVIDENCE, stacklevel=2)
    progress("fit")
    problem = pose(asked, train, validation)
    progress("the same by its own errors, what went far begun anew at its prior")
    own = begun_anew(by_own_errors(problem.base))
    problem = problem if own is problem.base else problem.with_base(own)
    progress("from short windows, if that is better")
    problem = better_from_short_windows(problem, train)
    progress("no worse than it came")
    least = no_worse_than_it_came(problem.base)
    if least is not problem.base:
        problem = problem.with_base(no_worse_than_it_came(by_own_errors(least)))
    base = problem.base
    before = errors_of(*as_it_came(base, problem.base_validation))
    covariance = posterior_covariance(base)
    return FitReport(
        rig=fitted_rig(rig, base, ()),
        rows=_rows(base, covariance),
        correlations=_correlations(covariance),
        before=before,
        after=errors_of(base, problem.base_validation),
        converged=base.converged,
        fit=base,
        validation_fit=problem.base_validation,
    )


def _correlations(covariance: np.ndarray) -> np.ndarray:
    deviation = np.sqrt(np.diag(covariance))
    return covariance / np.outer(deviation, deviation)


def _rows(fit: Fit, covariance: np.ndarray) -> tuple[FittedParameter, ...]:
    unknowns, values = fit.unknowns, fit.plant.values
    curvature, deviation = np.sqrt(np.diag(covariance)), posterior_deviation(fit)
    rows = []
    for k, name in enumerate(unknowns.names):
        room = min(values[name] - unknowns.lower[k], unknowns.upper[k] - values[name])
        at_bound = bool(room <= AT_BOUND * unknowns.scale[k])
        believed = float(np.sqrt(unknowns.precision[k]))  # 1, or next to nothing
        rows.append(
            FittedParameter(
                name=name,
                prior=float(unknowns.prior[k]),
                prior_deviation=float(unknowns.scale[k]) if believed == 1.0 else float("inf"),
                value=values[name],
                deviation=float("nan") if at_bound else float(deviation[k]),
                at_bound=at_bound,
                flat=bool(curvature[k] * believed > FLAT) and not at_bound,
            )
        )
    return tuple(rows)
