"""What is wrong with a user's input: all of it at once, each with its place and what helps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import SequenceMatcher, get_close_matches
from pathlib import Path


@dataclass(frozen=True)
class Message:
    """One thing that is wrong, as a person reads it.

    what        what is
    expected    what was expected, where that is not plain
    nearest     the nearest known name, where a name is unknown
    name        the key, channel or parameter it is about
    file, line  where it stands; line 0 where there is none
    """

    what: str
    name: str = ""
    expected: str = ""
    nearest: str = ""
    file: str = ""
    line: int = 0

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        said = self.what + (f"; expected {self.expected}" if self.expected else "")
        hint = f"; did you mean '{self.nearest}'?" if self.nearest else ""
        return ": ".join(filter(None, (place, self.name, said + hint)))


class InputError(ValueError):
    """The input is wrong: the command line prints every message and exits with 2."""

    def __init__(self, *messages: Message | str) -> None:
        self.messages = tuple(m if isinstance(m, Message) else Message(m) for m in messages)
        super().__init__("\n".join(str(message) for message in self.messages))

    def __reduce__(self) -> tuple[type[InputError], tuple[Message, ...]]:
        return type(self), self.messages


class UnknownNameError(InputError, KeyError):
    """A name that does not exist; to a program a KeyError, as of any mapping."""

    __str__ = Exception.__str__  # that of KeyError shows the quotes of a string


def nearest(name: object, known: Iterable[str]) -> str:
    """The known name that looks most like this one; empty where none does."""
    found = get_close_matches(str(name), list(known), n=1)
    return found[0] if found else ""


def likest_first(name: str, known: Iterable[str]) -> list[str]:
    """The known names, those that look most like this one first."""
    return sorted(known, key=lambda each: -SequenceMatcher(None, name, each).ratio())


def listed(names: Iterable[object], most: int = 12) -> str:
    """Names in one line, the first ``most`` of them."""
    names = [str(name) for name in names]
    rest = len(names) - most
    return ", ".join(names[:most]) + (f" and {rest} more" if rest > 0 else "")


def unreadable(path: Path, error: OSError) -> InputError:
    """What is wrong with a file that cannot be opened, naming one beside it that looks like it."""
    if not isinstance(error, FileNotFoundError):
        return InputError(Message(f"cannot be read: {error.strerror}", file=str(path)))
    beside = [p.name for p in path.parent.glob("*")] if path.parent.is_dir() else []
    near = nearest(path.name, beside)
    return InputError(Message("there is no such file", nearest=near, file=str(path)))
