"""The figure of a ranking: its key, and bars of refits beside those of a scan."""

import csv
from dataclasses import replace

import pytest
from matplotlib.colors import to_hex
from test_report import LAG, LEAK, PLANT, diagnosis, ranked

from studies.figures.diagnosis import HOLLOW, diagnosis_figures
from studies.figures.style import BLUE, save
from workbench.diagnosis.result import Verdict

OFFSET = PLANT.candidates["sensor_offset@slide.position"]


def test_the_key_of_a_tied_ranking_fits_its_page():
    tied = diagnosis(Verdict.RECORDING_TOO_WEAK, tied=("spool_leak",))
    figure = diagnosis_figures(tied)["ranking"]
    figure.draw_without_rendering()
    drawn = figure.get_tightbbox()  # in inches
    width, height = figure.get_size_inches()

    assert "=: cannot be told apart here" in figure.get_suptitle()
    assert drawn.x0 >= 0.0 and drawn.y0 >= 0.0
    assert drawn.x1 <= width and drawn.y1 <= height


def test_all_of_a_crowd_are_marked_and_no_other():
    crowd = (LAG.name, "spool_leak", "supply_droop")
    found = diagnosis(Verdict.RECORDING_TOO_WEAK)
    leader, other = found.ranking
    rows = (replace(leader, crowd=crowd), replace(other, accepted=True), ranked(OFFSET, 0.05))
    figure = diagnosis_figures(replace(found, ranking=rows))["ranking"]
    names = [label.get_text() for label in figure.axes[0].get_yticklabels()]

    assert names == [f"= {LEAK.name}", f"= {LAG.name}", OFFSET.name]


def test_bars_of_a_scan_are_hollow_and_those_of_a_refit_are_not():
    (axes,) = diagnosis_figures(diagnosis())["ranking"].axes
    looks = {
        bars.get_label(): (to_hex(bar.get_facecolor()), bar.get_hatch())
        for bars in axes.containers
        for bar in bars
    }

    assert looks["training, only scanned"] == (to_hex("white"), HOLLOW["hatch"])
    assert looks["training"] == (to_hex(BLUE), None)


def test_a_scanned_effect_does_not_look_like_a_refit_in_the_ranking(tmp_path):
    save(diagnosis_figures(diagnosis())["ranking"], tmp_path / "ranking", "workbench diagnose")
    with (tmp_path / "ranking.csv").open(newline="") as file:
        told = {(curve, effect): drop for _, curve, effect, drop in list(csv.reader(file))[1:]}

    assert told == {
        ("training", "chamber_leak@chamber_a"): "93",
        ("validation", "chamber_leak@chamber_a"): "91",
        ("training, only scanned", "valve_lag"): "10",
    }


def test_an_error_that_falls_below_the_noise_is_all_of_the_misfit_as_in_text_and_document():
    found = diagnosis()
    whole = replace(found.ranking[0], drop_train=1.08, drop_validation=1.2)
    (axes,) = diagnosis_figures(replace(found, ranking=(whole,)))["ranking"].axes

    assert [bar.get_width() for bars in axes.containers for bar in bars] == [100.0, 100.0]


def test_what_only_would_pass_is_not_bold():
    found = diagnosis()
    rows = (*found.ranking, ranked(LAG, 0.2, accepted=True))
    (axes,) = diagnosis_figures(replace(found, ranking=rows))["ranking"].axes

    assert [label.get_fontweight() for label in axes.get_yticklabels()] == [
        "bold", "normal", "normal",
    ]  # fmt: skip


def with_worse(train, validation):
    """A diagnosis whose second effect was refitted to these drops."""
    found = diagnosis()
    worse = replace(ranked(LAG, train), drop_validation=validation)
    return replace(found, ranking=(found.ranking[0], worse))


def test_what_makes_the_misfit_larger_has_a_bar_to_the_left_and_its_value_in_the_table(tmp_path):
    figure = diagnosis_figures(with_worse(0.3, -0.454))["ranking"]
    save(figure, tmp_path / "ranking", "workbench diagnose")
    (axes,) = figure.axes
    with (tmp_path / "ranking.csv").open(newline="") as file:
        told = {(curve, effect): drop for _, curve, effect, drop in list(csv.reader(file))[1:]}

    assert told["validation", "valve_lag"] == "-45.4" and told["training", "valve_lag"] == "30"
    assert len(told) == 4
    assert [text.get_text() for text in axes.texts] == ["\N{MINUS SIGN}45"]
    assert "bars cut at \N{MINUS SIGN}20 %" in figure.get_suptitle()


def test_a_cut_bar_ends_where_it_says_and_its_number_keeps_off_it_and_the_axis():
    figure = diagnosis_figures(with_worse(-4.3e8, -9.38))["ranking"]
    figure.draw_without_rendering()
    (axes,) = figure.axes
    (*_, first), (*_, second) = (bars.patches for bars in axes.containers)
    left = axes.get_window_extent().x0

    for bar, words in zip((first, second), axes.texts, strict=True):
        shown = axes.transData.inverted().transform(bar.get_clip_box())
        number = words.get_window_extent()
        assert shown[:, 0] == pytest.approx([-20.0, 105.0])
        assert left < number.x0 and number.x1 < axes.transData.transform((-20.0, 0.0))[0]
    one, other = (words.get_window_extent() for words in axes.texts)
    assert not one.overlaps(other)
    assert [words.get_text() for words in axes.texts] == [
        "\N{MINUS SIGN}4e+10", "\N{MINUS SIGN}938",
    ]  # fmt: skip


def test_a_little_larger_misfit_is_not_cut_and_none_leaves_the_axis_as_it_was():
    small, none = (diagnosis_figures(with_worse(0.3, drop))["ranking"] for drop in (-0.05, 0.2))

    assert small.axes[0].get_xlim() == (-20.0, 105.0) and not small.axes[0].texts
    assert none.axes[0].get_xlim() == (0.0, 105.0)
    assert not any("cut" in each.get_suptitle() for each in (small, none))
