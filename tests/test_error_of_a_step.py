"""The error of a step is drawn near zero, but never so near that the error at the end is cut."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from studies.closed_loop_figures import draw_error
from workbench.recording import Recording


def drawn(end_m, step_m=0.1):
    """The axes of a step that ends so far from its target."""
    position = np.concatenate([np.zeros(300), np.full(1000, step_m + end_m)])
    wanted = np.concatenate([np.zeros(100), np.full(1200, step_m)])
    channels = {"slide.position_m": position, "reference.slide.position_m": wanted}
    axes = Figure().subplots()
    draw_error(axes, {"lq, ekf": SimpleNamespace(recording=Recording("run", 1e-3, channels))})
    return axes


@pytest.mark.parametrize("end_m", [12e-3, -12e-3])
def test_an_error_at_the_end_is_within_the_axis_and_the_cut_is_told(end_m):
    axes = drawn(end_m)

    assert axes.get_ylim() == pytest.approx((-13.2, 13.2))
    assert axes.get_title(loc="right") == "axis cut at 13 mm; errors up to 100 mm"


def test_a_small_error_is_seen_large_and_a_whole_one_is_not_cut():
    assert drawn(0.1e-3).get_ylim() == pytest.approx((-1.0, 1.0))
    assert "axis cut at 1 mm" in drawn(0.1e-3).get_title(loc="right")
    whole = drawn(0.0, 5e-3)
    assert whole.get_title(loc="right") == "" and whole.get_ylim()[0] < -5.0
