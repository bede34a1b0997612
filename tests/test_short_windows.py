"""Where a fit begins once more from short windows: above the noise, by half of it and more."""

from types import SimpleNamespace

import numpy as np
import pytest
from test_fitting import NOISE, sines

from workbench.fitting.errors import at_noise
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.short_windows import better_from_short_windows
from workbench.fitting.unknowns import nominal_unknowns
from workbench.fitting.windows import cut_windows
from workbench.plants import servo_drive


def fitted(share):
    """A fit of what its own plant recorded, the noise taken for so much of what it is."""
    plant = servo_drive().lean()
    believed = {name: share * sigma for name, sigma in NOISE.items()}
    windows = cut_windows(plant, [sines(plant, NOISE)], believed)
    return fit_windows(windows, nominal_unknowns(windows.plant))


@pytest.mark.parametrize(("share", "there"), [(1.0, True), (0.8, False)])
def test_a_mean_square_half_above_that_of_the_noise_is_no_longer_noise(share, there):
    assert at_noise(fitted(share)) is there


def test_one_output_above_its_noise_is_enough():
    fit = fitted(1.0)
    residual = fit.residual.copy()
    residual[0] *= np.sqrt(1.6)
    louder = SimpleNamespace(windows=fit.windows, residual=residual)

    assert at_noise(fit) and not at_noise(louder)


def test_a_fit_at_the_noise_stays_as_it_is():
    problem = SimpleNamespace(base=fitted(1.0))

    assert better_from_short_windows(problem, []) is problem
