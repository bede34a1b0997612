"""Whether a fit leaves only noise where the quiet parts of a recording tell too much of it."""

from types import SimpleNamespace

import numpy as np
import pytest
from test_fitting import NOISE, sines

from workbench.fitting.errors import at_noise, only_noise, white_level
from workbench.fitting.own_errors import better_of
from workbench.fitting.start_states import refit_starts
from workbench.fitting.windows import cut_windows
from workbench.plants import servo_drive

BELIEVED = 1.25  # of the true noise, as on a gearbox that hardly rests


@pytest.fixture(scope="module")
def fit():
    """The true plant on what it recorded, the noise taken for too large."""
    plant = servo_drive().lean()
    believed = {name: BELIEVED * sigma for name, sigma in NOISE.items()}
    return refit_starts(cut_windows(plant, [sines(plant, NOISE)], believed))


def with_wave(fit, share):
    """The fit with errors of 10 Hz on top, RMS in shares of the true noise."""
    windows = fit.windows
    length = windows.measured.shape[2]
    wave = share * np.sqrt(2.0) * np.sin(2.0 * np.pi * 10.0 * 1e-3 * np.arange(length))
    in_si = windows.noise[:, None, None] / BELIEVED * wave
    residual = fit.residual + in_si / windows.scale[:, :, None]
    chi2 = float(np.sum(residual**2))
    cost = fit.cost - fit.chi2 + chi2
    return SimpleNamespace(
        windows=windows, residual=residual, unsimulated=fit.unsimulated, chi2=chi2, cost=cost
    )


def test_white_errors_at_the_noise_are_only_noise(fit):
    assert only_noise(fit)


def test_slow_errors_below_a_noise_that_is_told_too_large_are_not(fit):
    wavy = with_wave(fit, 0.45)

    assert at_noise(wavy) and not only_noise(wavy)


def test_errors_far_above_the_noise_are_not_noise_though_they_are_white(fit):
    loud = with_wave(fit, 0.0)
    loud.residual = 2.0 * loud.residual

    assert not only_noise(loud)


def test_slow_errors_do_not_enter_the_white_level(fit):
    noise = fit.windows.noise / BELIEVED

    np.testing.assert_allclose(white_level(fit), noise, rtol=0.05)
    np.testing.assert_allclose(white_level(with_wave(fit, 0.45)), white_level(fit), rtol=0.01)


def test_samples_that_are_not_recorded_are_not_neighbours(fit):
    windows = fit.windows
    measured = windows.measured.copy()
    measured[:, :, ::2] = np.nan
    gone = SimpleNamespace(measured=measured, scale=windows.scale)
    bare = SimpleNamespace(windows=gone, residual=fit.residual, unsimulated=fit.unsimulated)

    assert np.isnan(white_level(bare)).all()


def test_of_two_fits_below_that_noise_the_one_without_slow_errors_is_better(fit):
    wavy = with_wave(fit, 0.3)

    assert better_of(wavy, fit) is fit
    assert better_of(fit, wavy) is fit


def test_only_noise_is_better_than_slow_errors_whatever_its_priors_cost(fit):
    wavy, dear = with_wave(fit, 0.45), with_wave(fit, 0.0)
    dear.cost += 1e5

    assert only_noise(dear) and not only_noise(wavy)
    assert better_of(wavy, dear) is dear
    assert better_of(dear, wavy) is dear
    assert better_of(dear, fit) is fit
