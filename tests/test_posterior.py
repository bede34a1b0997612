"""Standard deviations of a fit: how far it would be off on other recordings."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lsim

from tests.linear_plant import DAMPING_N_S_M, MASS_KG, STIFFNESS_N_M, cart
from workbench.diagnosis.size import _forms
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.posterior import (
    _normal,
    _share_held,
    both_deviations,
    posterior_covariance,
)
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import cut_windows
from workbench.recording import Recording
from workbench.rig import default_rig

SAMPLE_S, LENGTH, WINDOWS = 0.02, 100, 16
NOISE_M, SCALE_KG = 2e-4, 0.2
MASS = "cart.mass_kg"


@pytest.fixture(scope="module")
def plant():
    return cart()


def fitted(plant, stiffness_spread, rng, windows_each=1):
    """The mass, fitted to carts on springs that differ from one recording to the next.

    Each recording is cut into so many windows, of which the states at their starts are known.
    """
    sigma = {"cart.position_m": NOISE_M}
    pushes = rng.uniform(-5.0, 5.0, (WINDOWS, LENGTH // 5)).repeat(5, axis=1)
    springs = STIFFNESS_N_M * (1.0 + stiffness_spread * rng.standard_normal(WINDOWS))
    paths = [moved(spring, push) for spring, push in zip(springs, pushes, strict=True)]
    recordings = [
        Recording(
            f"cart {k}",
            SAMPLE_S,
            {
                "drive.force_n": push,
                "cart.position_m": path[:, 0] + NOISE_M * rng.standard_normal(LENGTH),
            },
        )
        for k, (path, push) in enumerate(zip(paths, pushes, strict=True))
    ]
    most = windows_each * WINDOWS
    windows = cut_windows(plant, recordings, sigma, SAMPLE_S * LENGTH / windows_each, most)
    known = np.concatenate([path[:: LENGTH // windows_each] for path in paths]).T
    windows = replace(windows, start=known, start_deviation=np.full_like(known, 1e-6))
    unknowns = Unknowns((MASS,), *map(np.array, ([MASS_KG], [SCALE_KG], [0.5], [8.0], [1e-6])))
    fit = fit_windows(windows, unknowns, iterations=8)
    windows = windows.rescaled(fit.residual)
    return fit_windows(windows, unknowns, fit.point, iterations=8)


def moved(spring, push):
    """Position and velocity of a cart from rest, exact for a force that holds between samples."""
    A = [[0.0, 1.0], [-spring / MASS_KG, -DAMPING_N_S_M / MASS_KG]]
    system = (A, [[0.0], [1.0 / MASS_KG]], np.eye(2), np.zeros((2, 1)))
    return lsim(system, push, SAMPLE_S * np.arange(LENGTH), interp=False)[1]


@pytest.mark.parametrize("spread", [0.0, 0.05], ids=["noise alone", "springs that differ"])
def test_a_deviation_tells_how_far_fits_of_other_recordings_are_apart(plant, spread):
    """With sixteen windows it comes out a quarter low; the curvature alone a tenth of it."""
    rng = np.random.default_rng(1)
    fits = [fitted(plant, spread, rng) for _ in range(20)]
    apart = np.std([fit.plant.values[MASS] for fit in fits])
    told, curvature = np.median([both_deviations(fit) for fit in fits], axis=0).ravel()

    assert told == pytest.approx(apart, rel=0.4)
    assert spread == 0.0 or curvature < told / 5.0


def test_windows_that_follow_one_another_are_wrong_alike(plant):
    """Five windows of each recording have the same spring; who counts them one by one is too sure.

    The measure is that of whole recordings as the groups, which only this test knows of.
    """
    rng = np.random.default_rng(2)
    fits = [fitted(plant, 0.05, rng, windows_each=5) for _ in range(8)]
    whole = np.median([of_recordings(fit) for fit in fits])
    told = np.median([both_deviations(fit)[0] for fit in fits])
    alone = [replace(f, windows=replace(f.windows, firsts=((0,),) * len(f.windows))) for f in fits]
    one_by_one = np.median([both_deviations(fit)[0] for fit in alone])

    assert told == pytest.approx(whole, rel=0.25)
    assert one_by_one < 0.7 * whole


def test_neighbours_that_differ_by_chance_make_nothing_surer(plant):
    """Of few windows the products with the next may well come out negative."""
    fits = [fitted(plant, 0.0, np.random.default_rng(k), windows_each=2) for k in range(4)]
    firsts = ((0,),) * len(fits[0].windows)
    alone = [replace(fit, windows=replace(fit.windows, firsts=firsts)) for fit in fits]
    told, one_by_one = ([both_deviations(fit)[0] for fit in each] for each in (fits, alone))

    assert np.all(np.array(told) >= np.array(one_by_one))
    assert np.any(np.array(told) == np.array(one_by_one))


def of_recordings(fit):
    """Standard deviation of the mass where the errors of a recording go together."""
    normal = _normal(fit)
    pull = np.einsum("wrp,wr->w", normal.derivatives, normal.residual)
    pulls = pull.reshape(WINDOWS, -1).sum(axis=1)
    return SCALE_KG * np.sqrt(WINDOWS / (WINDOWS - 1) * pulls @ pulls) / normal.hessian[0, 0]


def test_a_deviation_is_told_by_the_errors_of_the_fit_itself(plant):
    """Its windows may still have the scales of a plant that was ten times as far off."""
    found = fitted(plant, 0.0, np.random.default_rng(3))
    coarse = replace(found.windows, scale=10.0 * found.windows.scale)
    poor = fit_windows(coarse, found.unknowns, found.point, iterations=0)
    again, known = both_deviations(poor), both_deviations(found)

    assert np.ravel(again) == pytest.approx(np.ravel(known), rel=0.05)
    assert posterior_covariance(poor) == pytest.approx(posterior_covariance(found), rel=0.1)


def test_a_strength_is_known_better_with_its_forms_held():
    """As the variance of one normal variable where others are known: S_aa - S_ab S_bb^-1 S_ba."""
    root = np.random.default_rng(4).standard_normal((9, 4))
    hessian = root.T @ root
    S = np.linalg.inv(hessian)
    a, b = 1, [0, 3]
    held = S[a, a] - S[a, b] @ np.linalg.solve(S[np.ix_(b, b)], S[b, a])

    assert _share_held(hessian, S, a, b) == pytest.approx(np.sqrt(held / S[a, a]))
    assert _share_held(hessian, S, a, []) == pytest.approx(1.0)


def test_the_forms_that_are_held_are_those_that_were_fitted_with_a_strength():
    plant = default_rig("servo_drive").plant
    strength = "friction.position_share"
    length, phase = "friction.wavelength_m", "friction.phase_rad"
    unknowns = SimpleNamespace(names=(strength, phase, "slide.mass_kg"))
    fit = SimpleNamespace(unknowns=unknowns, windows=SimpleNamespace(plant=plant))

    assert _forms(fit, (strength, length, phase)) == {strength: [phase]}
    assert _forms(fit, (phase, "slide.mass_kg")) == {}
