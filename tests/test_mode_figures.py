"""Figures of modes in time: what is drawn is what the modes do."""

from itertools import pairwise

import numpy as np
import pytest

from linearize.cuts import Interval
from linearize.hybrid_simulation import sampled_hybrid
from linearize.modes import hybrid_modes
from linearize.standard import COMMAND, POSITION, VELOCITY, standard_modes
from studies.figures.modes import MARKERS, pole_figure
from studies.figures.prediction import placement_figure, point_figure
from studies.mode_pictures import STEP_S, map_figure, step_figure, step_of
from workbench.plants.servo_drive import servo_drive


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


def test_the_map_shows_in_every_panel_what_is_active_there(hybrid):
    figure = map_figure(sampled_hybrid(hybrid, STEP_S))

    assert len(figure.axes) == 3
    for axes, command_v in zip(figure.axes, (4.6, 4.95, 5.3), strict=True):
        (mesh,) = axes.collections
        corners, values = np.asarray(mesh.get_coordinates()), np.asarray(mesh.get_array())
        middles = (corners[1:, 1:] + corners[:-1, :-1]) / 2.0
        for row, column in ((3, 10), (36, 36), (70, 60)):
            position_mm, velocity_m_s = middles[row, column]
            signals = {
                COMMAND: command_v, POSITION: position_mm * 1e-3, VELOCITY: velocity_m_s
            }  # fmt: skip
            mode = hybrid.modes[int(values[row, column]) - 1]
            assert mode is hybrid.active(signals)


def test_the_legend_of_the_map_says_what_its_colours_mean(hybrid):
    figure = map_figure(sampled_hybrid(hybrid, STEP_S))
    (legend,) = figure.legends
    mesh = figure.axes[0].collections[0]
    words = [text.get_text() for text in legend.get_texts()]

    assert legend.get_title().get_text().startswith("active mode by colour and number")
    for word, patch in zip(words, legend.get_patches(), strict=True):
        assert patch.get_facecolor() == pytest.approx(mesh.to_rgba(int(word.split()[0])), abs=1e-6)


def test_the_step_ends_where_it_should_and_names_the_modes_it_passes(hybrid):
    """The standard modes end 10 % of the way beyond the plant."""
    step = step_of({"modes": hybrid})
    figure = step_figure(step)

    position, *_, active = figure.axes
    names = [label.get_text() for label in active.get_yticklabels()]
    assert np.ptp(step.seen.states[0]) > 0.05
    assert step.end_share("modes") < 0.12
    assert names[0] == "closed stick middle"
    assert "charge a slide + middle" in names
    assert [line.get_label() for line in position.lines] == ["plant", "modes"]
    assert np.ptp(position.lines[1].get_ydata()) == pytest.approx(
        1e3 * np.ptp(step.runs["modes"].states[0])
    )


def test_the_curve_has_logarithmic_axes_and_every_line():
    figure = placement_figure(
        [3, 10, 27], {"placed": [0.06, 0.03, 0.02]}, {"standard": (27, 0.05)}, {"single": 0.08}
    )

    (axes,) = figure.axes
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert [line.get_label() for line in axes.lines] == ["placed", "standard", "single"]


def test_every_pole_is_in_the_map_of_its_kind(hybrid):
    figure = point_figure(hybrid, VELOCITY, POSITION)

    counts = [len(axes.collections[0].get_offsets()) for axes in figure.axes[:3]]
    assert counts == [36, 18, 36]


def test_poles_of_more_regions_than_there_are_markers_are_all_drawn_and_told_apart():
    """As of a file of cuts with many intervals."""
    ends = [-np.inf, *(0.025 * k for k in range(1, len(MARKERS) + 2)), np.inf]
    parts = [
        Interval(f"part {k}", low, high, point=0.025 * k + 0.01)
        for k, (low, high) in enumerate(pairwise(ends))
    ]
    figure = pole_figure(hybrid_modes(servo_drive(), {POSITION: parts}))

    drawn = [line for axes in figure.axes for line in axes.lines if len(line.get_xdata()) > 2]
    assert [line.get_label() for line in drawn] == [part.label for part in parts]
    assert len({(line.get_marker(), line.get_color()) for line in drawn}) == len(parts)
