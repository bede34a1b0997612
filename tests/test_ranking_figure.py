"""The figure of a ranking: its key, and bars of refits beside those of a scan."""

import csv
from dataclasses import replace

from matplotlib.colors import to_hex
from test_report import LAG, diagnosis, ranked

from studies.figures.diagnosis import HOLLOW, diagnosis_figures
from studies.figures.style import BLUE, save
from workbench.diagnosis.result import Verdict


def test_the_key_of_a_tied_ranking_fits_its_page():
    tied = diagnosis(Verdict.RECORDING_TOO_WEAK, tied=("spool_leak",))
    figure = diagnosis_figures(tied)["ranking"]
    figure.draw_without_rendering()
    drawn = figure.get_tightbbox()  # in inches
    width, height = figure.get_size_inches()

    assert "=: cannot be told apart here" in figure.get_suptitle()
    assert drawn.x0 >= 0.0 and drawn.y0 >= 0.0
    assert drawn.x1 <= width and drawn.y1 <= height


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
