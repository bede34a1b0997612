"""The report of an improvement: its page, and the next recording that its end asks for."""

# ruff: noqa: F811  (fixtures of other tests)

import json
from dataclasses import replace

import pytest
from test_improvement import UNITS, improved, rig, sets  # noqa: F401
from test_next_recording import asked, demo_rig, rivals  # noqa: F401

from studies.export import save_commands
from studies.improvement_text import improvement_document
from studies.report.improvement import _next_recording, report_improvement


def test_the_report_of_an_improvement_has_each_diagnosis_and_addition(improved, tmp_path):
    page = report_improvement(improved, tmp_path, "a command").read_text()

    for number, diagnosis in enumerate(improved.diagnoses, start=1):
        assert f"Diagnosis {number}" in page and diagnosis.sentence in page
    for step in improved.steps:
        assert step.candidate.name in page
    assert (tmp_path / "figures" / "error_by_effect.svg").is_file()
    assert not (tmp_path / "figures" / "next_recording.csv").exists()  # a bench has no commands


@pytest.mark.filterwarnings("ignore:.*did you mean 'reference")
def test_what_the_last_diagnosis_leaves_open_comes_with_commands(
    improved,
    demo_rig,
    asked,
    tmp_path,
):
    open_end = replace(improved.diagnoses[-1], next_recording=asked)
    found = replace(improved, rig=demo_rig, diagnoses=(*improved.diagnoses, open_end))

    (section,) = _next_recording(found, tmp_path, "a command")

    assert asked.what in section.table and section.figures == ("next_recording",)
    assert (tmp_path / "figures" / "next_recording.csv").read_text().startswith("time_s,command_V")
    assert (tmp_path / "figures" / "next_recording.svg").is_file()
    assert section.text == ("figures/next_recording.csv holds the reference of the loop below",)

    alone = replace(open_end, next_recording=replace(asked, conduct=None))
    (section,) = _next_recording(replace(found, diagnoses=(alone,)), tmp_path, "a command")
    assert section.text == ("figures/next_recording.csv holds the commands, ready to play",)


def test_commands_come_with_how_to_play_them_under_their_own_name(demo_rig, asked, tmp_path):
    save_commands(demo_rig, asked, tmp_path / "tonight.csv")

    assert (tmp_path / "tonight.csv").read_text().startswith("time_s,command_V")
    assert "speed of slide.position" in (tmp_path / "tonight_how.txt").read_text()


def test_the_document_of_an_improvement_holds_its_last_diagnosis(improved):
    told = json.loads(json.dumps(improvement_document(improved, UNITS), allow_nan=False))

    last = told["last_diagnosis"]
    assert last["schema"] == "workbench.diagnosis/1"
    assert last["verdict"] == improved.diagnoses[-1].verdict.value
    assert last["sentence"] == told["diagnoses"][-1]
    assert last["contradicted"] is False
