"""Fits that begin again from other sizes of what was added."""

from dataclasses import replace

import numpy as np
import pytest
from test_shaken import windows  # noqa: F401  (a fixture)

from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.problem import ITERATIONS
from workbench.fitting.resized import ROUNDS, points_of_sizes, resized
from workbench.fitting.unknowns import WIDE, nominal_unknowns

ADDED = "friction.viscous_n_s_m"  # stands for what was added: it is given no prior


@pytest.fixture(scope="module")
def unknowns(windows):  # noqa: F811
    nominal = nominal_unknowns(windows.plant)
    precision = np.where([name == ADDED for name in nominal.names], WIDE**-2, 1.0)
    return replace(nominal, precision=precision)


@pytest.fixture(scope="module")
def fitted(windows, unknowns):  # noqa: F811
    return fit_windows(windows, unknowns, iterations=ITERATIONS)


def size(fit):
    return fit.plant.values[ADDED]


def left_at(fit, factor):
    """The fit as it would be, had it given up at another size."""
    (point,) = points_of_sizes(fit, [ADDED], (factor,))
    return fit_windows(fit.windows, fit.unknowns, point, iterations=0)


def test_a_size_is_followed_while_it_leads_lower(fitted):
    """By steps alone, no fit between: 0.5 x 1.2**4 = 1.04 of the size, and 1.24 is worse."""
    stuck = left_at(fitted, 0.5)
    found = resized(stuck, [ADDED], 0)

    assert size(stuck) == pytest.approx(0.5 * size(fitted))
    assert size(found) == pytest.approx(1.2**ROUNDS * size(stuck))
    assert found.cost < stuck.cost


def test_fits_from_other_sizes_go_on(fitted):
    stuck = left_at(fitted, 0.5)
    alone = resized(stuck, [ADDED], 0)

    assert resized(stuck, [ADDED], ITERATIONS).cost < alone.cost


def test_the_lowest_fit_stays_as_it_is(fitted):
    assert resized(fitted, [ADDED], 0) is fitted


def test_what_is_not_fitted_or_zero_or_held_by_a_bound_gives_no_point(fitted, unknowns):
    row = unknowns.names.index(ADDED)
    prior, upper = unknowns.prior.copy(), unknowns.upper.copy()
    prior[row] = 0.0
    t = fitted.point.t.copy()
    t[row] = 0.0
    absent = replace(
        fitted, unknowns=replace(unknowns, prior=prior), point=replace(fitted.point, t=t)
    )
    upper[row] = 0.9 * size(fitted)
    tight = replace(unknowns, upper=upper)
    at_bound = Point(tight.clipped(fitted.point.t), fitted.point.starts)
    bound = replace(fitted, unknowns=tight, point=at_bound)

    assert points_of_sizes(fitted, ["friction.not_there"], (0.8, 1.2)) == []
    assert points_of_sizes(absent, [ADDED], (0.8, 1.2)) == []
    assert len(points_of_sizes(bound, [ADDED], (0.8, 1.2))) == 1


def test_each_point_moves_one_size_alone(fitted):
    names = [ADDED, "slide.mass_kg"]
    points = points_of_sizes(fitted, names, (0.8, 1.2))
    values = [fitted.unknowns.values(point.t) for point in points]
    before = fitted.unknowns.values(fitted.point.t)

    for (name, factor), after in zip(
        [(name, factor) for name in names for factor in (0.8, 1.2)], values, strict=True
    ):
        assert after[name] == pytest.approx(factor * before[name])
        assert {k: v for k, v in after.items() if k != name} == pytest.approx(
            {k: v for k, v in before.items() if k != name}
        )
    assert all(isinstance(point, Point) for point in points)
