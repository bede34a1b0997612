"""What is said of a noise that the recording does not tell: it may be larger, or smaller."""

import numpy as np
import pytest

from workbench.fitting.noise_source import NoiseSource, recorded_noise
from workbench.recording import Recording

POSITION = "rod.position_m"
T = 1e-3 * np.arange(4000)


def filtered() -> np.ndarray:
    """A smooth motion with noise of 1 mm that its sensor filtered over 20 samples."""
    white = np.random.default_rng(2).standard_normal(len(T) + 200)
    kernel = np.exp(-0.5 * (np.arange(-60, 61) / 8.0) ** 2)
    slow = np.convolve(white, kernel, mode="same")[100:-100]
    return 0.1 * np.sin(2.0 * T) + 1e-3 * slow / slow.std()


def shaking() -> np.ndarray:
    """A motion near a quarter of the sample rate, with noise of 1 um."""
    return 1e-3 * np.sin(2 * np.pi * 180.0 * T) + 1e-6 * np.random.default_rng(2).standard_normal(
        len(T)
    )


@pytest.mark.parametrize(("values", "true"), [(filtered(), 1e-3), (shaking(), 1e-6)])
def test_a_noise_that_is_not_told_may_be_smaller_or_larger_and_can_be_given(values, true):
    """It was said to be smaller, while a filter had hidden nearly all of it."""
    found = recorded_noise(Recording("r", 1e-3, {POSITION: values}), [POSITION])[POSITION]

    assert found.source is NoiseSource.UNCLEAR
    assert (found.value > true) == (true < 1e-4) and not 0.5 < found.value / true < 2.0
    said = found.sentence
    assert "smaller if motion" in said and "larger if its sensor is filtered" in said
    assert "give noise = ... for the channel" in said
