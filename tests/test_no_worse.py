"""A fit is left no worse than the values that its plant came with."""

import numpy as np
import pytest
from test_fitting import NOISE, sines

from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.no_worse import no_worse_than_it_came
from workbench.fitting.start_states import as_it_came, refit_starts
from workbench.fitting.unknowns import nominal_unknowns
from workbench.fitting.windows import cut_windows
from workbench.plants import servo_drive

LOUD = {name: 10.0 * sigma for name, sigma in NOISE.items()}


@pytest.fixture(scope="module")
def windows():
    """Of the plant itself: its own values are as good as any."""
    plant = servo_drive().lean()
    return cut_windows(plant, [sines(plant, LOUD)], LOUD)


def given_up(windows, deviations):
    """A fit that ended so many prior deviations off, each start state where it suits that best."""
    unknowns = nominal_unknowns(windows.plant)
    t = np.resize((deviations, -deviations), len(unknowns))
    starts = refit_starts(windows, unknowns.values(t)).point.starts
    return fit_windows(windows, unknowns, Point(t, starts), iterations=0)


def test_a_fit_that_ended_in_a_valley_above_its_beginning_begins_there_anew(windows):
    stuck = given_up(windows, 1.0)
    came, _ = as_it_came(stuck, None)
    found = no_worse_than_it_came(stuck)

    assert came.cost < stuck.cost
    assert found.cost <= came.cost
    assert found.windows is stuck.windows


def test_a_fit_that_is_lower_stays_as_it_is(windows):
    fitted = fit_windows(windows, nominal_unknowns(windows.plant))

    assert fitted.cost < as_it_came(fitted, None)[0].cost
    assert no_worse_than_it_came(fitted) is fitted


def test_a_fit_of_nothing_stays_as_it_is(windows):
    nothing = refit_starts(windows, windows.plant.values)

    assert no_worse_than_it_came(nothing) is nothing
