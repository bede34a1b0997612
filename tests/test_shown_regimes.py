"""Regimes of a comparison as they are shown: that they overlap, and all phases of a gear shift."""

from types import SimpleNamespace

from studies.figures.comparison import regime_figure
from studies.text_of_comparison import OVERLAP, shown_regimes
from studies.text_of_comparison import _regimes as regimes_text
from workbench.comparison.compare import Regime
from workbench.comparison.gear_shift import PHASES

FLOWS = [Regime(f"valve {k} into chamber", 0.9, 0.1) for k in range(24)]
REGIMES = [*FLOWS[:10], Regime("travel", 0.5, 0.2), *FLOWS[10:], Regime("release", 0.0, 0.1)]


def test_every_phase_of_a_shift_is_shown_however_little_error_it_has():
    names = [each.name for each in shown_regimes(REGIMES)]

    assert len(names) == 21 and names[10] == "travel" and names[-1] == "release"
    assert {"travel", "release"} <= set(PHASES)


def test_the_text_says_that_regimes_overlap_and_how_many_are_not_shown():
    lines = regimes_text(REGIMES).splitlines()

    assert lines[-3].startswith("release")
    assert lines[-2:] == ["... and 5 more, in the JSON", OVERLAP]
    assert regimes_text([]) == ""


def test_the_figure_shows_the_same_regimes_and_that_they_overlap():
    each = SimpleNamespace(name="shift", judged="windows", by_regime=REGIMES)
    (axes,) = regime_figure(each).axes

    assert [t.get_text() for t in axes.get_yticklabels()][-1] == "release"
    assert "overlap" in axes.get_title()


def test_the_legend_is_beside_the_bars_where_all_of_them_are_long():
    """Of a recording at rest every regime has all of the time."""
    each = SimpleNamespace(
        name="rest", judged="window", by_regime=[Regime("at rest", 1.0, 1.0)] * 6
    )
    figure = regime_figure(each)
    figure.draw_without_rendering()

    (axes,), (legend,) = figure.axes, figure.legends
    assert axes.get_legend() is None
    assert not legend.get_window_extent().overlaps(axes.get_tightbbox())
