"""Maps of the error, spectrum and whiteness of residuals, and where the noise is known from."""

import numpy as np
import pytest

from workbench.comparison.maps import error_map
from workbench.comparison.residuals import residual_of
from workbench.fitting.noise_source import NoiseSource, recorded_noise
from workbench.recording import Recording

DT = 1e-3
NAME = "rod.position_m"
X, Y = "rod.position_m", "rod.velocity_m_s"


def recording_of(values, starts=(0,), **noise):
    return Recording("one", DT, {NAME: values}, noise, starts)


def white(n, seed=5):
    return np.random.default_rng(seed).standard_normal(n)


def test_white_noise_is_white_and_has_the_density_of_its_floor():
    found = residual_of(recording_of(white(20_000)), white(20_000), 1.0)

    assert found.outside < 0.12
    assert found.bands[0] == pytest.approx(1.96 / np.sqrt(20_000))
    assert np.median(found.density) == pytest.approx(found.floor, rel=0.1)
    assert found.floor == pytest.approx(2.0 * DT)


def test_the_density_of_a_sine_sums_to_half_its_square():
    """Amplitude 3 at 50 Hz: a variance of 4.5, all of it there."""
    sine = 3.0 * np.sin(2 * np.pi * 50.0 * DT * np.arange(8000))

    found = residual_of(recording_of(sine), sine, 1.0)

    step_hz = found.frequency_hz[1]
    assert found.density.sum() * step_hz == pytest.approx(4.5, rel=0.02)
    assert found.frequency_hz[np.argmax(found.density)] == pytest.approx(50.0, abs=step_hz)


def test_an_error_with_memory_is_not_white():
    """e[k] = 0.8 e[k-1] + w: the correlation at lag k is 0.8^k."""
    error = np.zeros(20_000)
    for k, drive in enumerate(white(20_000)[1:], start=1):
        error[k] = 0.8 * error[k - 1] + drive

    found = residual_of(recording_of(error), error, 1.0)

    assert found.correlation[[1, 2, 3]] == pytest.approx([0.8, 0.64, 0.512], abs=0.03)
    assert found.outside > 0.1


def test_holes_and_gaps_part_a_residual():
    """A jump of sign at a gap and at a hole: within each stretch nothing changes."""
    error = np.repeat([1.0, -1.0, 1.0, -1.0], 100)
    error[100] = np.nan

    found = residual_of(recording_of(error, starts=(0, 200, 300)), error, 1.0)

    assert (np.diff(found.correlation) < 0).all() and found.correlation[1] > 0.98


def test_missing_samples_take_nothing_off_a_correlation():
    """e[k] = 0.9 e[k-1] + w, every fourth sample missing: half the neighbours are left."""
    error = np.zeros(20_000)
    for k, drive in enumerate(white(20_000)[1:], start=1):
        error[k] = 0.9 * error[k - 1] + drive
    whole = residual_of(recording_of(error), error, 1.0)
    error[::4] = np.nan
    found = residual_of(recording_of(error), error, 1.0)

    assert found.correlation[:3] == pytest.approx([1.0, 0.9, 0.81], abs=0.03)
    assert found.correlation[:3] == pytest.approx(whole.correlation[:3], abs=0.02)
    assert found.bands[:3] == pytest.approx(1.96 / np.sqrt([15_000, 10_000, 5_000]), rel=1e-3)


def test_an_error_that_is_nowhere_known_has_no_spectrum():
    error = np.full(300, np.nan)

    found = residual_of(recording_of(error), error, 1.0)

    assert not len(found.density) and np.isnan(found.outside)


def test_a_cell_holds_the_root_mean_square_of_its_samples():
    """Error 2 for positive x, 1 for negative; of y = 1 there are four samples only."""
    x = np.concatenate([np.full(50, -1.0), np.full(50, 1.0), np.full(4, -1.0)])
    y = np.concatenate([np.full(100, 0.0), np.full(4, 1.0)])
    error = np.where(x > 0, 2.0, np.where(np.arange(104) % 2, 1.0, -1.0))

    found = error_map((X, x), (Y, y), (NAME, error))

    assert found.rms[:, 0] == pytest.approx([1.0, 2.0])
    assert np.isnan(found.rms[:, 1]).all()
    assert found.x_edges == pytest.approx([-2.0, 0.0, 2.0])


def test_missing_errors_enter_no_cell():
    x = np.linspace(0.0, 1.0, 4000)
    error = np.where(x < 0.5, np.nan, 3.0)

    found = error_map((X, x), (Y, x), (NAME, error))

    assert np.nanmin(found.x_edges) > 0.499
    assert np.nanmax(found.rms) == pytest.approx(3.0) == np.nanmin(found.rms)
    assert error_map((X, x), (Y, x), (NAME, np.full(4000, np.nan))) is None


def slow_and_still():
    return np.concatenate([np.zeros(1000), np.linspace(0.0, 0.1, 1000)])


SIGNALS = {
    "rests and moves": (slow_and_still() + 1e-5 * white(2000), NoiseSource.STILL),
    "slow sine": (
        0.05 * np.sin(2 * np.pi * DT * np.arange(4000)) + 1e-5 * white(4000),
        NoiseSource.MOVING,
    ),
    "sine that sampling hardly follows": (
        0.05 * np.sin(2 * np.pi * 60.0 * DT * np.arange(4000)) + 1e-5 * white(4000),
        NoiseSource.UNCLEAR,
    ),
    "fewer samples than tell": (1e-5 * white(42), NoiseSource.SHORT),
    "nothing but one value": (np.full(400, 0.1), NoiseSource.ASSUMED),
}


@pytest.mark.parametrize("every", [1, 5], ids=["every sample", "a slow sensor"])
@pytest.mark.parametrize("case", SIGNALS)
def test_it_is_said_where_the_noise_is_known_from(case, every):
    taken, source = SIGNALS[case]
    values = np.full(len(taken) * every, np.nan)
    values[::every] = taken

    found = recorded_noise(recording_of(values), [NAME])[NAME]

    assert found.source is source
    if source in (NoiseSource.STILL, NoiseSource.MOVING):
        assert found.value == pytest.approx(1e-5, rel=0.25)
    told = {NoiseSource.STILL: "", NoiseSource.MOVING: "rod.position is never still"}
    assert found.sentence.startswith(told.get(source, "the noise of rod.position could not be"))


def test_noise_that_was_given_is_kept():
    recording = Recording("one", DT, {NAME: np.zeros(100)}, {NAME: 3e-5})

    found = recorded_noise(recording, [NAME])[NAME]

    assert (found.value, found.source, found.sentence) == (3e-5, NoiseSource.GIVEN, "")


@pytest.mark.parametrize("step", [3.0, 2.5, 10.0 / 3.0, 1.5])
def test_a_slow_sensor_on_a_fast_clock_has_a_spectrum_of_its_own_samples(step):
    """Some samples are there, some of these are lost, and the first piece begins late."""
    values = np.full(60_000, np.nan)
    own = (1 + step * np.arange(59_000 / step)).astype(int)
    values[own] = white(len(own))
    values[:100] = values[own[500::997]] = np.nan
    found = residual_of(recording_of(values, starts=(0, 30_001)), values, 1.0)
    walk = np.where(np.isfinite(values), np.cumsum(white(60_000, 6)), np.nan)

    assert found.frequency_hz[-1] == pytest.approx(1.0 / (2 * step * DT), rel=0.01)
    assert np.median(found.density) == pytest.approx(found.floor, rel=0.1)
    assert found.lag_s[1] == pytest.approx(step * DT, rel=0.01)
    assert found.outside < 0.12
    assert residual_of(recording_of(walk), walk, 1.0).outside > 0.9


@pytest.mark.parametrize("count", [856, 857])
def test_gaps_of_two_lengths_in_turn_stop_nothing(count):
    """No gap is within a sample of the mean of both, and 'compare' ended there."""
    values = np.full(6_100, np.nan)
    own = np.cumsum(np.resize([5, 9], count))
    values[own] = white(count)

    found = residual_of(recording_of(values), values, 1.0)

    assert found.frequency_hz.size == found.density.size
    assert np.isfinite(found.density).all() and np.isfinite(found.lag_s).all()


def test_of_a_sensor_that_recorded_nothing_no_noise_is_told():
    (noise,) = recorded_noise(recording_of(np.full(500, np.nan)), [NAME]).values()

    assert noise.source is NoiseSource.NONE and noise.sentence == ""
