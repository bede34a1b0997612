"""The nuisance-free metric against dense algebra: signatures, and shifts that are freed."""

from types import SimpleNamespace

import numpy as np
import pytest
from test_fitting import NOISE, sines

from workbench.diagnosis.metric import Metric
from workbench.diagnosis.scan import _single
from workbench.diagnosis.shifts import shifts
from workbench.diagnosis.ties import imitation
from workbench.fitting.linearised import Normal, normal_equations
from workbench.fitting.problem import pose
from workbench.plants.servo_drive import servo_drive
from workbench.rig import default_rig

ROWS, WINDOWS, NUISANCES = 30, 2, 3


@pytest.fixture(scope="module")
def metric():
    """Derivatives, residual and priors as they may come, at the minimum."""
    rng = np.random.default_rng(5)
    J = rng.normal(size=(WINDOWS, ROWS, NUISANCES))
    flat, precision = J.reshape(-1, NUISANCES), np.array([50.0, 0.0, 400.0])
    residual = rng.normal(size=(WINDOWS, ROWS))
    t = np.linalg.solve(flat.T @ flat + np.diag(precision), -flat.T @ residual.ravel())
    residual = residual + J @ t
    hessian = flat.T @ flat + np.diag(precision)
    gradient = flat.T @ residual.ravel() + precision * t
    at = SimpleNamespace(point=SimpleNamespace(t=t))
    return Metric(at, Normal(hessian, gradient, residual, J, precision))


def least_cost(metric, residual):
    """Least squares over the nuisances with their priors as rows, around where they are."""
    J = metric.normal.derivatives.reshape(-1, NUISANCES)
    root = np.sqrt(metric.normal.precision)
    rows = np.vstack([J, np.diag(root)])
    known = np.concatenate([residual.ravel(), root * metric.at.point.t])
    step = np.linalg.lstsq(rows, -known, rcond=None)[0]
    return float(np.sum((known + rows @ step) ** 2))


@pytest.mark.parametrize("near", [0.0, 0.98])
def test_products_of_signatures_are_what_two_changes_do_to_the_cost_together(metric, near):
    """d1'M d2 = (c(d1 + d2) - c(d1) - c(d2) + c(0)) / 2; also of what the nuisances can do."""
    rng = np.random.default_rng(6)
    changes = rng.normal(size=(2, WINDOWS, ROWS))
    along = metric.normal.derivatives @ rng.normal(size=(NUISANCES, 2))
    changes = (1.0 - near) * changes + near * along.transpose(2, 0, 1)
    (one, other) = changes
    r = metric.normal.residual
    costs = [least_cost(metric, r + d) for d in (one + other, one, other, np.zeros_like(one))]
    a, b = (metric.signature(d)[0] for d in changes)

    assert a @ b == pytest.approx((costs[0] - costs[1] - costs[2] + costs[3]) / 2.0, rel=1e-9)
    assert a @ a == pytest.approx(metric.shown(one))


def test_an_imitation_brings_the_share_of_the_fall_that_it_says(metric):
    """Truth: one change by its whole amount, no noise; the other change is what is fitted."""
    rng = np.random.default_rng(7)
    along = metric.normal.derivatives @ rng.normal(size=NUISANCES)
    one, other = rng.normal(size=(2, WINDOWS, ROWS)) * 0.3 + along
    J, rest = metric.normal.derivatives, metric.normal.precision
    at = SimpleNamespace(point=SimpleNamespace(t=np.zeros(NUISANCES)))
    gradient = J.reshape(-1, NUISANCES).T @ -one.ravel()
    missing = Metric(at, Normal(metric.normal.hessian, gradient, -one, J, rest))
    whole = missing.cost
    gram, slope = missing.gram(other.reshape(1, -1))
    fall = float(slope[0] ** 2 / gram[0, 0])
    profiles = [SimpleNamespace(signature=metric.signature(d)[0]) for d in (one, other)]

    assert imitation(*profiles) == pytest.approx(fall / whole, rel=1e-9)


def test_a_shift_says_how_far_the_cost_falls_where_its_prior_is_taken_away():
    """To second order; the fit is not quite at its minimum, so that some of it may be left."""
    plant = servo_drive().lean()
    heavy = plant.with_values({"slide.mass_kg": 1.3 * plant.values["slide.mass_kg"]})
    problem = pose(default_rig(plant), [sines(heavy, NOISE)])
    unknowns, t = problem.base.unknowns, problem.base.point.t
    normal = normal_equations(problem.linearised, unknowns)
    found = {each.name: each for each in shifts(problem)}
    k = unknowns.names.index("slide.mass_kg")
    freed, gradient = normal.hessian.copy(), normal.gradient.copy()
    freed[k, k] -= normal.precision[k]
    gradient[k] -= normal.precision[k] * t[k]
    gained = [
        g @ np.linalg.solve(H, g) for H, g in ((normal.hessian, normal.gradient), (freed, gradient))
    ]
    fall = t[k] ** 2 * normal.precision[k] + gained[1] - gained[0]

    assert abs(t[k]) > 1.0
    assert found["slide.mass_kg"].drop * problem.misfit == pytest.approx(fall, rel=0.05)


def test_a_change_that_runs_away_stays_a_number_and_so_does_its_square():
    """In single precision it was infinite, with a warning on the screen."""
    change = np.array([[1.0, -2.5], [1e80, -1e200]])
    row = _single(change)

    assert row.dtype == np.float32 and row.shape == (4,)
    assert row[:2] == pytest.approx([1.0, -2.5])
    assert np.isfinite(np.sum(row**2))
