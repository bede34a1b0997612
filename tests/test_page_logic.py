"""What the page does, without a browser: sessions, replay, thinning, jobs."""

import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from child_process import imports_alike
from hypothesis import given
from hypothesis import strategies as st
from page_files import drive_files

from studies.figures.decimation import peaks
from studies.page import tasks
from studies.page.balance_terms import terms_of
from studies.page.jobs import STOPPED, Job
from studies.page.missing_term import in_people
from studies.page.replay import script
from studies.page.session import (
    Role,
    Session,
    mapped,
    recordings,
    with_opened,
    with_plant,
    with_rig,
    with_role,
)
from studies.page.traces import inside
from studies.page.verbs import (
    add_action,
    back_to,
    compare_action,
    fit_action,
    require_train,
    save,
    with_accepted,
    with_compared,
)
from workbench.diagnosis.where import locate
from workbench.errors import InputError
from workbench.fitting.problem import pose
from workbench.rig import load_rig
from workbench.rig_writing import rig_text


def quiet(_):
    pass


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return drive_files(tmp_path_factory.mktemp("page"))


@pytest.fixture
def session(folder, monkeypatch):
    """A rig and two recordings, as the first tab opens them."""
    monkeypatch.chdir(folder)
    begun = with_rig(Session(), "rig.toml")
    found = tasks.open_recordings(begun.now.rig, ("train.csv", "validation.csv"), quiet)
    return with_opened(begun, found)


def test_the_first_recording_is_for_training_and_others_for_validation(session):
    roles = [each.role for each in session.files]

    assert roles == [Role.TRAINING, Role.VALIDATION]


def test_an_action_leaves_the_session_before_it_as_it_was(session):
    before = session.files
    other = with_role(session, "train.csv", Role.ASIDE)

    assert session.files is before and session.of(Role.TRAINING)
    assert not other.of(Role.TRAINING)
    with pytest.raises(InputError, match="no recording is for training"):
        require_train(other)


def test_without_a_rig_an_action_says_what_is_missing():
    with pytest.raises(InputError, match="no rig is open"):
        _ = Session().now


def test_a_wrong_rig_file_gives_the_message_of_the_command_line(folder):
    (folder / "wrong.toml").write_text('plant = "servo_driv"\n')

    with pytest.raises(InputError, match="did you mean 'servo_drive'"):
        with_rig(Session(), str(folder / "wrong.toml"))


def test_commands_are_those_of_the_command_line(session):
    assert compare_action(session).command == "workbench compare rig.toml train.csv validation.csv"
    add = add_action(session, "chamber_leak@chamber_a").command
    assert add == (
        "workbench add rig.toml chamber_leak --at chamber_a --fit train.csv "
        "--validate validation.csv -o rig_1.toml"
    )
    assert fit_action(session).command.startswith("workbench fit rig.toml train.csv --validate")


def test_a_comparison_is_gone_once_the_recordings_are_others(session):
    compared = with_compared(session, object())

    assert compared.compared is not None
    assert with_role(compared, "validation.csv", Role.TRAINING).compared is None


def test_modes_are_gone_once_their_error_is_not_of_the_training_recordings(session):
    linearised = replace(session, linearised=object())

    assert with_role(linearised, "validation.csv", Role.ASIDE).linearised is not None
    assert with_role(linearised, "validation.csv", Role.TRAINING).linearised is None


@pytest.mark.slow
def test_the_replay_script_gives_the_rig_that_was_saved(session, folder):
    """Compare, fit, go back, fit again, save: the script writes the same rig file."""
    fitted = tasks.fit(
        session.now.rig, recordings(session.of(Role.TRAINING)), recordings(()), quiet
    )
    alone = with_role(session, "validation.csv", Role.ASIDE)
    done = with_accepted(alone, fitted, fit_action(alone))
    assert done.now.rig_file == "rig_1.toml"
    again = with_accepted(back_to(done, 0), fitted, fit_action(alone))
    saved = save(again, "better.toml")
    (folder / "replay.py").write_text(script(saved.actions, "replay.py"))
    kept = (folder / "better.toml").read_text()
    (folder / "better.toml").unlink()

    ran = subprocess.run(
        [sys.executable, "replay.py"], cwd=folder, capture_output=True, text=True,
        env=imports_alike(),
    )  # fmt: skip

    assert ran.returncode == 0, ran.stderr
    assert (folder / "better.toml").read_text() == kept
    assert "# workbench fit rig.toml train.csv -o rig_1.toml" in script(saved.actions)


def test_a_rig_is_not_saved_over_a_recording(session):
    path = session.files[0].opened.path
    before = Path(path).read_bytes()

    with pytest.raises(InputError, match="is a file that this command reads"):
        save(session, path)
    assert Path(path).read_bytes() == before


def test_a_saved_rig_reads_back_and_the_session_goes_on_under_its_name(session, folder):
    saved = save(session, "kept.toml")

    assert saved.now.rig_file == "kept.toml"
    assert rig_text(load_rig(folder / "kept.toml")) == rig_text(session.now.rig)
    assert saved.actions[-1].command == "cp rig.toml kept.toml"
    with pytest.raises(InputError, match="has no name"):
        save(session, "  ")


def test_columns_mapped_to_signals_are_a_rig_file_that_reads_them(session, folder):
    rig = session.now.rig
    known = {n: (str(c.column), c.unit) for n, c in rig.reader.channels.items()}
    known = {n: known[n] for n in ("valve.command_v", "slide.position_m")}

    (folder / "mapped.toml").write_text(mapped(rig, known))
    assert set(load_rig(folder / "mapped.toml").reader.channels) == set(known)
    timed = load_rig(mapped(rig, known | {"time": ("t_ms", "ms")}))
    assert (timed.reader.time.column, timed.reader.time.unit) == ("t_ms", "ms")
    with pytest.raises(InputError, match="does not fit"):
        mapped(rig, known | {"slide.position_m": ("slide.position", "bar")})


def test_a_plant_of_the_catalogue_begins_a_rig_file_and_never_takes_the_place_of_one(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    begun = with_plant(Session(), "servo_drive")
    text = (tmp_path / "servo_drive.toml").read_text()
    (tmp_path / "servo_drive.toml").write_text(text.replace('name = "servo_drive"', 'name = "x"'))

    again = with_plant(Session(), "servo_drive")

    assert begun.now.rig.plant.name == "servo_drive" and "write_text" in begun.actions[-1].python
    assert again.now.rig.name == "x" and "write_text" not in again.actions[-1].python


def test_findings_name_what_is_wrong_with_a_recording(session, folder):
    lines = (folder / "train.csv").read_text().splitlines()
    spoiled = lines[:300] + [x if k % 40 else "" for k, x in enumerate(lines[300:])]
    (folder / "holes.csv").write_text("\n".join(filter(None, spoiled)) + "\n")

    (good,) = tasks.open_recordings(session.now.rig, ("train.csv",), quiet)
    (bad,) = tasks.open_recordings(session.now.rig, ("holes.csv",), quiet)

    marks = {each.what: each.mark.value for each in good.findings}
    assert marks["jitter"] == marks["gaps"] == marks["clipping"] == "good"
    assert {e.what: e.mark.value for e in bad.findings}["jitter"] == "look"


@given(
    st.integers(1, 400),
    st.integers(20, 200),
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 0.05]),
)
def test_every_peak_is_kept_and_there_are_no_more_points_than_asked(n, most, seed, holes):
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((3, n))
    rows[rng.random(rows.shape) < holes] = np.nan

    kept = peaks(rows, 0, n, most)

    assert len(kept) <= max(most + 2, 6 + 2) and (np.diff(kept) > 0).all()
    assert {0, n - 1} <= {*kept.tolist()}
    for row in rows:
        if np.isfinite(row).any():
            assert np.nanmax(row[kept]) == np.nanmax(row)
            assert np.nanmin(row[kept]) == np.nanmin(row)


def test_a_box_chooses_the_samples_inside_of_it():
    rows = {"time": np.arange(5.0), "d": np.array([3.0, 1, 2, 5, 4]), "e": np.arange(5.0) - 2}

    time = inside(rows, "time", None, {"x0": 3.5, "x1": 0.5, "y0": 0, "y1": 0})
    cloud = inside(rows, "d", "e", {"x0": 1.5, "x1": 4.5, "y0": -1, "y1": 3})

    assert np.flatnonzero(time).tolist() == [1, 2, 3]
    assert np.flatnonzero(cloud).tolist() == [2, 4]


def test_the_term_of_every_balance_is_found_as_the_diagnosis_finds_the_worst(session):
    """Asked for anew, the worst one comes out as :func:`locate` has it."""
    rig, train = session.now.rig, recordings(session.of(Role.TRAINING))
    problem = pose(rig, train)
    worst = locate(problem, train)

    found = terms_of(rig, problem.base, replace(worst, balance="another"))

    again = found[worst.balance]
    assert again.term == pytest.approx(worst.term, rel=1e-6)
    assert again.term_deviation == pytest.approx(worst.term_deviation, rel=1e-6)
    follows = {each.variable: each.explains for each in worst.against}
    found_too = {each.variable: each.explains for each in again.against}
    assert found_too == pytest.approx(
        follows, abs=0.01
    )  # a sample on the edge of a bin is in either
    assert {*found} == {"another", *worst.by_balance}
    units = {name: in_people(each.term_name)[1] for name, each in found.items()}
    assert units["slide.momentum"] == "N" and units["chamber_a.mass"] == "l/min ANR"


def answered(job, limit_s=60.0):
    begun = time.monotonic()
    while not job.look().ended and time.monotonic() - begun < limit_s:
        time.sleep(0.02)
    return job.told


def test_a_job_tells_its_progress_and_its_result_or_what_is_wrong(session):
    told = answered(Job(tasks.open_recordings, session.now.rig, ("train.csv",)))
    wrong = answered(Job(tasks.open_recordings, session.now.rig, ("nowhere.csv",)))

    assert told.progress == ("reading train.csv",)
    assert len(told.result[0].recording) == 800
    assert wrong.result is None and "nowhere.csv: there is no such file" in wrong.refused


def test_a_cancelled_job_ends_with_all_that_it_started(session):
    train = recordings(session.of(Role.TRAINING))
    job = Job(tasks.diagnose, session.now.rig, train, ())
    while not job.look().progress:
        time.sleep(0.02)

    job.cancel()

    assert job.told.refused == STOPPED
    assert not job._process.is_alive()
