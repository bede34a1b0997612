"""What was done on the page, as commands and as a Python script that does it again.

Each action stands as its command line, in a comment, above its Python lines.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from workbench.whole_file import whole_file

HEAD = '''"""What was done on the page, in order; run it in the folder where the page was.

    {run}
"""

import workbench
'''


@dataclass(frozen=True)
class Action:
    """One click: the command line that does the same, empty where there is none, and Python."""

    command: str
    python: str


NO_ACTION = Action("", "")  # of a job that only looks: nothing is told


def command(*words: str) -> str:
    """A command of the workbench as it is typed."""
    return shlex.join(["workbench", *words])


def script(actions: Sequence[Action], name: str = "replay.py") -> str:
    """The Python script of all actions."""
    parts = [HEAD.format(run=shlex.join(["python", name]))]
    for action in actions:
        said = [f"# {line}" for line in action.command.splitlines()]
        parts.append("\n".join([*said, action.python]) + "\n")
    return "\n".join(parts)


def write_script(actions: Sequence[Action], path: Path) -> None:
    """Write the script; the file appears only once it is complete."""
    with whole_file(path) as unfinished:
        unfinished.write_text(script(actions, path.name), encoding="utf-8")


def read_line(rig: str) -> str:
    """Python that loads a rig file."""
    return f"rig = workbench.load_rig({rig!r})"


def begin_lines(rig: str) -> str:
    """Python that begins with a rig file: no effect is added yet."""
    return f"{read_line(rig)}\nsteps = []"


def recordings_lines(train: Sequence[str], validation: Sequence[str]) -> str:
    """Python that reads the recordings of both sets."""
    return "\n".join(
        f"{name} = [workbench.read_recording(rig, path) for path in {[*paths]!r}]"
        for name, paths in (("train", train), ("validation", validation))
    )
