"""Fits of which what went implausibly far begins again at its prior."""

import numpy as np
import pytest
from test_shaken import fitted, left_at, windows  # noqa: F401  (fixtures)

from studies.commissioning import recorded
from studies.gear_shift_study import _truth
from workbench.fitting import begun_anew as module
from workbench.fitting.begun_anew import IMPLAUSIBLE, begun_anew
from workbench.fitting.errors import only_noise
from workbench.fitting.fit import fit
from workbench.fitting.linearised import Point
from workbench.plants import gearbox
from workbench.rig import default_rig

FAR = {"slide.mass_kg": 6.0, "supply.pressure_pa": -6.0}


def astray(fitted, times):  # noqa: F811
    """The fit as if it had given up with two parameters so many times six deviations off."""
    t = fitted.point.t.copy()
    for name, far in FAR.items():
        t[fitted.unknowns.names.index(name)] = times * far
    return left_at(fitted, Point(t, fitted.point.starts))


def test_a_fit_with_two_values_far_off_comes_to_the_right_ones(fitted):  # noqa: F811
    stuck = astray(fitted, 1.0)
    found = begun_anew(stuck)

    assert not only_noise(stuck) and only_noise(found)
    for row in map(fitted.unknowns.names.index, FAR):
        assert found.point.t[row] == pytest.approx(fitted.point.t[row], abs=0.3)  # of six


def test_what_is_near_its_prior_stays_where_it_was(fitted, monkeypatch):  # noqa: F811
    begun = []
    monkeypatch.setattr(module, "ROUNDS", 1)
    monkeypatch.setattr(
        module,
        "fitted_twice",
        lambda windows, unknowns, t: begun.append(t) or fitted,  # noqa: F811
    )
    stuck = astray(fitted, 1.0)
    begun_anew(stuck)
    far = np.array([name in FAR for name in stuck.unknowns.names])

    assert not begun[0][far].any()
    np.testing.assert_array_equal(begun[0][~far], stuck.point.t[~far])


def test_a_fit_that_nothing_took_far_stays(fitted):  # noqa: F811
    near = astray(fitted, 0.9 * IMPLAUSIBLE / 6.0)

    assert not only_noise(near)
    assert begun_anew(near) is near


def test_a_fit_that_leaves_only_noise_stays(fitted):  # noqa: F811
    assert only_noise(fitted)
    assert begun_anew(fitted) is fitted


@pytest.mark.slow
@pytest.mark.parametrize("draw", [8, 16])
def test_what_is_left_of_a_drawn_gearbox_is_only_noise(draw):
    """Of study gear-shifts, each with a shift that was late after commissioning.

    Draw 8 had its valve's spring four deviations off and errors a third above the noise; draw 16
    errors a tenth above the noise, which the recording tells a quarter too large.
    """
    found = fit(default_rig(gearbox()), [recorded(_truth(draw - 1), draw - 1)])

    assert only_noise(found.fit)
