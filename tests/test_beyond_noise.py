"""What squared errors hold beyond noise: of rests and of motion, each alone."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from workbench.diagnosis.judge import LEAST_BIC, _bic_gain
from workbench.fitting.beyond_noise import beyond_noise, fall_beyond_noise, whole_beyond_noise
from workbench.fitting.error_model import ACTIVE
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.problem import training_drop
from workbench.fitting.windows import Windows, cut_windows
from workbench.plants import servo_drive, soft_joint_parametric
from workbench.recording import Recording

NOISE = {"bellows.pressure_pa": 300.0}
KNOWN, WITHIN, BEYOND = 1.0, 1.04, 2.0  # times the noise: as it is, as far as it is not known, more
PRICE = 2.0


@dataclass(frozen=True)
class Fitted:
    """What of a fit tells its errors."""

    windows: Windows
    squares: np.ndarray
    price: float = 0.0
    misfit = Fit.misfit

    @property
    def chi2(self):
        return float(self.squares.sum())

    @property
    def cost(self):
        return self.chi2 + self.price


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


def excess(windows, chosen, times):
    return (times - 1.0) * weights(windows)[chosen].sum()


def test_rests_at_their_noise_hold_nothing(windows, moves):
    found = beyond_noise(windows, squares_of(windows, moves, WITHIN, BEYOND), PRICE)

    assert found == pytest.approx(excess(windows, moves, BEYOND) + PRICE)


def test_where_all_is_noise_there_is_what_noise_is_known_to(windows, moves):
    squares = squares_of(windows, moves, KNOWN, WITHIN)
    known = known_to(windows, moves) + known_to(windows, ~moves)

    assert beyond_noise(windows, squares, 0.0) == pytest.approx(known)
    held = excess(windows, moves, WITHIN) + 2.0 * known
    assert beyond_noise(windows, squares, 2.0 * known) == pytest.approx(held), "with a high price"


def test_what_is_recorded_nowhere_still_leaves_a_misfit(windows, moves):
    silent = replace(windows, measured=np.full_like(windows.measured, np.nan))
    nothing = np.zeros(moves.shape)

    assert beyond_noise(silent, nothing, 0.0) == whole_beyond_noise(silent, 0.0) == 1.0
    assert fall_beyond_noise(silent, nothing, nothing) == 0.0


def test_what_goes_at_rest_within_the_noise_is_no_share_of_what_goes(windows, moves):
    before = squares_of(windows, moves, WITHIN, BEYOND)

    found = fall_beyond_noise(windows, before, squares_of(windows, moves, KNOWN, KNOWN))

    assert found == pytest.approx(excess(windows, moves, BEYOND))


def test_within_the_noise_all_that_falls_counts(windows, moves):
    before, after = (squares_of(windows, moves, KNOWN, times) for times in (WITHIN, KNOWN))

    found = fall_beyond_noise(windows, before, after)

    assert found == pytest.approx(excess(windows, moves, WITHIN))


def test_rests_that_are_left_beyond_their_noise_count(windows, moves):
    before = squares_of(windows, moves, KNOWN, BEYOND)

    found = fall_beyond_noise(windows, before, squares_of(windows, moves, BEYOND, KNOWN))

    worse = excess(windows, ~moves, BEYOND)
    assert found == pytest.approx(excess(windows, moves, BEYOND) - worse)


def test_what_falls_below_the_noise_is_all_of_it_and_no_more(windows, moves):
    before = squares_of(windows, moves, WITHIN, BEYOND)

    found = fall_beyond_noise(windows, before, squares_of(windows, moves, WITHIN, 0.5))

    assert found == pytest.approx(beyond_noise(windows, before, 0.0))


def test_the_more_there_is_to_remove_the_larger_is_the_share_that_goes(windows, moves):
    """It was three times smaller just beyond what the noise is known to than just within it."""
    clean, shares = squares_of(windows, moves, KNOWN, KNOWN), []
    unit = known_to(windows, moves) / weights(windows)[moves].sum()
    for times in np.linspace(0.2, 3.0, 40):
        before = squares_of(windows, moves, KNOWN, 1.0 + times * unit)
        fall = fall_beyond_noise(windows, before, clean)
        shares.append(fall / beyond_noise(windows, before, 0.0))

    assert np.all(np.diff(shares) > -1e-9)
    assert shares[0] < 0.1 and shares[-1] == pytest.approx(1.0)


def test_each_output_is_measured_alone():
    """A position far off, beside a pressure whose noise outweighs it."""
    names = ("slide.position_m", "chamber_a.pressure_pa", "chamber_b.pressure_pa")
    rest = {name: np.full(4000, value) for name, value in zip(names, (0.1, 4e5, 4e5), strict=True)}
    rest["chamber_b.pressure_pa"] = np.full(4000, np.nan)
    channels = {"valve.command_v": np.full(4000, 5.0), **rest}
    noise = dict(zip(names, (5e-6, 500.0, 500.0), strict=True))
    windows = cut_windows(servo_drive().lean(), [Recording("rest", 1e-3, channels)], noise)
    floors = weights(windows).sum(axis=2)
    far = floors * np.array([[BEYOND], [WITHIN], [KNOWN]])

    assert floors[2].sum() == 0.0
    assert beyond_noise(windows, far, 0.0) == pytest.approx(floors[0].sum())
    assert fall_beyond_noise(windows, far, floors) == pytest.approx(floors[0].sum())


def test_a_whole_cost_counts_noise_to_what_it_is_known(windows):
    floor = weights(windows).sum()

    assert whole_beyond_noise(windows, 1.2 * floor) == pytest.approx(0.2 * floor)
    assert whole_beyond_noise(windows, 1.01 * floor) == pytest.approx(0.05 * floor)


def test_the_price_of_priors_is_a_part_of_what_goes(windows, moves):
    squares = squares_of(windows, moves, WITHIN, BEYOND)
    before, after = (Fitted(windows, squares, price) for price in (30.0, 10.0))

    assert training_drop(before, after) == pytest.approx(20.0 / before.misfit)
    assert before.misfit == pytest.approx(excess(windows, moves, BEYOND) + 30.0)


def test_a_fall_within_the_noise_of_rests_pays_for_no_parameter(windows, moves):
    """Of a joint that lacked nothing a throttled supply was named for 8 of 900 in chi2 at rest."""
    before = Fitted(windows, squares_of(windows, moves, WITHIN, BEYOND))
    rests = Fitted(windows, squares_of(windows, moves, KNOWN, BEYOND))
    motion = Fitted(windows, squares_of(windows, moves, WITHIN, KNOWN))

    assert before.cost - rests.cost > 100.0
    assert _bic_gain(before, rests, 1) < 0.0
    assert _bic_gain(before, motion, 1) > LEAST_BIC
