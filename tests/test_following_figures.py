"""The error of a step is drawn where its end can be seen, that of a sine whole."""

from types import SimpleNamespace

import numpy as np
import pytest

from studies.figures.following import following_figures
from studies.figures.style import styled
from workbench.recording import Recording

TIME_S = 1e-3 * np.arange(1600)


def error_panel(wanted, seen):
    names = ("rod.position_m", "reference.rod.position_m", "valve.command_v")
    channels = dict(zip(names, (seen, wanted, 0.0 * wanted), strict=True))
    record = SimpleNamespace(recording=Recording("run", 1e-3, channels))
    row = SimpleNamespace(design="lq", estimator="ekf", scenario="task")
    with styled():
        found = following_figures(SimpleNamespace(rows=[row], records=[record]))
    return found["following_task"].axes[1]


@pytest.mark.parametrize(("left_m", "end_mm"), [(1e-4, 2.0), (4e-3, 4.4)])
def test_of_a_step_the_axis_ends_where_its_rest_is_seen_and_says_so(left_m, end_mm):
    """Its first error of 50 mm had hidden what is left in the end."""
    wanted = 0.05 * (TIME_S >= 0.1)
    panel = error_panel(
        wanted, wanted - (0.05 - left_m) * (TIME_S >= 0.1) * (TIME_S < 0.2) - left_m
    )

    assert panel.get_ylim() == pytest.approx((-end_mm, end_mm))
    assert panel.get_title("right") == f"axis cut at {end_mm:g} mm; errors up to 50 mm"


def test_of_a_sine_all_of_the_error_is_drawn():
    wanted = 0.03 * np.sin(2.0 * np.pi * TIME_S)
    panel = error_panel(wanted, wanted - 1e-3 * np.exp(-TIME_S / 0.1))

    assert (
        panel.get_title("right") == "" and panel.get_ylim()[1] <= 0.1 < 1.0 <= -panel.get_ylim()[0]
    )
