"""A way out of shallow valleys: a fit begins again from points drawn about where it ended.

Where parts stick and break away the cost is rough: a step of a parameter by its own standard
deviation moves a break-away across a sample, and a fit may end in a dent above the valley's floor.
So sets of parameters are drawn from what the fit believes of them,

    t + s H^(-1/2) z,    z ~ N(0, I),

with H the curvature of the cost and s one deviation, then three; the start states of each window
follow as the linear model has them, or stay where that suits it better.  The cheapest is followed
with the derivatives that are known, and where that leads lower the fit goes on from there with its
own.  Seeds are fixed: the same recording gives the same fit.

Source: basin hopping, Wales and Doye 1997, "Global optimization by basin-hopping"; the steps are
those of the Laplace approximation.
"""

from __future__ import annotations

import numpy as np

from workbench.fitting.costs import costs_of_best_starts
from workbench.fitting.gauss_newton import Fit, beside, fit_windows, follow, worth_it
from workbench.fitting.linearised import Point, normal_equations, seen_at
from workbench.fitting.window_length import moves
from workbench.fitting.windows import position_alone

DRAWS = 16  # points of a round
SPREADS = (1.0, 3.0)  # posterior deviations, one round each
PASSES = 3  # over the spreads, while they lead lower
FURTHEST = 2.0  # of a scaled unknown
FOLLOWED = 4  # steps with known derivatives


def shaken(fit: Fit, iterations: int) -> Fit:
    """The same fit, or a lower one near it; ``iterations`` bound each fit that goes on.

    Where nothing moves nothing is rough, and where a position alone is recorded the linear model
    says too little of the pressures that a window starts with: there the fit stays.
    """
    plant = fit.windows.plant
    if not len(fit.unknowns) or not moves(plant) or position_alone(plant):
        return fit
    rng = np.random.default_rng(0)
    for _ in range(PASSES):
        before = fit
        for spread in SPREADS:
            fit = _lower(fit, points_about(fit, spread, rng), iterations)
        if fit is before:
            break
    return fit


def _lower(fit: Fit, points: list[Point], iterations: int) -> Fit:
    """The fit, or the one to which the cheapest of the points leads if it is lower."""
    windows, unknowns = fit.windows, fit.unknowns
    start = costs_of_best_starts(windows, unknowns, points, fit.point.starts).best
    at = seen_at(windows, fit.derivatives, start.point, start.residual)
    tried = follow(windows, unknowns, start, at, FOLLOWED)
    if not worth_it(tried.cost, fit):
        return fit
    return fit_windows(windows, unknowns, tried.point, iterations)


def points_about(fit: Fit, spread: float, rng: np.random.Generator) -> list[Point]:
    """Points drawn about a fit, ``spread`` deviations wide; what is held at a bound stays."""
    normal = normal_equations(fit.derivatives, fit.unknowns)
    values, directions = np.linalg.eigh(normal.hessian)
    root = directions / np.sqrt(np.maximum(values, np.finfo(float).eps * values.max()))
    steps = spread * rng.standard_normal((DRAWS, len(values))) @ root.T
    steps = np.clip(steps, -FURTHEST, FURTHEST) * (normal.precision > 0.0)
    return [beside(fit, step) for step in steps]
