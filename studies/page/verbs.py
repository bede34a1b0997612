"""What each verb makes of a session: the action as it is told, and the session after it."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from studies.page.replay import Action, command, read_line
from studies.page.session import Role, Session, Step, did, paths
from workbench.candidate import TOGETHER
from workbench.errors import InputError, Message
from workbench.rig import load_rig
from workbench.rig_writing import write_rig

if TYPE_CHECKING:
    from studies.page.plausibility import Finding
    from studies.page.tasks import Accepted, Compared, Diagnosed

OFFERED = 6  # effects of a ranking that are offered to be added


def require_train(session: Session) -> None:
    """Refuse to go on without a recording to fit.

    Raises
    ------
    InputError
        If there is none.
    """
    if not session.of(Role.TRAINING):
        raise InputError(Message("no recording is for training", expected="one in the first tab"))


def require_used(session: Session) -> None:
    """Refuse to go on without a recording.

    Raises
    ------
    InputError
        If there is none, or each is put aside.
    """
    if not session.used:
        raise InputError(Message("no recording is open", expected="one in the first tab"))


def require_rig(session: Session) -> None:
    """Refuse to go on without a rig.

    Raises
    ------
    InputError
        If there is none.
    """
    _ = session.now


def named(path: str, what: str, example: str) -> str:
    """A path that was typed.

    Raises
    ------
    InputError
        If nothing was.
    """
    if not path:
        raise InputError(Message("has no name", what, f"a name such as {example}"))
    return path


def counted(typed: float | None, what: str) -> int:
    """A number that was typed.

    Raises
    ------
    InputError
        If it is not a whole one from 1 on.
    """
    if typed is None or typed < 1 or typed != int(typed):
        raise InputError(Message("is no number of them", what, "a whole number from 1 on"))
    return int(typed)


def with_checked(session: Session, found: tuple[Finding, ...]) -> Session:
    """What the gate found; it changes nothing, so it is no action."""
    return replace(session, checked=found)


def compare_action(session: Session) -> Action:
    """The comparison of all used recordings."""
    words = command("compare", session.now.rig_file, *paths(session.used))
    return Action(words, "comparison = workbench.compare(rig, train + validation)")


def with_compared(session: Session, found: Compared) -> Session:
    """A comparison that was made."""
    return did(replace(session, compared=found), compare_action(session))


def _sets(session: Session) -> list[str]:
    """Validation recordings as a command takes them."""
    held_out = paths(session.of(Role.VALIDATION))
    return ["--validate", *held_out] if held_out else []


def diagnose_action(session: Session) -> Action:
    """The diagnosis of the rig as it is now."""
    train = paths(session.of(Role.TRAINING))
    words = command("diagnose", session.now.rig_file, *train, *_sets(session))
    return Action(words, "diagnosis = workbench.diagnose(rig, train, validation)")


def with_diagnosed(session: Session, found: Diagnosed) -> Session:
    """A diagnosis that was made."""
    names = tuple(each.candidate.name for each in found.ranking[:OFFERED])
    done = replace(session, diagnosed=found, offered=names)
    return did(done, diagnose_action(session))


def with_saved_commands(session: Session, target: Path) -> Session:
    """The commands of the next recording written as a file to be played, and how beside it.

    Raises
    ------
    InputError
        If it cannot be written there.
    """
    from studies.command_line.files import writable
    from studies.export import save_commands

    writable(target)
    save_commands(session.now.rig, session.diagnosed.next_recording, target)
    train = paths(session.of(Role.TRAINING))
    words = command("diagnose", session.now.rig_file, *train, *_sets(session), "--figures",
                    str(target.parent))  # fmt: skip
    lines = (
        "from pathlib import Path",
        "from studies.export import save_commands",
        f"save_commands(rig, diagnosis.next_recording, Path({str(target)!r}))",
    )
    return did(session, Action(words, "\n".join(lines)))


def step_file(session: Session) -> str:
    """The name of the rig file that the next step gives in the commands."""
    first = Path(session.steps[0].rig_file)
    return str(first.with_name(f"{first.stem}_{len(session.steps)}.toml"))


def add_action(session: Session, name: str) -> Action:
    """An effect added to the rig as it is now."""
    train, out = paths(session.of(Role.TRAINING)), step_file(session)
    effect, _, place = name.partition("@")
    pair = TOGETHER in name
    what = [name] if pair or not place else [effect, "--at", place]
    words = command("add", session.now.rig_file, *what, "--fit", *train, *_sets(session), "-o", out)
    lines = (
        f"steps.append(workbench.add(rig, {name!r}, train, validation))",
        "rig = steps[-1].rig",
        f"workbench.write_rig(rig, {out!r})",
    )
    return Action(words, "\n".join(lines))


def fit_action(session: Session) -> Action:
    """The rig as it is now, fitted."""
    train, out = paths(session.of(Role.TRAINING)), step_file(session)
    words = command("fit", session.now.rig_file, *train, *_sets(session), "-o", out)
    lines = (
        "steps.append(workbench.fit(rig, train, validation))",
        "rig = steps[-1].rig",
        f"workbench.write_rig(rig, {out!r})",
    )
    return Action(words, "\n".join(lines))


def with_accepted(session: Session, found: Accepted, action: Action) -> Session:
    """The rig with an effect added, or fitted."""
    step = Step(found.rig, step_file(session), found)
    return did(_about(session, (*session.steps, step)), action)


def back_to(session: Session, number: int) -> Session:
    """The rig as it was after so many steps."""
    steps = session.steps[: number + 1]
    lines = (read_line(steps[-1].rig_file), f"del steps[{number}:]")
    return did(_about(session, steps), Action("", "\n".join(lines)))


def _about(session: Session, steps: tuple[Step, ...]) -> Session:
    """The session about another rig: what was found of the one before it goes away."""
    return replace(
        session,
        steps=steps,
        checked=None,
        compared=None,
        diagnosed=None,
        linearised=None,
        linearised_before=None,
        offers=None,
        looped=None,
    )


def save(session: Session, path: str) -> Session:
    """Write the rig file, and go on under its name.

    Raises
    ------
    InputError
        If it cannot be written there.
    """
    from studies.command_line.files import writable

    require_rig(session)
    target = Path(named(path.strip(), "rig file", "better.toml"))
    writable(target, reads=map(Path, paths([each.opened for each in session.files])))
    write_rig(session.now.rig, target)
    load_rig(target)  # what was written reads back
    before = session.now.rig_file
    words = "" if str(target) == before else shlex.join(["cp", before, str(target)])
    lines = f"workbench.write_rig(rig, {str(target)!r})"
    steps = (*session.steps[:-1], replace(session.now, rig_file=str(target)))
    return did(replace(session, steps=steps), Action(words, lines))
