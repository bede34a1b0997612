"""What a fit knows of its parameters: posterior deviations, and the rig that carries them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isnan, nan
from types import MappingProxyType

import numpy as np

from workbench.fitting.gauss_newton import Fit
from workbench.fitting.linearised import Normal, normal_equations, rescaled
from workbench.law_range import seen_in
from workbench.rig import Rig
from workbench.rig_laws import Ranges, laws_of

FLAT = 0.98  # posterior over prior deviation: the recording says nothing of the parameter
FAR_MOVED = 2.0  # prior deviations: what moves more is worth a word


@dataclass(frozen=True)
class Moved:
    """One parameter before and after: values, posterior and prior standard deviations in SI.

    What was added has no prior: its ``prior_deviation`` is infinite.  What ended at a bound has no
    ``deviation``, NaN.  It is ``held`` where that is the end of what is believed of it alone, and
    not of its range.
    """

    name: str
    before: float
    after: float
    deviation: float
    prior_deviation: float
    held: bool = False

    @property
    def at_bound(self) -> bool:
        """True for what the fit holds at the end of its range, or of what is believed of it."""
        return isnan(self.deviation)

    @property
    def far(self) -> float:
        """How many prior standard deviations it moved, NaN for what had no prior."""
        if not 0.0 < self.prior_deviation < inf:
            return nan
        return abs(self.after - self.before) / self.prior_deviation


def posterior_deviation(fit: Fit) -> np.ndarray:
    """Standard deviation that is told of each unknown, (n_p,); see :func:`both_deviations`."""
    return both_deviations(fit)[0]


def both_deviations(
    fit: Fit, shaped_by: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations of the unknowns: those that are told, and the curvature's, each (n_p,).

    The curvature of the cost tells them by H^-1, where errors are as the scales tell them: these
    carry their correlation time.  Where the plant lacks something errors go together over many
    samples and outputs, and windows pull a parameter apart by more than that.  How far tells

        H^-1 (n / (n - 1) sum_l k_l sum_w g_w g_(w+l)' + Lambda) H^-1

    with g_w the gradient of each of the n windows, Lambda the weights of the prior and k_l from 1
    down to 0 over a few windows either way within a recording: what a plant has otherwise is alike
    in windows that follow one another.  The largest is told, of the curvature's, of this and of it
    without neighbours, and no more than the prior: of few windows products with the next may take
    some of it away again by chance.  What all windows have wrong alike none tells.  One that the
    fit holds at a bound has none, NaN.

    The curvature's deviation of a strength is that with the forms held that it is ``shaped_by``:
    where the strength is none no form can be known, so one that is hardly known says nothing of
    whether the strength is there.

    Source: White 1982, "Maximum likelihood estimation of misspecified models"; in groups of errors
    that go together, Liang and Zeger 1986; in groups that follow one another, Newey and West 1987
    and 1994, "Automatic lag selection in covariance matrix estimation"; of forms, Davies 1977 and
    1987, "Hypothesis testing when a nuisance parameter is present only under the alternative".
    """
    scale, prior = fit.unknowns.scale, fit.unknowns.precision
    if not len(fit.unknowns):
        return np.zeros(0), np.zeros(0)
    normal = _normal(fit)
    inverse = np.linalg.inv(normal.hessian)
    known = np.sqrt(np.maximum(np.diag(inverse), 0.0))
    known = np.where(normal.precision > 0.0, known, np.nan)
    most = np.fmax(1.0 / np.sqrt(np.maximum(prior, 1e-300)), known)
    pulls = _pulls(normal, [len(firsts) for firsts in fit.windows.firsts])
    spread = [np.sqrt(np.diag(inverse @ each @ inverse)) for each in pulls]
    told = np.clip(np.max(spread, axis=0), known, most)
    for name, forms in shaped_by.items():
        k = fit.unknowns.names.index(name)
        known[k] *= _share_held(normal.hessian, inverse, k, [*map(fit.unknowns.names.index, forms)])
    return told * scale, known * scale


def _share_held(hessian: np.ndarray, inverse: np.ndarray, k: int, forms: list[int]) -> float:
    """The deviation of one unknown with others held, over that with them free."""
    left = [row for row in range(len(hessian)) if row not in forms]
    held = np.linalg.inv(hessian[np.ix_(left, left)])
    place = left.index(k)
    return float(np.sqrt(held[place, place] / inverse[k, k]))


def _pulls(normal: Normal, counts: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Covariance of the gradient, of the windows as they differ and of the prior, (n_p, n_p).

    Of windows one by one, and with their neighbours.  ``counts`` are windows of each recording, one
    after the other.
    """
    by_window = np.einsum("wrp,wr->wp", normal.derivatives, normal.residual)
    n = len(by_window)
    lags = int(4.0 * (n / 100.0) ** (2.0 / 9.0))  # Newey and West 1994, for Bartlett's weights
    alone = by_window.T @ by_window
    pulls = alone.copy()
    for own in np.split(by_window, np.cumsum(counts)[:-1]):
        for lag in range(1, min(lags, len(own) - 1) + 1):
            both = own[lag:].T @ own[:-lag]
            pulls += (1.0 - lag / (lags + 1.0)) * (both + both.T)
    prior = np.diag(normal.precision)
    alone, pulls = (n / max(n - 1, 1) * each + prior for each in (alone, pulls))
    return alone, pulls


def posterior_covariance(fit: Fit) -> np.ndarray:
    """Covariance of the scaled unknowns from the curvature of the cost, shape (n_p, n_p).

    One that the fit holds at a bound is as uncertain as its scale there, and of no other.
    """
    if not len(fit.unknowns):
        return np.zeros((0, 0))
    return np.linalg.inv(_normal(fit).hessian)


def _normal(fit: Fit) -> Normal:
    """The quadratic model of the cost where a fit ended.

    Residuals are weighted by the error model of this very fit: the scales that it was fitted with
    may belong to a plant that lacked something and was far worse.
    """
    at = rescaled(fit.derivatives, fit.windows, fit.windows.rescaled(fit.residual))
    return normal_equations(at, fit.unknowns)


def fitted_rig(rig: Rig, fit: Fit, added: Sequence[str] = ()) -> Rig:
    """The rig at fitted values with their standard deviations, and where its law was seen.

    What is held by what is believed of it is known no better than before: it keeps its deviation.
    """
    ours = rig.plant.values
    found = fit.unknowns.values(fit.point.t)
    values = {name: value for name, value in found.items() if name in ours}
    deviations = dict(zip(fit.unknowns.names, posterior_deviation(fit).tolist(), strict=True))
    deviations |= {each.name: each.prior_deviation for each in held_back(fit)}
    return replace(
        rig.with_added(rig.plant.with_values(values), added),
        deviations={**rig.deviations, **{n: d for n, d in deviations.items() if 0 < d < inf}},
        seen=_seen(rig, fit),
    )


def _seen(rig: Rig, fit: Fit) -> Ranges:
    """Where the empirical law of a rig was seen: where the recordings go that it was fitted to.

    A fit that leaves all terms as they are, such as one of the mass alone, tells nothing of them.
    """
    laws = laws_of(rig.plant)
    moved = any(name.startswith(f"{law.name}.") for law in laws for name in fit.unknowns.names)
    return seen_in(rig.plant, fit.windows.recordings) if moved else rig.seen


def strained(fit: Fit) -> tuple[Moved, ...]:
    """What a fit took far from what was known of it."""
    return tuple(each for each in moved_parameters(fit) if each.far > FAR_MOVED)


def held_back(fit: Fit) -> tuple[Moved, ...]:
    """What would go further, were it not for what is believed of it."""
    return tuple(row for row in moved_parameters(fit) if row.held)


def moved_parameters(fit: Fit) -> tuple[Moved, ...]:
    """What a fit moved, with standard deviations."""
    unknowns, deviations = fit.unknowns, posterior_deviation(fit)
    found = []
    for k, name in enumerate(unknowns.names):
        after, deviation = fit.plant.values[name], float(deviations[k])
        prior_deviation = float(unknowns.scale[k]) if unknowns.precision[k] >= 1.0 else inf
        held = isnan(deviation) and bool(unknowns.lower[k] < after < unknowns.upper[k])
        found.append(Moved(name, float(unknowns.prior[k]), after, deviation, prior_deviation, held))
    return tuple(found)
