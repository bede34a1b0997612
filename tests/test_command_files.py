"""What a command may write and reads: refused before any work, or all of it kept."""

import os
import shutil

import numpy as np
import pytest
from commands import call

from studies.command_line.files import with_own_names, writable
from workbench.errors import InputError
from workbench.recording import Recording

RIG = 'name = "drive 7"\nplant = "servo_drive"\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A rig file, commands of 10 samples, and the recording that `simulate` made of more."""
    place = tmp_path_factory.mktemp("files")
    (place / "rig.toml").write_text(RIG)
    command = np.full(400, 4.95)
    command[50:200] = 6.0
    rows = ["time,valve.command", "s,V"]
    rows += [f"{1e-3 * k:.3f},{value}" for k, value in enumerate(command)]
    (place / "commands.csv").write_text("\n".join(rows) + "\n")
    (place / "short.csv").write_text("\n".join(rows[:12]) + "\n")
    answer = call("simulate", place / "rig.toml", place / "commands.csv", "-o", place / "run.csv")
    assert answer.exit_code == 0, answer.output
    return place


@pytest.mark.parametrize(
    ("command", "words", "option"),
    [
        ("compare", ["run.csv"], "--figures"),
        ("diagnose", ["run.csv"], "--figures"),
        ("check", ["lq.toml"], "--figures"),
        ("modes", [], "--export"),
        ("improve", ["run.csv", "--validate", "run.csv", "-o", "new.toml"], "--report"),
    ],
)
def test_a_file_as_the_folder_to_write_into_is_refused_before_any_work(
    folder, monkeypatch, command, words, option
):
    monkeypatch.chdir(folder)
    before = {*folder.iterdir()}
    json = ["--json", "new.json"] if command != "improve" else []

    answer = call(command, "rig.toml", *words, option, "rig.toml", *json)

    assert answer.exit_code == 2
    assert "rig.toml: is a file; expected a folder to write into" in answer.stderr
    assert {*folder.iterdir()} == before


def test_the_demo_does_not_begin_where_it_could_not_write(folder):
    answer = call("demo", "-o", folder / "rig.toml")

    assert answer.exit_code == 2
    assert "is a file" in answer.stderr


def test_everything_that_cannot_be_written_is_named_at_once(tmp_path):
    (tmp_path / "file").write_text("")

    with pytest.raises(InputError) as refused:
        writable(tmp_path, tmp_path / "file" / "a.json", folders=[tmp_path / "file" / "b" / "c"])

    said = str(refused.value).splitlines()
    assert "is a folder; expected the name of a file" in said[0]
    assert all(f"{tmp_path / 'file'} is a file" in line for line in said[1:]) and len(said) == 3


HELD_OUT = ["run.csv", "--validate", "run.csv"]
ONTO_WHAT_IT_READS = [
    ("compare", ["run.csv", "--json", "run.csv"], "run.csv"),
    ("compare", ["run.csv", "--json", "rig.toml"], "rig.toml"),
    ("simulate", ["run.csv", "-o", "run.csv"], "run.csv"),
    ("simulate", ["run.csv", "-o", "./rig.toml"], "rig.toml"),
    ("fit", ["run.csv", "-o", "run.csv"], "run.csv"),
    ("fit", ["run.csv", "--validate", "commands.csv", "-o", "commands.csv"], "commands.csv"),
    ("add", ["valve_lag", "--fit", "run.csv", "-o", "run.csv"], "run.csv"),
    ("improve", ["run.csv", "--validate", "run.csv", "-o", "run.csv"], "run.csv"),
    ("improve", [*HELD_OUT, "-o", "new.toml", "--json", "rig.toml"], "rig.toml"),
    ("diagnose", ["run.csv", "--json", "rig.toml"], "rig.toml"),
    ("estimate", ["run.csv", "--json", "run.csv"], "run.csv"),
    ("modes", ["--json", "rig.toml"], "rig.toml"),
    ("design", ["--controller", "lq", "-o", "rig.toml"], "rig.toml"),
    ("design", ["--controller", "lq", "--spec", "link.csv", "-o", "run.csv"], "run.csv"),
    ("check", ["commands.csv", "--json", "commands.csv"], "commands.csv"),
    ("check", ["commands.csv", "--keep", "rig.toml"], "rig.toml"),
]  # fmt: skip


@pytest.mark.parametrize(("command", "words", "named"), ONTO_WHAT_IT_READS)
def test_no_command_writes_over_what_it_reads(folder, monkeypatch, tmp_path, command, words, named):
    shutil.copytree(folder, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    os.symlink("run.csv", "link.csv")
    before = {path: path.read_bytes() for path in sorted((tmp_path / "here").iterdir())}

    answer = call(command, "rig.toml", *words)

    assert answer.exit_code == 2
    told = f"{named}: is a file that this command reads; expected the name of another file to write"
    assert answer.stderr == f"workbench: {told}\n"
    assert {path: path.read_bytes() for path in sorted((tmp_path / "here").iterdir())} == before


def test_identify_writes_over_no_recording(folder, monkeypatch):
    monkeypatch.chdir(folder)
    for words in (["-o", "run.csv"], ["--json", "rig.toml"]):
        answer = call("identify", "friction", "rig.toml", "run.csv", *words)

        assert answer.exit_code == 2
        assert f"{words[1]}: is a file that this command reads" in answer.stderr


ONE_ONTO_ANOTHER = [
    ("design", ["--controller", "lq", "-o", "new", "--json", "./new"], "new"),
    ("check", ["lq.toml", "--keep", "new", "--json", "new"], "new"),
    ("check", ["lq.toml", "--json", "new", "--figures", "new/figures"], "new/figures"),
    ("compare", ["run.csv", "--json", "new", "--figures", "new"], "new"),
    ("diagnose", ["run.csv", "--json", "new", "--figures", "./new"], "new"),
    ("modes", ["--json", "new", "--export", "new"], "new"),
    ("improve", [*HELD_OUT, "-o", "new", "--json", "new"], "new"),
    ("improve", [*HELD_OUT, "-o", "new", "--report", "new"], "new"),
    ("identify", ["rig.toml", "run.csv", "-o", "new", "--json", "new/a"], "new/a"),
]


@pytest.mark.parametrize(("command", "words", "named"), ONE_ONTO_ANOTHER)
def test_no_result_is_written_over_another(folder, monkeypatch, command, words, named):
    monkeypatch.chdir(folder)
    before = {*folder.iterdir()}

    answer = call(command, "friction" if command == "identify" else "rig.toml", *words)

    assert answer.exit_code == 2
    assert f"workbench: {named}: is a file that this command writes besides" in answer.stderr
    assert {*folder.iterdir()} == before


def test_a_result_may_stand_in_the_folder_of_the_others(tmp_path):
    writable(tmp_path / "figures" / "errors.json", folders=[tmp_path / "figures"])


def test_a_rig_may_be_bettered_in_its_own_file(folder):
    rig, recording = folder / "rig.toml", folder / "run.csv"

    writable(rig, reads=[recording, None])


@pytest.mark.skipif(not os.path.isdir("/proc"), reason="a folder that takes no files")
def test_a_folder_that_takes_no_file_is_refused_before_any_work(folder):
    answer = call("compare", folder / "rig.toml", folder / "run.csv", "--json", "/proc/errors.json")

    assert answer.exit_code == 2
    assert "/proc/errors.json: cannot be written: /proc" in answer.stderr
    assert "reading" not in answer.stderr


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_is_refused(tmp_path):
    tmp_path.chmod(0o500)

    with pytest.raises(InputError, match="is read-only"):
        writable(folders=[tmp_path / "new"])


def test_recordings_of_one_name_keep_figures_of_their_own(folder, tmp_path):
    for name in ("monday", "tuesday"):
        (tmp_path / name).mkdir()
        shutil.copy(folder / "run.csv", tmp_path / name)

    answer = call(
        "compare", folder / "rig.toml", tmp_path / "monday" / "run.csv",
        tmp_path / "tuesday" / "run.csv", "--figures", tmp_path / "figures",
    )  # fmt: skip

    assert answer.exit_code == 0, answer.output
    stems = {path.stem for path in (tmp_path / "figures").glob("comparison*")}
    assert stems == {"comparison_monday_run", "comparison_tuesday_run"}


def test_names_are_told_apart_by_folder_then_by_number():
    def named(name, source):
        return Recording(name, 1e-3, {"x_m": np.zeros(2)}, source=source)

    sources = ["a/run.csv", "b/run.csv", "b/run.csv", "b/other.csv"]
    found = with_own_names([named(s.rpartition("/")[2][:-4], s) for s in sources])

    assert [each.name for each in found] == ["a run", "b run 2", "b run 3", "other"]


def test_few_samples_are_enough_to_simulate_and_too_few_to_fit(folder, tmp_path):
    out, rig = tmp_path / "short.csv", folder / "rig.toml"

    assert call("simulate", rig, folder / "short.csv", "-o", out).exit_code == 0
    for command, words in (
        ("fit", [out, "-o", tmp_path / "new.toml"]),
        ("diagnose", [out]),
        ("add", ["valve_lag", "--fit", out, "-o", tmp_path / "new.toml"]),
        ("improve", [out, "--validate", out, "-o", tmp_path / "new.toml"]),
    ):
        answer = call(command, rig, *words)

        assert answer.exit_code == 2, command
        assert "10 samples are fewer than the 17 parameters of servo_drive" in answer.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["short.csv"]
