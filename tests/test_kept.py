"""What is kept of long work: rows that survive a kill, and only those of the code that runs."""

import pytest

from studies import controllers_study, versions
from studies.kept import Kept
from studies.study import Extent
from studies.yardsticks import LIMITS


def test_rows_survive_and_a_line_cut_short_is_left_out(tmp_path):
    path = tmp_path / "work" / "rows.jsonl"
    Kept(path).add("a", {"value": 1})
    with path.open("a", encoding="utf-8") as file:
        file.write('{"key": "b", "val')

    again = Kept(path)
    assert "a" in again
    assert "b" not in again
    again.add("c", {"value": 3})

    assert [r["value"] for r in Kept(path).rows.values()] == [1, 3]


def test_pieces_that_other_code_finished_are_done_again(tmp_path, monkeypatch):
    """The same code goes on where it ended; after a change nothing old passes for new."""
    asked = []

    def measured_here(draw, method, numbers):
        asked.append(draw)
        return dict.fromkeys(LIMITS, 1.0)

    monkeypatch.setattr(controllers_study, "_measured", measured_here)
    monkeypatch.setattr(controllers_study, "follower_runs", lambda kept, number, say: {})
    monkeypatch.setattr(controllers_study, "together", lambda drive, followers: drive)
    counts = []
    for code in ("a", "a", "b", "a"):
        monkeypatch.setattr(versions, "code_of_loops", lambda code=code: code * 64)
        controllers_study.run(tmp_path, Extent.QUICK, lambda message: None)
        counts.append(len(asked))

    assert counts == [counts[0], counts[0], 2 * counts[0], 2 * counts[0]]


@pytest.mark.parametrize(
    "file", ["controllers/judging.c", "workbench/lanes.h", "estimators/deeper/ekf.py"]
)
def test_what_is_compiled_decides_of_what_code_a_piece_is_too(tmp_path, monkeypatch, file):
    monkeypatch.setattr(versions, "ROOT", tmp_path)
    (tmp_path / file).parent.mkdir(parents=True)
    hashes = {"loops": [], "all": []}
    for text in ("a", "b", "a"):
        (tmp_path / file).write_text(text)
        hashes["loops"].append(versions.code_of_loops.__wrapped__())
        hashes["all"].append(versions.code.__wrapped__())

    for first, second, third in hashes.values():
        assert first == third != second


def test_a_truth_decides_what_code_a_piece_is_of(tmp_path, monkeypatch):
    truth = tmp_path / "studies" / "truth"
    truth.mkdir(parents=True)
    monkeypatch.setattr(versions, "ROOT", tmp_path)
    found = []
    for text in ("a", "b", "a"):
        (truth / "drive.py").write_text(text)
        found.append(versions.code_of_loops.__wrapped__())

    assert found[0] == found[2] != found[1]
