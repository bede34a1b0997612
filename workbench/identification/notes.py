"""Notes of a rig on what was identified: which values come from where, and which it kept."""

from __future__ import annotations

from collections.abc import Iterable

from workbench.units import public_name

FOUND, FROM, KEPT = " identified ", " from ", "keeps what the rig had"
ENDED = "stands at the end of its range"  # what rigs said before that took such values


def kept_note(name: str, why: str) -> str:
    """That a rig keeps its own value of a parameter."""
    return f"{public_name(name)} {KEPT}: {why}"


def begins_with(note: str, names: Iterable[str]) -> bool:
    """True of what a rig says of a value at the end of its range, or kept, of one of these."""
    told = (f"{public_name(name)} {said}" for name in names for said in (KEPT, ENDED))
    return note.startswith(tuple(told))


def with_notes(notes: Iterable[str], *new: str) -> tuple[str, ...]:
    """The notes and new ones, each in place of what it says again.

    A procedure that was done on another chamber before said something of that one, which holds.
    """
    found = list(notes)
    for note in filter(None, new):
        found = [*(each for each in found if not _said_again(each, note)), note]
    return tuple(found)


def _said_again(old: str, new: str) -> bool:
    """True where a new note tells of all that an old one does."""
    (before, names), (now, again) = _told(old), _told(new)
    return before == now and names <= again


def _told(note: str) -> tuple[str, set[str]]:
    """Who says something, and of which parameters."""
    who, found, rest = note.partition(FOUND)
    if not found:
        return " ".join(note.split()[:2]), set()
    return who, set(rest.partition(FROM)[0].split(", "))
