"""Table I of paper 003: shifts of all recordings by case, in text, JSON and files."""

import csv
from types import SimpleNamespace

import pytest
from commands import call
from gearbox_shifts import ALL_SHIFTS, run

from studies.documents import comparison_document
from studies.shift_cases import case_deviations, mean_deviations
from studies.text_of_comparison import cases_text
from workbench.comparison.compare import Comparison
from workbench.comparison.deviation import ShiftDeviation
from workbench.plants.gearbox import gearbox
from workbench.reading.writer import write_recording

PRESSURE, POSITION = "chamber_1.pressure_pa", "main_piston.position_m"
NONE = float("nan")


def shift(case, pressure, position):
    return ShiftDeviation(case, 0.1, 0.12, {PRESSURE: pressure, POSITION: position})


SHIFTS = (
    shift("L to N", 0.09, 0.03),
    shift("N to H", 0.04, NONE),
    shift("N to H", 0.06, 0.05),
    shift("L to H", 0.01, NONE),
)


def test_a_case_is_the_mean_of_its_shifts_and_those_of_the_paper_come_first():
    cases = case_deviations(SHIFTS)

    assert [(each.case, each.shifts) for each in cases] == [
        ("N to H", 2),
        ("L to N", 1),
        ("L to H", 1),
    ]
    assert cases[0].deviations == pytest.approx({PRESSURE: 0.05, POSITION: 0.05})


def test_the_mean_is_that_of_the_cases_as_the_paper_takes_it():
    found = mean_deviations(case_deviations(SHIFTS))

    assert found == pytest.approx({PRESSURE: 0.05, POSITION: 0.04})  # not 0.0525 of the shifts


def test_the_table_of_the_cases_ends_with_their_mean():
    rows = [line.split() for line in cases_text(SHIFTS).splitlines()]

    assert rows[1] == ["N", "to", "H", "2", "5.00", "%", "5.00", "%"]
    assert rows[3] == ["L", "to", "H", "1", "1.00", "%", "-"]
    assert rows[4] == ["mean", "of", "the", "cases", "4", "5.00", "%", "4.00", "%"]
    assert not cases_text(())


def test_the_document_holds_the_cases_of_all_recordings():
    first = shift("N to H", 0.04, NONE), shift("L to N", 0.11, NONE)
    parts = first, [shift("N to H", 0.06, NONE)]
    recordings = tuple(SimpleNamespace(shifts=each) for each in parts)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("studies.documents._compared", lambda each: {})
        document = comparison_document(Comparison("gearbox", recordings))

    case, _ = document["shift_cases"]
    assert (case["case"], case["shifts"]) == ("N to H", 2)
    assert case["deviation"]["chamber_1.pressure"] == pytest.approx(0.05)
    assert case["deviation"]["main_piston.position"] is None
    mean = document["shift_cases_mean"]  # 8 % of the cases, not 7 % of the shifts
    assert mean == {"chamber_1.pressure": pytest.approx(0.08), "main_piston.position": None}


def test_the_table_stands_beside_the_figures_as_csv_and_latex(tmp_path):
    """A shift to High and one back, from 50 ms before the first."""
    recording = run(gearbox().lean(), (((0, 0), 0.05), *ALL_SHIFTS[:4]), 1e-3)
    write_recording(recording, tmp_path / "shifts.csv")
    (tmp_path / "rig.toml").write_text('plant = "gearbox"\n')
    figures = tmp_path / "figures"

    answer = call("compare", tmp_path / "rig.toml", tmp_path / "shifts.csv", "--figures", figures)

    assert answer.exit_code == 0, answer.output
    assert "mean of the cases" in answer.stdout
    last = sorted((figures / "tables").glob("*.csv"))[-1]
    with last.open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0][:2] == ["mean deviation by case", "shifts"]
    assert [row[:2] for row in rows[1:]] == [
        ["N to H", "1"], ["H to N", "1"], ["mean of the cases", "2"],
    ]  # fmt: skip
    assert r"\toprule" in last.with_suffix(".tex").read_text()
