"""The falling error as a figure: every step can be seen, and no label runs into another."""

from itertools import pairwise

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from studies.figures.improvement import budget_figure, errors_figure
from studies.figures.style import styled
from workbench.diagnosis.improvement import Stage
from workbench.fitting.errors import SignalError


def test_the_last_steps_of_a_budget_can_be_seen_beside_the_first():
    stages = [Stage(f"step {k}", size, size) for k, size in enumerate((1.7e4, 2600.0, 106.0, 20.6))]
    (axes,) = budget_figure(stages).axes
    low, high = (axes.transAxes.inverted().transform(axes.transData.transform((0, size)))[1]
                 for size in (20.6, 106.0))  # fmt: skip

    assert axes.get_ylim()[0] == 1.0 and axes.get_ylim()[1] > 1.7e4
    assert high - low > 0.1


def test_a_budget_below_the_noise_stays_on_its_axis():
    (axes,) = budget_figure([Stage("as it came", 0.9, 0.8), Stage("+ leak", 0.2, 0.3)]).axes

    assert 0.0 < axes.get_ylim()[0] < 0.2


def test_each_state_of_a_rig_is_drawn_with_its_own_errors():
    rmse_m = {"as it came": 3e-3, "refitted": 2e-3, "in the end": 1e-3}
    states = {
        words: {"train": {"slide.position": SignalError(size_m, 50.0, 1e-5)}}
        for words, size_m in rmse_m.items()
    }
    (axes,) = errors_figure(states, {"slide.position": "slide.position_m"}).axes
    drawn = {bars.get_label(): [bar.get_height() for bar in bars] for bars in axes.containers}

    assert drawn == {words: [pytest.approx(1e3 * size_m)] for words, size_m in rmse_m.items()}


@pytest.mark.parametrize(
    ("labels", "degrees"),
    [
        (["+ valve_lag", "+ spring_force"], 0.0),
        (["+ sensor_offset@chamber_a.pressure + spring_force", "+ valve_dead_zone"], 30.0),
        (["+ sensor_offset@chamber_a.pressure"] * 3, 0.0),
        (["sensor_scale@chamber_b.pressure for valve_lag"] * 7, 30.0),
    ],
)
def test_labels_of_the_budget_keep_off_each_other(labels, degrees):
    figure = budget_figure([Stage(label, 2.0, 3.0) for label in ("as it came", *labels)])
    with styled():
        FigureCanvasAgg(figure).draw()
    words = figure.axes[0].get_xticklabels()
    boxes = [each.get_window_extent() for each in words]

    assert {each.get_rotation() for each in words} == {degrees}
    assert degrees or not any(one.overlaps(other) for one, other in pairwise(boxes))


def test_the_two_of_a_pair_stand_on_lines_of_their_own():
    pair = Stage("+ sensor_offset@chamber_a.pressure + spring_force", 2.0, 3.0)
    (axes,) = budget_figure([Stage("as it came", 4.0, 5.0), pair]).axes

    lines = axes.get_xticklabels()[1].get_text().splitlines()
    assert lines == ["+ sensor_offset", "@chamber_a.pressure", "+ spring_force"]


@pytest.mark.parametrize("share", [0.99, 0.9, 0.8, 0.6, 0.3])
@pytest.mark.parametrize("count", [3, 6])
def test_no_size_touches_the_outline_of_a_step_that_changes_little(share, count):
    stages = [Stage(f"step {k}", 900.0 * share**k, 7e4 * share**k) for k in range(count)]
    figure = budget_figure(stages)
    with styled():
        FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    tops = [
        axes.transData.transform((0.0, size))[1]
        for sizes in ([s.train for s in stages], [s.validation for s in stages])
        for size in (sizes[0], *sizes)[:count]
    ]
    boxes = [words.get_window_extent() for words in axes.texts]

    assert len(boxes) == len(tops) == 2 * count
    assert not any(box.y0 - 0.5 < top < box.y1 + 0.5 for box, top in zip(boxes, tops, strict=True))


def test_bars_say_what_they_are_weighed_by_and_what_is_not_known_has_none():
    stages = [Stage("as it came", 9.0, 11.0), Stage("+ leak", 2.0, float("nan"))]
    (axes,) = budget_figure(stages).axes

    assert "weighed by sensor noise alone" in axes.get_title()
    assert [words.get_text() for words in axes.texts] == ["9", "2", "11"]
