"""Losses of the moving-horizon estimator, and the point inside bounds, against cvxpy."""

import cvxpy
import numpy as np
import pytest
from horizons import cart_data, on_cart, run
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.foreseen import Foresight
from estimators.gated import Gated
from estimators.losses import Absolute, Huber, Squared
from estimators.nearest_inside import nearest_inside


@pytest.mark.parametrize("loss", [Huber(1.5), Absolute(0.2)])
def test_with_a_robust_loss_it_is_what_cvxpy_finds(loss):
    """On the linear plant, three outliers in the window: reweighting converges to the minimum."""
    u, y = cart_data(14)
    y[[3, 8, 9]] += 0.03
    estimator = on_cart(horizon=14, loss=loss, passes=300)
    found = run(estimator, u, y)[-1]
    functions = estimator.functions
    read = {name: functions.part(found.memory.tape, name) for name in functions.sizes}
    F, kick = read["F"][:, :2], functions.at.kick
    X0, noise = cvxpy.Variable(2), cvxpy.Variable((4, 13))
    offset = [read["points"][:, k + 1] - F @ read["points"][:, k] for k in range(13)]
    path = [X0]
    for k in range(13):
        held = read["noise"][:, k]
        extra = offset[k] - F @ (kick * held[:2]) - kick * held[2:]
        kicked = path[-1] + cvxpy.multiply(kick, noise[:2, k])
        path.append(F @ kicked + cvxpy.multiply(kick, noise[2:, k]) + extra)
    L = np.linalg.cholesky(read["prior"][:, 1:])
    errors = [read["y"][0, k] - read["H"][0, 2 * k : 2 * k + 2] @ path[k] for k in range(14)]
    corner = getattr(loss, "corner", None)
    bend = corner if corner else loss.bend
    each = cvxpy.sum(cvxpy.huber(cvxpy.hstack(errors), bend)) / (corner or 1.0)
    prior = np.linalg.inv(L) @ (X0 - read["prior"][:, 0])
    cost = cvxpy.sum_squares(prior) + cvxpy.sum_squares(noise) + each
    cvxpy.Problem(cvxpy.Minimize(cost)).solve(solver="CLARABEL")

    scale = functions.found.scale
    np.testing.assert_allclose(found.state, scale * path[-1].value, rtol=1e-3, atol=2e-5)


def test_outliers_hardly_move_a_robust_estimate():
    u, y = cart_data(60)
    spoiled = y.copy()
    spoiled[5::9] += 0.05
    clean = np.array([e.state[0] for e in run(on_cart(horizon=10), u, y)])
    moved = {
        loss: np.abs([e.state[0] for e in run(on_cart(horizon=10, loss=loss), u, spoiled)] - clean)
        for loss in (Squared(), Huber(), Absolute())
    }

    assert moved[Huber()].max() < 0.15 * moved[Squared()].max()
    assert moved[Absolute()].max() < 0.15 * moved[Squared()].max()


@pytest.mark.parametrize("loss", [Squared(), Huber(), Absolute()])
def test_an_outlier_is_as_surprising_as_it_is_whatever_it_costs(loss):
    """A gate before an estimator that lets go of outliers by itself must see them, too."""
    u, y = cart_data(45)
    y[40] += 0.02
    estimator = on_cart(horizon=4, loss=loss)
    found, sight = run(estimator, u, y), Foresight(estimator)
    expected, S = sight.outputs(sight.blind(found[39], u[39]), u[39])
    gated = run(Gated(inner=estimator), u, y)

    assert found[40].notes["nis"] == pytest.approx(((y[40] - expected) ** 2 / S)[0, 0], rel=1e-4)
    assert found[40].notes["nis"] > 80.0
    assert [k for k, each in enumerate(gated) if each.notes["outliers"]] == [40]


@pytest.mark.parametrize("loss", [Huber, Absolute])
def test_a_loss_needs_a_size(loss):
    with pytest.raises(ValueError, match="expected above 0"):
        loss(0.0)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 5), st.integers(0, 10_000))
def test_the_nearest_point_inside_is_that_of_cvxpy(n, seed):
    """Also where the covariance is singular."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n, max(n - 1, 1)))
    P = A @ A.T + (0.1 * np.eye(n) if seed % 2 else 0.0)
    d = 2.0 * rng.standard_normal(n)
    inside = d + A @ rng.standard_normal(A.shape[1])  # so that there is a solution
    lower, upper = inside - rng.uniform(0.1, 1.0, n), inside + rng.uniform(0.1, 1.0, n)
    upper[rng.random(n) < 0.3] = np.inf

    z, push = nearest_inside(d, P, lower, upper)

    L = np.linalg.cholesky(P + 1e-12 * P.diagonal().max() * np.eye(n))
    s = cvxpy.Variable(n)
    held = [d + L @ s >= lower] + [(d + L @ s)[k] <= upper[k] for k in np.flatnonzero(upper < 1e9)]
    cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(s)), held).solve(solver="CLARABEL")
    np.testing.assert_allclose(z, d + L @ s.value, atol=1e-4)
    np.testing.assert_allclose(z - d, P @ push, atol=1e-4)
