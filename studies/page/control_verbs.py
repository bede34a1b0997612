"""What the last tabs make of a session: modes, closed loops, the report."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from studies.page.replay import Action, command
from studies.page.session import Role, Session, did, paths

if TYPE_CHECKING:
    from studies.page.control_tasks import Linearised, Looped, ModeChoice
    from studies.page.offers import Offers


def modes_action(session: Session, choice: ModeChoice) -> Action:
    """The modes of the rig as it is now."""
    train, words, given = paths(session.of(Role.TRAINING)), [], ""
    lines = ["from pathlib import Path", "from studies.mode_choice import chosen_modes"]
    if choice.regimes:
        words, given = ["--regimes"], ", regimes=True"
    elif choice.placed is not None:
        words = ["--place", *train, "--number", str(choice.placed)]
        given = f", train, {choice.placed}"
    elif choice.cuts_file:
        words, given = ["--cuts", choice.cuts_file], f", cuts=Path({choice.cuts_file!r})"
        lines.append(f"Path({choice.cuts_file!r}).write_text({choice.cuts!r})")
    lines.append(f"hybrid = chosen_modes(rig{given})")
    return Action(command("modes", session.now.rig_file, *words), "\n".join(lines))


def with_linearised(session: Session, found: Linearised, action: Action) -> Session:
    """Modes that were made; those before them stay to be compared with."""
    done = replace(session, linearised=found, linearised_before=session.linearised)
    return did(done, action)


def with_offers(session: Session, found: Offers) -> Session:
    """What each method bears in each mode; it changes nothing, so it is no action."""
    return replace(session, offers=found)


def design_action(
    session: Session,
    method: str,
    target: str,
    estimators: Sequence[str],
    scenarios: Sequence[str],
    runs: int,
    spec: str,
) -> Action:
    """A design and its closed loops."""
    rig, asked = session.now.rig_file, [] if not spec.strip() else ["--spec", f"{target}.spec"]
    observers = ["--estimator", *estimators] if estimators else []
    several = ["--runs", str(runs)] if runs > 1 else []
    words = [
        command("design", rig, "--controller", method, *asked, "-o", target),
        command("check", rig, target, *observers, "--scenario", *scenarios, *several, *asked),
    ]
    if asked:
        words.insert(0, f"printf %s {shlex.quote(spec)} > {shlex.quote(asked[1])}")
    chosen = (method, target, [*estimators], [*scenarios], runs, spec)
    lines = (
        "from studies.page.control_tasks import close_loops",
        f"looped = close_loops(rig, {', '.join(map(repr, chosen))}, print)",
        "print(looped.check.text)",
    )
    return Action("\n".join(words), "\n".join(lines))


def with_looped(session: Session, found: Looped, action: Action) -> Session:
    """Closed loops that were run."""
    return did(replace(session, looped=found), action)


def report_action(session: Session, folder: str) -> Action:
    """The report of what the session holds; as commands, of the figures of what was compared."""
    given, shown = [], []
    if session.compared:
        given.append("comparison=comparison")
        recorded = paths(session.used)
        shown.append(command("compare", session.now.rig_file, *recorded, "--figures", folder))
    if session.diagnosed:
        given.append("diagnosis=diagnosis")
    if len(session.steps) > 1:
        given.append("steps=steps")
    if session.linearised:
        given.append("hybrid=hybrid")
    if session.looped:
        given.append("check=looped.check")
    words = "\n".join([*shown, command("report", folder)])
    lines = (
        "from pathlib import Path",
        "from studies.page.reporting import Found, report",
        f"report(Path({folder!r}), {words!r}, rig.name, Found({', '.join(given)}))",
    )
    return Action(words, "\n".join(lines))


def with_reported(session: Session, found: Path, action: Action) -> Session:
    """A report that was written."""
    return did(replace(session, reported=found), action)
