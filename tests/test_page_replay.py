"""What the page did, done again by its replay script and by the commands that it shows."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from page_files import drive_files

from studies.page import tasks
from studies.page.control_tasks import ModeChoice, close_loops, linearise
from studies.page.control_verbs import (
    design_action,
    modes_action,
    report_action,
    with_linearised,
    with_looped,
    with_reported,
)
from studies.page.mode_cuts import cuts_text
from studies.page.replay import script
from studies.page.reporting import Found, report_with_modes
from studies.page.session import Role, Session, recordings, with_opened, with_rig
from studies.page.verbs import (
    add_action,
    diagnose_action,
    save,
    with_accepted,
    with_compared,
    with_diagnosed,
)

pytestmark = pytest.mark.slow
INPUTS = ("rig.toml", "train.csv", "validation.csv")
SPEC = 'rise_time = "150 ms"\n\n[per-mode.modes]\n"charge a slide + middle" = "cascade"\n'
ROOT = str(Path(__file__).parent.parent)


def quiet(_):
    pass


def sets(session):
    return [recordings(session.of(role)) for role in (Role.TRAINING, Role.VALIDATION)]


def all_actions():
    """A session in which everything was done once, in the present folder."""
    begun = with_rig(Session(), "rig.toml")
    opened = tasks.open_recordings(begun.now.rig, ("train.csv", "validation.csv"), quiet)
    now = with_opened(begun, opened)
    now = with_compared(now, tasks.compare(now.now.rig, recordings(now.used), quiet))
    now = with_diagnosed(now, tasks.diagnose(now.now.rig, *sets(now), quiet))
    assert diagnose_action(now) in now.actions
    action = add_action(now, "piston_leak")
    found = tasks.add(now.now.rig, "piston_leak", *sets(now), quiet)
    now = with_accepted(now, found, action)
    now = save(now, "better.toml")
    now = with_compared(now, tasks.compare(now.now.rig, recordings(now.used), quiet))
    first = linearise(now.now.rig, sets(now)[0], ModeChoice(), quiet)
    choice = ModeChoice(cuts_file="rig_cuts.toml", cuts=cuts_text(dict(first.cuts)))
    action = modes_action(now, choice)
    now = with_linearised(now, linearise(now.now.rig, sets(now)[0], choice, quiet), action)
    chosen = ("per-mode", "rig_design.toml", ["ekf,kalman@stick"], ["step"], 1, SPEC)
    action = design_action(now, *chosen)
    now = with_looped(now, close_loops(now.now.rig, *chosen, quiet), action)
    action = report_action(now, "report")
    held = Found(
        comparison=now.compared.comparison,
        steps=tuple(step.accepted for step in now.steps if step.accepted),
        check=now.looped.check,
    )
    told = (Path("report"), action.command, now.now.rig, held, sets(now)[0], choice, quiet)
    return with_reported(now, report_with_modes(*told), action)


def ran(folder, command):
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([ROOT, *sys.path])}
    found = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=env)
    return found.returncode, found.stdout + found.stderr


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder of the page, and its session."""
    folder, before = drive_files(tmp_path_factory.mktemp("done"), seconds=2.0), Path.cwd()
    os.chdir(folder)
    try:
        return folder, all_actions()
    finally:
        os.chdir(before)


def copied(done, tmp_path):
    for name in INPUTS:
        shutil.copy(done / name, tmp_path)


def written(folder):
    """The files of a folder with their text, but for what names a time."""
    files = [p for p in folder.rglob("*") if p.suffix in (".toml", ".csv")]
    return {str(p.relative_to(folder)): p.read_text() for p in files if p.name != "hidden.toml"}


def test_the_replay_script_writes_what_the_page_wrote(done, tmp_path):
    folder, session = done
    copied(folder, tmp_path)
    (tmp_path / "replay.py").write_text(script(session.actions, "replay.py"))

    code, said = ran(tmp_path, [sys.executable, "replay.py"])

    assert code == 0, said
    wanted, found = written(folder), written(tmp_path)
    found.pop("rig_1.toml")  # each step's own file, which the page only names
    assert {*found} == {*wanted}
    assert {name for name in wanted if "modes" in name or "map" in name or "poles" in name}
    for name, content in wanted.items():
        assert found[name] == content, name


def test_the_commands_write_the_same_rig_design_and_cuts(done, tmp_path):
    folder, session = done
    copied(folder, tmp_path)
    shutil.copy(folder / "rig_cuts.toml", tmp_path)  # the sliders have no command of their own
    begin = f'workbench() {{ "{sys.executable}" -m studies.command_line "$@"; }}\n'
    commands = [each.command for each in session.actions if each.command]

    verbs = set(re.findall(r"^workbench (\w+)", "\n".join(commands), flags=re.M))
    assert {"compare", "diagnose", "add", "modes", "design", "check", "report"} <= verbs
    for command in commands:
        code, said = ran(tmp_path, ["bash", "-c", begin + command])
        assert code in (0, 1), (command, said)
    for name in ("better.toml", "rig_design.toml"):
        assert (tmp_path / name).read_text() == (folder / name).read_text()
