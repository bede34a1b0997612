"""The figure of a leg's foot: its way and its distance, from the angles of a run."""

from types import SimpleNamespace

import numpy as np
import pytest
from figure_faults import faults

from studies.figures.foot import foot_figures
from studies.figures.style import styled
from studies.following_check import tasks_of
from workbench.plants.crr_leg import crr_leg
from workbench.recording import Recording

TURNED_RAD = 0.01


@pytest.fixture(scope="module")
def figure():
    """A leg whose first joint is always a hundredth of a radian ahead."""
    plant = crr_leg()
    wanted = tasks_of(plant)["ellipse"].reference
    first = next(iter(wanted))
    seen = {name: row + TURNED_RAD * (name == first) for name, row in wanted.items()}
    channels = {**seen, **{f"reference.{name}": row for name, row in wanted.items()}}
    record = SimpleNamespace(recording=Recording("run", 1e-3, channels))
    row = SimpleNamespace(design="lq", estimator="ekf", scenario="ellipse")
    with styled():
        return foot_figures(SimpleNamespace(rows=[row], records=[record]), plant)["foot_ellipse"]


def test_the_wanted_way_is_the_ellipse_of_100_by_60_mm(figure):
    reference, _ = figure.axes[0].lines
    assert np.ptp(reference.get_xdata()) == pytest.approx(100.0, rel=1e-3)
    assert np.ptp(reference.get_ydata()) == pytest.approx(60.0, rel=1e-3)


def test_the_distance_is_that_of_a_chord_about_the_upright_axis(figure):
    """Turned by an angle, a foot r from the axis is 2 r sin(angle / 2) away; Z stays."""
    way, apart = figure.axes
    reference, seen = way.lines
    away = apart.lines[0].get_ydata()

    assert seen.get_ydata() == pytest.approx(reference.get_ydata())
    r = away / (2.0 * np.sin(TURNED_RAD / 2.0))  # mm from the upright axis
    across = np.abs(reference.get_xdata())
    assert np.all(r >= across - 1e-9) and r.min() > 100.0
    x = np.sqrt(r**2 - across**2)
    assert np.ptp(x) < 1e-6  # the ellipse is upright: X does not change


def test_it_is_fit_for_a_journal(figure):
    assert not faults(figure)
