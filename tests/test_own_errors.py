"""Fits weighed by their own errors, and which of two of them is the better one."""

from dataclasses import replace

import numpy as np
import pytest
from test_fitting import NOISE, sines

from workbench.fitting import own_errors
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.own_errors import STALE, better_of, by_own_errors, consistent
from workbench.fitting.unknowns import nominal_unknowns
from workbench.fitting.windows import cut_windows
from workbench.plants import servo_drive

MASS = "slide.mass_kg"
HEAVIER, HELD = 1.5, frozenset(servo_drive().lean().values) - {MASS}


@pytest.fixture(scope="module")
def plant():
    return servo_drive().lean()


@pytest.fixture(scope="module")
def windows(plant):
    """Of a drive whose slide is half as heavy again as the model says."""
    truth = plant.with_values({MASS: HEAVIER * plant.values[MASS]})
    return cut_windows(plant, [sines(truth, NOISE)], NOISE)


def lacking(windows):
    """A fit of the drive, its mass believed to be as the model says: errors stay."""
    fixed = frozenset(windows.plant.values)
    unknowns = nominal_unknowns(windows.plant, {}, fixed - {"chamber_a.dead_volume_m3"})
    return fit_windows(windows, unknowns, iterations=12)


def weighed_by(fit, factor):
    """The fit with weights that tell errors this many times those that it leaves."""
    windows = fit.windows.rescaled(factor * fit.residual)
    return fit_windows(windows, fit.unknowns, fit.point, iterations=0)


def told(fit):
    """Mean square of each output's weighted errors: one where the weights are the fit's own."""
    samples = own_errors.effective_by_output(fit.windows)
    return (fit.residual**2).sum(axis=(1, 2)) / samples


def test_weights_of_a_fit_that_left_far_larger_errors_are_renewed(windows):
    stale = weighed_by(lacking(windows), 5.0)
    found = consistent(stale)

    assert told(stale).min() < 1.0 / STALE
    far, near = (np.abs(np.log(told(each))).max() for each in (stale, found))
    assert near < 0.5 * far


def test_a_fit_whose_weights_are_its_own_stays_as_it_is(windows):
    fit = lacking(windows)
    own = replace(fit.windows, scale=fit.windows.scale * np.sqrt(told(fit))[:, None])
    fit = fit_windows(own, fit.unknowns, fit.point, iterations=0)

    assert consistent(fit) is fit


def test_a_fit_at_its_noise_is_not_weighed_anew(plant, monkeypatch):
    fit = fit_windows(cut_windows(plant, [sines(plant, NOISE)], NOISE), nominal_unknowns(plant))
    monkeypatch.setattr(own_errors, "weighed_anew", pytest.fail)

    assert consistent(fit) is fit
    assert by_own_errors(fit) is fit


def test_the_smaller_errors_win_whatever_the_weights(windows):
    """By weighted squares the one whose weights tell large errors would win."""
    mass = nominal_unknowns(windows.plant, {}, HELD)
    right = weighed_by(fit_windows(windows, mass, iterations=12), 0.5)
    wrong = weighed_by(lacking(windows), 5.0)

    assert wrong.chi2 < right.chi2
    assert better_of(wrong, right) is right
    assert better_of(right, wrong) is right


def test_errors_that_cost_more_by_priors_than_they_fell_are_no_better(windows):
    """The same place, reached by a mass that is believed to be known a hundred times as well."""
    free = nominal_unknowns(windows.plant, {}, HELD)
    fit = fit_windows(windows, free, iterations=12)
    sure = replace(free, scale=free.scale / 100.0)
    start = Point(sure.scaled(fit.plant.values), fit.point.starts)
    dear = fit_windows(windows, sure, start, iterations=0)

    assert dear.chi2 == pytest.approx(fit.chi2)
    assert better_of(dear, fit) is fit
    assert better_of(fit, dear) is fit


def test_effective_samples_are_told_by_output_and_are_no_more_than_recorded(windows):
    samples = own_errors.effective_by_output(windows)

    assert samples.shape == (len(windows.plant.measured),)
    assert np.all(samples <= np.isfinite(windows.measured).sum(axis=(1, 2)))
