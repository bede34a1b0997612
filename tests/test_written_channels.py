"""Results go into the pipe or through the link that is named, and never take its place."""

import json
import os
import stat
import threading

import pytest
from commands import call

from studies.command_line.files import text_to_write, writable, write_json
from studies.demo import DATA
from workbench.errors import InputError
from workbench.whole_file import whole_file


@pytest.fixture
def pipe(tmp_path):
    """A named pipe and a list that gets what was read from it, once its reader has ended."""
    path, got = tmp_path / "pipe", []
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: got.append(path.read_text()), daemon=True)
    reader.start()
    return path, got, reader


def test_a_pipe_stays_and_gets_all_of_the_result(pipe):
    """It was replaced by a file, and its reader waited for ever."""
    path, got, reader = pipe

    writable(path)
    write_json(path, {"a": 1})
    reader.join(timeout=20)

    assert json.loads(got[0]) == {"a": 1}
    assert stat.S_ISFIFO(path.stat().st_mode)


def test_what_fails_half_way_leaves_a_pipe_without_a_byte(pipe):
    path, got, reader = pipe

    with pytest.raises(ZeroDivisionError), whole_file(path) as unfinished:
        unfinished.write_text("half")
        raise ZeroDivisionError
    assert not got
    path.write_text("end")
    reader.join(timeout=20)

    assert got == ["end"]


def test_a_pipe_in_a_folder_that_takes_no_files_is_written_all_the_same(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setattr("studies.command_line.files._no_folder", lambda *_: ["takes no files"])

    writable(tmp_path / "pipe")
    with pytest.raises(InputError, match="takes no files"):
        writable(tmp_path / "file")


@pytest.mark.parametrize("there", [True, False])
def test_a_link_stays_and_what_it_leads_to_is_written(tmp_path, there):
    target, link = tmp_path / "folder" / "real.json", tmp_path / "link.json"
    target.parent.mkdir()
    link.symlink_to(target)
    if there:
        target.write_text("old")

    writable(link)
    write_json(link, {"a": 1})

    assert link.is_symlink() and not target.is_symlink()
    assert json.loads(target.read_text()) == {"a": 1}
    assert sorted(each.name for each in tmp_path.rglob("*")) == ["folder", "link.json", "real.json"]


def test_a_link_into_a_folder_that_is_a_file_is_refused_before_any_work(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "link.json").symlink_to(tmp_path / "file" / "real.json")

    with pytest.raises(InputError, match="is a file"):
        writable(tmp_path / "link.json")


def test_a_ring_of_links_is_no_crash(tmp_path):
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")

    writable(tmp_path / "a")
    write_json(tmp_path / "a", {})

    assert (tmp_path / "a").read_text() == "{}\n"


@pytest.mark.parametrize("ending", [".mat", ".MAT", ".mf4", ".mdf"])
def test_a_simulation_is_not_written_under_the_ending_of_a_binary_file(tmp_path, ending):
    """It was CSV all the same, which no program reads from such a file."""
    output = tmp_path / f"out{ending}"
    answer = call("simulate", DATA / "rig.toml", DATA / "train.csv", "-o", output)

    assert answer.exit_code == 2
    said = f"out{ending}: recordings are written as CSV, not as {ending}; expected "
    assert said in answer.stderr.replace("\n", "") and "out.csv" in answer.stderr
    assert not list(tmp_path.iterdir())
    text_to_write(tmp_path / "out.csv")
