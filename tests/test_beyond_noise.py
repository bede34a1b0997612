"""What squared errors hold beyond noise: of rests and of motion, each alone."""

import numpy as np
import pytest

from workbench.fitting.beyond_noise import beyond_noise, fall_beyond_noise
from workbench.fitting.error_model import ACTIVE
from workbench.fitting.windows import cut_windows
from workbench.plants import soft_joint_parametric
from workbench.recording import Recording

NOISE = {"bellows.pressure_pa": 300.0}
KNOWN, WITHIN, BEYOND = 1.0, 1.04, 2.0  # times the noise: as it is, as far as it is not known, more


@pytest.fixture(scope="module")
def windows():
    """A second of motion, then nine at rest."""
    time_s = 1e-3 * np.arange(10000)
    pressure = 3e5 + 1e5 * np.where(time_s < 1.0, np.sin(20.0 * time_s), np.sin(20.0))
    channels = {"valve.pwm": np.full(len(time_s), 0.5), "bellows.pressure_pa": pressure}
    return cut_windows(soft_joint_parametric(), [Recording("rests", 1e-3, channels)], NOISE)


@pytest.fixture(scope="module")
def moves(windows):
    found = windows.activity > ACTIVE * windows.noise[:, None]
    assert found.any() and not found.all()
    return found


def weights(windows):
    return (windows.weight * windows.noise[:, None, None]) ** 2


def squares_of(windows, moves, rest, motion):
    """Squared errors so many times those of noise alone, (n_y, n_windows)."""
    return weights(windows).sum(axis=2) * np.where(moves, motion, rest)


def known_to(windows, chosen):
    """Five percent, and two deviations of what white noise sums to."""
    own = weights(windows)[chosen]
    return 0.05 * own.sum() + 2.0 * np.sqrt(2.0 * (own**2).sum())


def expected(windows, chosen, times):
    return (times - 1.0) * weights(windows)[chosen].sum() - known_to(windows, chosen)


def test_rests_at_their_noise_hold_nothing(windows, moves):
    found = beyond_noise(windows, squares_of(windows, moves, WITHIN, BEYOND), price=2.0)

    assert found == pytest.approx(expected(windows, moves, BEYOND) + 2.0)


def test_where_all_is_noise_there_is_what_noise_is_known_to(windows, moves):
    found = beyond_noise(windows, squares_of(windows, moves, KNOWN, WITHIN), price=0.0)

    assert found == pytest.approx(known_to(windows, moves) + known_to(windows, ~moves))


def test_what_is_hardly_beyond_noise_counts_as_no_less_than_that_is_known_to(windows, moves):
    hardly = 1.0 + 1.01 * known_to(windows, moves) / weights(windows)[moves].sum()

    found = beyond_noise(windows, squares_of(windows, moves, WITHIN, hardly), price=0.0)

    assert found == pytest.approx(known_to(windows, moves))


def test_what_goes_at_rest_within_the_noise_is_no_share_of_what_goes(windows, moves):
    before = squares_of(windows, moves, WITHIN, BEYOND)

    found = fall_beyond_noise(windows, before, squares_of(windows, moves, KNOWN, KNOWN))

    assert found == pytest.approx(expected(windows, moves, BEYOND))


def test_rests_that_are_left_beyond_their_noise_count(windows, moves):
    before = squares_of(windows, moves, KNOWN, BEYOND)

    found = fall_beyond_noise(windows, before, squares_of(windows, moves, BEYOND, KNOWN))

    worse = expected(windows, ~moves, BEYOND)
    assert found == pytest.approx(expected(windows, moves, BEYOND) - worse)
