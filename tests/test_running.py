"""Running all studies: what fails is named, what breaks off stops no other, what is done stays."""

import json
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from commands import call

from studies.papers import soft_valve
from studies.running import Part, done_apart, main, run_all, run_study
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns
from studies.workers import Workers, chosen_workers, working_with
from workbench.errors import InputError, Message

DONE = []


def made(name, holds=True, breaks=False):
    """A study of one claim and one table, which says when it runs."""

    def run(folder, extent, say):
        DONE.append((name, extent, chosen_workers()))
        say("half of it")
        if breaks:
            raise ArithmeticError("no solution\nin CasADi")
        table = columns(("a", "b"), [("1", name)])
        return Outcome(table, (Claim(f"{name} holds", "4", holds),), {}, {"a": 1})

    return Study(name, f"does {name}?", "-", run, plants=("soft_joint",), seeds="1")


@pytest.fixture
def studies(monkeypatch):
    """One that holds, one that does not, one that breaks off; by name."""
    found = {s.name: s for s in (made("good"), made("bad", holds=False), made("lost", breaks=True))}
    monkeypatch.setattr("studies.running.STUDIES", found)
    monkeypatch.setattr("studies.running.done_apart", here)
    DONE.clear()
    return found


def here(part):
    """What a process of its own would do, in this one."""
    words = [part.name, str(part.folder), *["--full"] * (part.extent is Extent.FULL), "-q"]
    said = StringIO()
    with redirect_stdout(said):
        ended = main(words)
    return "" if ended in (0, 1) else said.getvalue().strip()


def all_of(studies, folder, extent=Extent.QUICK):
    shown, said = [], []
    failed = run_all([*studies.values()], folder, extent, 1, said.append, shown.append, quiet=True)
    return failed, "".join(shown), said


def test_what_fails_is_named_with_its_study_and_stops_no_other(studies, tmp_path):
    failed, shown, said = all_of(studies, tmp_path)

    assert [name for name, *_ in DONE] == ["good", "bad", "lost"]
    assert failed == ["bad: bad holds (4)", "lost broke off: ArithmeticError no solution"]
    assert "does good?" in shown and "does bad?" in shown and "does lost?" not in shown
    assert said[-1] == "lost broke off: 3 of 3 studies"


def test_a_second_start_runs_what_is_not_finished_and_tells_all(studies, tmp_path):
    first = all_of(studies, tmp_path)
    DONE.clear()
    second = all_of(studies, tmp_path)

    assert [name for name, *_ in DONE] == ["lost"]
    assert second[:2] == first[:2]
    assert second[2][0] == "2 of 3 studies are there"


def test_what_other_code_or_another_extent_has_finished_is_run_again(studies, tmp_path):
    good = {"good": studies["good"]}
    all_of(good, tmp_path)
    path = tmp_path / "good" / "study.json"
    document = json.loads(path.read_text())
    document["versions"]["code"] = "another"
    path.write_text(json.dumps(document))
    DONE.clear()
    all_of(good, tmp_path)
    all_of(good, tmp_path)
    all_of(good, tmp_path, Extent.FULL)

    assert [extent for _, extent, _ in DONE] == [Extent.QUICK, Extent.FULL]


def test_numbers_that_json_does_not_know_are_null(tmp_path):
    """As the median over draws of which most are lost: other programs refuse ``Infinity``."""
    found = {"medians": {"rise (ms)": np.float64("inf")}, "ends": (np.nan, 2.0), "plants": 3}
    study = Study("odd", "?", "-", lambda *_: Outcome("", (), {}, found))
    run_study(study, tmp_path, Extent.QUICK, "workbench study odd", print, print)

    told = json.loads((tmp_path / "study.json").read_text(), parse_constant=pytest.fail)
    assert told["numbers"] == {"medians": {"rise (ms)": None}, "ends": [None, 2.0], "plants": 3}


def test_a_study_among_several_keeps_to_its_own_process(studies, tmp_path):
    all_of({"good": studies["good"]}, tmp_path)

    assert DONE[-1][-1] == Workers(1)
    with working_with(Workers(3)):
        assert chosen_workers() == Workers(3)
    assert chosen_workers() == Workers()


def test_the_command_answers_1_and_names_the_claim(studies, tmp_path):
    answer = call("study", "all", "-o", tmp_path, "--workers", 1)
    alone = call("study", "good", "-o", tmp_path)

    assert answer.exit_code == 1
    assert "does not hold: bad: bad holds (4)" in answer.stderr
    assert "does not hold: lost broke off: ArithmeticError no solution" in answer.stderr
    assert alone.exit_code == 0
    page = (tmp_path / "report.html").read_text()
    assert "good: 1 of 1 claims hold" in page and "bad: 0 of 1 claims hold" in page
    assert "Parameters of soft_joint" in page and "bellows.volume" in page
    assert "numpy" in page and "Seeds: 1." in page


def test_a_folder_of_studies_alone_makes_the_page_too(studies, tmp_path):
    all_of(studies, tmp_path)
    answer = call("report", tmp_path)

    assert answer.exit_code == 0
    assert "does good?" in (tmp_path / "report.html").read_text()


def test_wrong_input_of_one_study_is_told_as_it_is(studies, tmp_path, monkeypatch):
    def refuses(*_):
        raise InputError(Message("is no rig", "rig.toml"))

    wrong = {"wrong": replace(studies["good"], name="wrong", run=refuses)}
    monkeypatch.setattr("studies.running.STUDIES", wrong)

    assert "is no rig" in all_of(wrong, tmp_path)[0][0]


def test_a_study_runs_in_a_process_of_its_own(tmp_path):
    folder = tmp_path / "soft-valve"
    assert done_apart(Part("soft-valve", folder, Extent.QUICK, quiet=True)) == ""
    assert json.loads((folder / "study.json").read_text())["claims"]
    (tmp_path / "file").write_text("")

    lost = done_apart(Part("soft-valve", tmp_path / "file" / "in it", Extent.QUICK, quiet=True))
    assert lost.startswith("NotADirectoryError")


def files(folder: Path):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_two_runs_of_a_study_write_the_same_files(tmp_path):
    for name in ("one", "two"):
        run_study(
            soft_valve.STUDY, tmp_path / name, Extent.QUICK, "workbench study soft-valve",
            lambda message: None, lambda text: None,
        )  # fmt: skip
    one, two = (files(tmp_path / name) for name in ("one", "two"))

    assert {path.suffix for path in one} == {".csv", ".json", ".pdf", ".svg", ".tex", ".txt"}
    assert one == two
