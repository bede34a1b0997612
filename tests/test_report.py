"""Results as text, JSON and figures."""

import json
import math
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from studies.documents import diagnosis_document
from studies.figures.diagnosis import diagnosis_figures
from studies.figures.improvement import before_after_figure, budget_figure
from studies.figures.modes import pole_figure
from studies.figures.style import new_figure, save, styled
from studies.text import columns, shown
from studies.text_of_results import correlation_lines, diagnosis_text, unit_names
from workbench.diagnosis.improvement import Stage
from workbench.diagnosis.located import Where
from workbench.diagnosis.missing_term import Dependence
from workbench.diagnosis.result import (
    DecidedBy,
    Diagnosis,
    Law,
    NextRecording,
    Ranked,
    Size,
    Verdict,
)
from workbench.diagnosis.verdict import sentence
from workbench.effect import Kind
from workbench.effects.empirical import FORCES
from workbench.fitting.errors import SignalError
from workbench.plants import PLANTS

PLANT = PLANTS["servo_drive"]()
UNITS = unit_names(PLANT.measured)
LEAK, LAG = (PLANT.candidates[name] for name in ("chamber_leak@chamber_a", "valve_lag"))


def ranked(candidate, drop, accepted=False, tied=(), decided_by=DecidedBy.REFIT):
    size = {candidate.strength: Size(5.1e-8, 2e-9)} if decided_by is DecidedBy.REFIT else {}
    return Ranked(
        candidate=candidate,
        kind=Kind.EFFECT,
        size=size,
        drop_train=drop,
        drop_validation=drop - 0.02 if decided_by is DecidedBy.REFIT else math.nan,
        tied_with=tied,
        compensable=0.12,
        decided_by=decided_by,
        accepted=accepted,
        reasons=() if accepted else ("explains too little",),
        drop_wide=0.5,
        modification_index=1234.0,
    )


def diagnosis(verdict=Verdict.FOUND, tied=(), law=None):
    """A diagnosis as it could be, without any of the work."""
    time_s = 5e-3 * np.arange(400)
    bins = np.array([[4e5, 5e5, 6e5], [-1e-4, -2e-4, -3e-4], [1e-5, 1e-5, 2e-5]])
    where = Where(
        balance="chamber_a.mass",
        by_balance={"chamber_a.mass": 812.0, "slide.momentum": -9.0},
        term_name="mass_flow_kg_s",
        time_s=time_s,
        term=-2e-4 + 1e-5 * np.sin(time_s),
        term_deviation=np.full(400, 2e-5),
        against=(
            Dependence("chamber_a.pressure_pa", 0.81, bins),
            Dependence("rate of valve.command_v", 0.2, bins),
        ),
        by_regime={"valve closed": 0.74, "at rest": 0.5},
    )
    before = {"train": {"chamber_a.pressure": SignalError(8123.0, 71.0, 400.0)}, "validation": {}}
    after = {"train": {"chamber_a.pressure": SignalError(900.0, math.nan, 400.0)}}
    rows = (ranked(LEAK, 0.93, True, tied), ranked(LAG, 0.1, decided_by=DecidedBy.SCAN))
    return Diagnosis(
        rig_name="drive 7",
        verdict=verdict,
        sentence="a leak",
        ranking=rows,
        where=where,
        before=before,
        after=after,
        law=law,
        warned=(),
        base=None,
        base_validation=None,
    )


def test_a_diagnosis_has_the_keys_of_the_contract():
    document = diagnosis_document(diagnosis(), UNITS)

    assert document["schema"] == "workbench.diagnosis/1"
    assert (document["verdict"], document["effect"], document["at"]) == (
        "found", "chamber_leak", "chamber_a",
    )  # fmt: skip
    first = document["ranking"][0]
    assert first["size"] == {"area": {"value": 5.1e-8, "unit": "m^2", "std": 2e-9}}
    assert first["error_drop_train"] == 0.93
    assert first["error_drop_validation"] == pytest.approx(0.91)
    assert (first["tied_with"], first["compensable"]) == ([], 0.12)
    assert (first["error_drop_wide_priors"], first["modification_index"]) == (0.5, 1234.0)
    assert (first["decided_by"], first["kind"]) == ("refit", "effect")
    where = document["where"]
    assert where["balance"] == "chamber_a.mass"
    assert where["by_balance"]["chamber_a.mass"] == 812.0
    assert where["against"][0] == {"variable": "chamber_a.pressure", "explains": 0.81}
    assert where["by_regime"][0] == {"regime": "valve closed", "share_of_error": 0.74}
    error = document["before"]["train"]["chamber_a.pressure"]
    assert (error["rmse"], error["unit"], error["fit_percent"]) == (8123.0, "Pa", 71.0)
    assert document["after"]["validation"] == {}


def test_an_error_below_the_noise_is_no_more_than_the_whole_misfit_gone():
    found = diagnosis()
    rows = (replace(found.ranking[0], drop_train=1.05, drop_validation=1.002), *found.ranking[1:])
    document = diagnosis_document(replace(found, ranking=rows), UNITS)

    assert document["ranking"][0]["error_drop_train"] == 1.0
    assert document["ranking"][0]["error_drop_validation"] == 1.0
    text = diagnosis_text(replace(found, ranking=rows), UNITS)
    assert re.search(r"chamber_leak@chamber_a +100\.0 % +100\.0 %", text)
    assert "removes 100% of the weighted misfit" in sentence(Verdict.FOUND, rows, None)
    nearly = (replace(rows[0], drop_train=0.997), *rows[1:])
    assert "removes 99.7% of the weighted misfit" in sentence(Verdict.FOUND, nearly, None)


def test_what_is_no_number_is_null_in_json():
    document = diagnosis_document(diagnosis(), UNITS)

    assert document["ranking"][1]["error_drop_validation"] is None
    json.dumps(document, allow_nan=False)


def test_a_tie_says_what_to_record_next():
    names = ("chamber_leak@chamber_a", "spool_leak")
    asked = NextRecording("hold and wait", names, 240.0)
    found = replace(diagnosis(Verdict.TIE, tied=names[1:]), next_recording=asked)

    following = diagnosis_document(found, UNITS)["next_recording"]

    assert (following["what"], following["expected_gain"]) == ("hold and wait", 240.0)
    assert following["separates"] == list(names)
    assert "next recording: hold and wait" in diagnosis_text(found, {})


def test_a_tie_says_what_the_others_would_explain_of_the_first():
    tied = diagnosis(Verdict.TIE, tied=("spool_leak",))
    first = replace(tied.ranking[0], imitated_by={"spool_leak": 0.924})
    found = replace(tied, ranking=(first, *tied.ranking[1:]))

    said = "if chamber_leak@chamber_a is the truth, spool_leak would explain 92 % of it"
    assert said in diagnosis_text(found, UNITS).splitlines()
    assert diagnosis_document(found, UNITS)["ranking"][0]["imitated_by"] == {"spool_leak": 0.924}


def test_nothing_missing_names_no_effect():
    document = diagnosis_document(diagnosis(Verdict.NOTHING_MISSING), UNITS)

    assert document["effect"] is None and document["at"] is None


def test_an_empirical_law_comes_with_its_range():
    names = [f"{kind.causes[0].name}@slide.{kind.causes[0].strength}" for kind in FORCES]
    terms = dict.fromkeys(names, Size(-240.0, 12.0))
    ranges = {"slide.velocity_m_s": (-0.5, 0.5), "chamber_a.pressure_pa": (3e5, 6e5)}
    law = Law(("slide.momentum",), terms, ranges, 0.8, 0.7, "-240 v|v|")

    document = diagnosis_document(diagnosis(Verdict.NOT_IN_CATALOGUE, law=law), UNITS)

    assert document["law"]["terms"] == {
        "law[v|v|]@slide.quadratic": {"value": -240.0, "std": 12.0, "unit": "N s^2/m^2"},
        "law[v^3]@slide.cubic": {"value": -240.0, "std": 12.0, "unit": "N s^3/m^3"},
        "law[v|x - mid|]@slide.placed_viscous": {"value": -240.0, "std": 12.0, "unit": "N s/m^2"},
        "law[(x - mid)^2]@slide.curved": {"value": -240.0, "std": 12.0, "unit": "N/m^2"},
    }
    assert document["law"]["ranges"] == {
        "slide.velocity": {"low": -0.5, "high": 0.5, "unit": "m/s"},
        "chamber_a.pressure": {"low": 3e5, "high": 6e5, "unit": "Pa"},
    }
    said = diagnosis_text(diagnosis(Verdict.NOT_IN_CATALOGUE, law=law), UNITS)
    assert "law (empirical, not a physical effect)" in said
    assert (
        "drop train 80.0 %, validation 70.0 %; "
        "seen for slide.velocity -0.5 m/s to 0.5 m/s, chamber_a.pressure 3 bar to 6 bar"
    ) in said


def test_where_nothing_is_named_the_errors_stand_as_they_are():
    nothing = replace(diagnosis(Verdict.NOTHING_MISSING), after={})
    rows = [line.split() for line in diagnosis_text(nothing, UNITS).splitlines()]

    assert ["set", "signal", "RMSE", "fit", "%", "noise", "chi2/n"] in rows
    assert ["train", "chamber_a.pressure", "0.08123", "bar", "71", "0.004", "bar", "412"] in rows
    assert "RMSE before" in diagnosis_text(diagnosis(), UNITS)
    assert "RMSE" not in diagnosis_text(nothing, {})


def test_a_diagnosis_reads_in_the_units_of_people():
    said = diagnosis_text(diagnosis(), UNITS)

    assert "0.051 mm^2 ± 0.002 mm^2" in said
    assert "0.08123 bar" in said and "0.009 bar" in said
    assert "valve closed 74 %" in said
    (head,) = [line for line in said.splitlines() if "drop train" in line]
    assert "index" in head and said.count(" 1.23e+03 ") == 2
    assert "compensable" in head and said.count(" 12 % ") == 2


def test_balances_stand_in_one_line_each_and_no_more_than_eight():
    found = diagnosis()
    many = {f"chamber_{k}.mass": float(k) for k in range(12)} | {"chamber_a.mass": 99.0}
    figure = diagnosis_figures(replace(found, where=replace(found.where, by_balance=many)))
    labels = [t.get_text() for t in figure["missing_term"].axes[1].get_yticklabels()]

    assert labels[:2] == ["chamber a mass", "chamber 11 mass"]
    assert len(labels) == 8


def test_columns_of_numbers_are_flush_right():
    said = columns(("name", "value"), [("a", "1.5"), ("long", "-20")])

    assert said.splitlines() == ["name  value", "a       1.5", "long    -20"]
    assert shown(math.nan, "x_pa") == "-"


def test_only_strong_correlations_are_named():
    matrix = np.array([[1.0, -0.95, 0.1], [-0.95, 1.0, 0.2], [0.1, 0.2, 1.0]])

    lines = correlation_lines(["slide.mass_kg", "valve.flow_area_m2", "x.y_n"], matrix)

    assert lines[1:] == ["valve.flow_area and slide.mass: -0.95"]


@pytest.fixture(scope="module")
def figures():
    """Every kind of figure that needs no simulation."""
    from linearize.standard import standard_modes

    found = diagnosis(tied=("spool_leak",))
    return {
        **diagnosis_figures(found),
        "budget": budget_figure([Stage("as it came", 9.0, 11.0), Stage("+ leak", 2.0, math.nan)]),
        "errors": before_after_figure(found.before, found.after, UNITS),
        "poles": pole_figure(standard_modes(PLANT)),
    }


def test_every_panel_has_named_axes_with_units(figures):
    for name, figure in figures.items():
        for axes in figure.axes:
            sharing = axes.get_shared_y_axes().get_siblings(axes)
            words = {axes.get_xlabel(), *(each.get_ylabel() for each in sharing)} - {""}

            assert words, name
            assert all(re.search(r"\(.+\)$", word) for word in words), f"{name}: {words}"
            assert len(words) == 2 or _named_ticks(axes), f"{name}: {words}"


def _named_ticks(axes):
    """True where an axis has names instead of numbers."""
    ticks = (*axes.get_xticklabels(), *axes.get_yticklabels())
    return any(re.search("[a-z]{3}", tick.get_text()) for tick in ticks)


def test_a_figure_is_saved_as_pdf_svg_csv_and_its_command(figures, tmp_path):
    for name, figure in figures.items():
        svg = save(figure, tmp_path / name, "workbench demo")

        ElementTree.parse(svg)
        assert (tmp_path / f"{name}.pdf").read_bytes().startswith(b"%PDF")
        assert (tmp_path / f"{name}.txt").read_text() == "workbench demo\n"
        rows = (tmp_path / f"{name}.csv").read_text().splitlines()
        assert rows[0] == "panel,curve,x,y" and len(rows) > 2


def test_the_table_beside_a_figure_holds_what_is_drawn(figures, tmp_path):
    save(figures["ranking"], tmp_path / "ranking", "x")

    rows = (tmp_path / "ranking.csv").read_text()

    assert ",training,= chamber_leak@chamber_a,93" in rows
    assert ",validation,= chamber_leak@chamber_a,91" in rows


def test_two_runs_give_the_same_bytes(tmp_path):
    def drawn(stem):
        with styled():
            figure = new_figure(3.5, 2.0)
            figure.subplots().plot([0, 1], [0, 1], label="line")
        save(figure, tmp_path / stem, "x")
        return [(tmp_path / f"{stem}.{e}").read_bytes() for e in ("pdf", "svg", "csv")]

    assert drawn("one") == drawn("two")
