"""What one browser tab knows, as frozen values, and what each action makes of it.

An action gives a new session; it also stands in ``actions`` as a command line and as Python.  What
was computed before goes away once it no longer belongs to the rig or to the recordings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from studies.page.replay import Action, begin_lines, recordings_lines
from workbench.errors import InputError, Message
from workbench.recording import Recording
from workbench.recording_format import ChannelFormat
from workbench.rig import Rig, load_rig
from workbench.rig_writing import rig_text
from workbench.whole_file import whole_file

if TYPE_CHECKING:
    from studies.page.control_tasks import Linearised, Looped
    from studies.page.offers import Offers
    from studies.page.plausibility import Finding
    from studies.page.tasks import Accepted, Compared, Diagnosed, Opened

TIME = "time"  # among the columns of a recording


class Role(Enum):
    """What a recording is for."""

    TRAINING = "training"
    VALIDATION = "validation"
    ASIDE = "not used"


@dataclass(frozen=True)
class File:
    """An opened recording and its role."""

    opened: Opened
    role: Role


@dataclass(frozen=True)
class Step:
    """A rig with the name of its file; ``accepted`` is how it came about, None for the first."""

    rig: Rig = field(repr=False)
    rig_file: str
    accepted: Accepted | None = None


@dataclass(frozen=True)
class Session:
    """What one browser tab knows.

    ``steps`` begin with the rig as it was opened, one more for each accepted effect or fit;
    ``checked`` is what the gate found, None before; ``offered`` are the effects that the last
    diagnosis put in front; ``offers`` is what each method bears in each mode.
    """

    steps: tuple[Step, ...] = ()
    files: tuple[File, ...] = ()
    checked: tuple[Finding, ...] | None = None
    compared: Compared | None = None
    diagnosed: Diagnosed | None = None
    offered: tuple[str, ...] = ()
    linearised: Linearised | None = None
    linearised_before: Linearised | None = None
    offers: Offers | None = None
    looped: Looped | None = None
    reported: Path | None = None
    actions: tuple[Action, ...] = ()

    @property
    def now(self) -> Step:
        """The rig that actions are about.

        Raises
        ------
        InputError
            If there is none yet.
        """
        if not self.steps:
            raise InputError(Message("no rig is open", expected="a rig file in the first tab"))
        return self.steps[-1]

    def of(self, *roles: Role) -> tuple[Opened, ...]:
        """Files of these roles."""
        return tuple(each.opened for each in self.files if each.role in roles)

    @property
    def used(self) -> tuple[Opened, ...]:
        """Training first, then validation: as actions name them."""
        return (*self.of(Role.TRAINING), *self.of(Role.VALIDATION))


def recordings(opened: Sequence[Opened]) -> tuple[Recording, ...]:
    """Those of opened files, each with a name of its own, as the command line names them."""
    from studies.command_line.files import with_own_names

    return tuple(with_own_names([each.recording for each in opened]))


def paths(opened: Sequence[Opened]) -> list[str]:
    return [each.path for each in opened]


def with_rig(session: Session, path: str) -> Session:
    """Another rig from its file; recordings are to be read anew, as it says.

    Raises
    ------
    InputError
        With all that is wrong with the file.
    """
    step = Step(load_rig(Path(path)), path)
    done = Action("", begin_lines(path))
    return replace(Session((step,)), actions=(*session.actions, done))


def with_plant(session: Session, name: str) -> Session:
    """A new rig file in this folder, named after a plant of the catalogue; one there is opened."""
    target = Path(f"{name}.toml")
    if target.exists():
        return with_rig(session, str(target))
    content = f'name = "{name}"\nplant = "{name}"\n'
    with whole_file(target) as unfinished:
        unfinished.write_text(content, encoding="utf-8")
    found = with_rig(session, str(target))
    write = f"from pathlib import Path\nPath({str(target)!r}).write_text({content!r})\n"
    last = found.actions[-1]
    return replace(found, actions=(*found.actions[:-1], Action("", write + last.python)))


def with_opened(session: Session, opened: Sequence[Opened], role: Role | None = None) -> Session:
    """More recordings: the first of all is for training, others for validation."""
    files = [each for each in session.files if each.opened.path not in paths(opened)]
    for each in opened:
        usual = Role.VALIDATION if files else Role.TRAINING
        files.append(File(each, role or usual))
    return _with_files(session, tuple(files))


def with_role(session: Session, path: str, role: Role) -> Session:
    """A recording marked otherwise."""
    files = (replace(f, role=role) if f.opened.path == path else f for f in session.files)
    return _with_files(session, tuple(files))


def without_file(session: Session, path: str) -> Session:
    """A recording put away."""
    return _with_files(session, tuple(f for f in session.files if f.opened.path != path))


def _with_files(session: Session, files: tuple[File, ...]) -> Session:
    found = replace(session, files=files, checked=None, compared=None, diagnosed=None)
    if found.of(Role.TRAINING) != session.of(Role.TRAINING):  # their error, and where modes lie
        found = replace(found, linearised=None, linearised_before=None)
    train, validation = (paths(found.of(r)) for r in (Role.TRAINING, Role.VALIDATION))
    return did(found, Action("", recordings_lines(train, validation)))


def did(session: Session, action: Action) -> Session:
    """One action more; reading other files than before takes the place of the last reading."""
    last = session.actions[-1] if session.actions else None
    reading = "train = ["
    if last and last.python.startswith(reading) and action.python.startswith(reading):
        return replace(session, actions=(*session.actions[:-1], action))
    return replace(session, actions=(*session.actions, action))


def mapped(rig: Rig, chosen: Mapping[str, tuple[str, str]]) -> str:
    """The text of a rig file that reads these columns in these units, by full name or ``time``.

    Raises
    ------
    InputError
        With all that is wrong with it: units that do not fit, a command without a column.
    """
    known = rig.reader.channels
    channels = {}
    time = rig.reader.time
    for name, (column, unit) in chosen.items():
        before = known.get(name)
        number = column.isdigit() and not rig.reader.header
        noise = before.noise if before and before.unit == unit else None
        place = int(column) if number else column
        if name == TIME:
            time = replace(time, column=place, unit=unit)
            continue
        channels[name] = ChannelFormat(place, unit, noise, before.optional if before else False)
    found = replace(rig, reader=replace(rig.reader, time=time, channels=channels))
    content = rig_text(found, Path.cwd())
    load_rig(content)
    return content
