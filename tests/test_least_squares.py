"""The bounded least squares of the identification procedures."""

import numpy as np
import pytest

from workbench.identification import least_squares
from workbench.identification.least_squares import Unknown, correlation_samples, solve


def test_deviations_count_how_long_errors_stay_correlated():
    """A mean of n values with errors equal over 20 of them is worth n / 20."""
    rng = np.random.default_rng(3)
    slow = np.repeat(rng.standard_normal(200), 20)
    found = solve(lambda x: slow - x[0], [Unknown(0.0, 1.0)], noise=0.01)

    assert correlation_samples(slow) == pytest.approx(20.0, rel=0.3)
    assert found.deviations[0] == pytest.approx(1.0 / np.sqrt(200), rel=0.3)


def test_what_leans_on_a_prior_is_as_far_off_as_its_deviation_says():
    """Slow errors ten times the noise; the truth is drawn from the prior itself."""
    rng = np.random.default_rng(11)
    x, errors, told = np.linspace(0.0, 1.0, 400), [], []
    for _ in range(60):
        truth = rng.standard_normal()
        slow = 10.0 * np.sqrt(1.0 - 0.98**2) * rng.standard_normal(len(x))
        for k in range(1, len(x)):
            slow[k] += 0.98 * slow[k - 1]
        y = truth * x + slow
        leans = [Unknown(0.0, 1.0, prior_deviation=1.0)]
        found = solve(lambda a, y=y: y - a[0] * x, leans, noise=1.0)
        errors.append(found.values[0] - truth)
        told.append(found.deviations[0])

    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.mean(told), rel=0.3)


def test_a_search_that_does_not_end_is_an_error(monkeypatch):
    monkeypatch.setattr(least_squares, "MOST_EVALUATIONS", 2)
    valley = [Unknown(-1.2, 1.0), Unknown(1.0, 1.0)]

    with pytest.raises(ArithmeticError, match="did not converge in 2 evaluations"):
        solve(lambda x: np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]]), valley, noise=1.0)
