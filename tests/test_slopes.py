"""The derivative of a sampled measurement: its filters against slopes that are known."""

import numpy as np
import pytest

from controllers.derivative import LowPassDerivative, SpanDerivative, settled

DT = 1e-3
BOTH = [LowPassDerivative(3e-3), SpanDerivative(5)]


def filtered(derivative, values):
    A, B, C, D = derivative.filter(DT)
    memory, slopes = settled((A, B, C, D), values[0]), []
    for value in values:
        slopes.append(C @ memory + D * value)
        memory = A @ memory + B * value
    return np.array(slopes)


@pytest.mark.parametrize("derivative", BOTH)
def test_a_derivative_is_nothing_at_rest_and_the_slope_of_a_ramp(derivative):
    values = 0.3 + 0.2 * DT * np.maximum(np.arange(60) - 10, 0)
    slopes = filtered(derivative, values)

    assert slopes[:11] == pytest.approx(0.0, abs=1e-12)
    assert slopes[-1] == pytest.approx(0.2, rel=1e-4)


def test_the_derivative_over_several_periods_is_that_difference():
    values = np.random.default_rng(1).standard_normal(40)
    slopes = filtered(SpanDerivative(7), values)

    assert slopes[7:] == pytest.approx((values[7:] - values[:-7]) / (7 * DT))


def test_noise_on_the_slope_falls_with_the_periods_over_which_it_is_taken():
    noise = np.random.default_rng(2).standard_normal(4000)
    spread = [filtered(SpanDerivative(n), noise)[20:].std() for n in (1, 4, 16)]

    assert spread[0] / spread[1] == pytest.approx(4.0, rel=0.05)
    assert spread[0] / spread[2] == pytest.approx(16.0, rel=0.05)
