"""What squared errors hold beyond noise: of rests and of motion, each alone."""

import numpy as np
import pytest

from workbench.fitting.beyond_noise import beyond_noise, fall_beyond_noise
from workbench.fitting.error_model import ACTIVE
from workbench.fitting.windows import cut_windows
from workbench.plants import soft_joint_parametric
from workbench.recording import Recording

NOISE = {"bellows.pressure_pa": 300.0}
KNOWN, WITHIN, BEYOND = 1.0, 1.04, 1.2  # times the noise: as it is, and as far as it is not known


@pytest.fixture(scope="module")
def windows():
    """A second of motion, then nine at rest."""
    time_s = 1e-3 * np.arange(10000)
    pressure = 3e5 + 1e5 * np.where(time_s < 1.0, np.sin(20.0 * time_s), np.sin(20.0))
    channels = {"valve.pwm": np.full(len(time_s), 0.5), "bellows.pressure_pa": pressure}
    return cut_windows(soft_joint_parametric(), [Recording("rests", 1e-3, channels)], NOISE)


def squares_of(windows, rest, motion):
    """Squared errors so many times those of noise alone, (n_y, n_windows)."""
    floors = np.sum((windows.weight * windows.noise[:, None, None]) ** 2, axis=2)
    moves = windows.activity > ACTIVE * windows.noise[:, None]
    assert moves.any() and not moves.all()
    return floors * np.where(moves, motion, rest), floors, moves


def test_rests_at_their_noise_hold_nothing(windows):
    squares, floors, moves = squares_of(windows, WITHIN, BEYOND)

    found = beyond_noise(windows, squares, price=2.0)

    assert found == pytest.approx((BEYOND - 1.0) * floors[moves].sum() + 2.0)
    assert found < 0.05 * floors.sum(), "less than their noise is known to"


def test_where_all_is_noise_there_is_what_noise_is_known_to(windows):
    squares, floors, _ = squares_of(windows, KNOWN, WITHIN)

    assert beyond_noise(windows, squares, price=0.0) == pytest.approx(0.05 * floors.sum())


def test_what_goes_at_rest_within_the_noise_is_no_share_of_what_goes(windows):
    before, floors, moves = squares_of(windows, WITHIN, BEYOND)
    after, *_ = squares_of(windows, KNOWN, KNOWN)

    found = fall_beyond_noise(windows, before, after)

    assert found == pytest.approx((BEYOND - 1.0) * floors[moves].sum())


def test_rests_that_are_left_beyond_their_noise_count(windows):
    before, floors, moves = squares_of(windows, KNOWN, BEYOND)
    after, *_ = squares_of(windows, BEYOND, KNOWN)

    found = fall_beyond_noise(windows, before, after)

    assert found == pytest.approx((BEYOND - 1.0) * (floors[moves].sum() - floors[~moves].sum()))
