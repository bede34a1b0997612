"""Sizes of what a refit found, and how surely they are known."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

from workbench.fitting.gauss_newton import Fit
from workbench.fitting.posterior import both_deviations

DISTINCT = 2.0  # standard deviations


@dataclass(frozen=True)
class Size:
    """A fitted strength or form in SI, with its standard deviation.

    ``curvature`` is what the curvature of the cost alone tells of that, of a strength with its
    forms as they are; NaN where it is not asked.
    """

    value: float
    deviation: float
    curvature: float = nan


def sizes(fit: Fit, names: tuple[str, ...]) -> dict[str, Size]:
    """Values and posterior standard deviations of fitted parameters."""
    told, curvature = both_deviations(fit, _forms(fit, names))
    values = fit.unknowns.values(fit.point.t)
    index = {name: k for k, name in enumerate(fit.unknowns.names)}
    return {
        n: Size(values[n], float(told[index[n]]), float(curvature[index[n]]))
        for n in names
        if n in index
    }


def _forms(fit: Fit, names: tuple[str, ...]) -> dict[str, list[str]]:
    """The fitted forms of each of the names that is a strength."""
    fitted = fit.unknowns.names
    found = {
        each.strength: [form for form in each.forms if form in fitted]
        for each in fit.windows.plant.candidates.values()
        if each.strength in names and each.strength in fitted
    }
    return {strength: forms for strength, forms in found.items() if forms}


def distinct(size: Size, null: float = 0.0) -> bool:
    """True where a fitted size is no less than two of its standard deviations from ``null``.

    They are those of the curvature: whether windows differ in a size is asked of those held out,
    since of a few nobody knows how far they are apart.  At a bound there is no deviation (NaN) and
    nothing to refuse: a lag that is all there ends at the whole of itself, and bounds that a size
    may not reach have a criterion of their own.
    """
    return not abs(size.value - null) < DISTINCT * size.curvature
