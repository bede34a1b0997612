"""The text of a file that a user writes: its TOML tree, the line of every key, what is wrong."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from workbench.errors import InputError, Message, listed, nearest, unreadable

_KEY = re.compile(r"""\s*("(?:[^"\\]|\\.)*"|'[^']*'|[A-Za-z0-9_-]+)\s*([.=\]])""")
_QUOTED = re.compile(r""""(?:[^"\\]|\\.)*"|'[^']*'""")


class RigText:
    """A file while it is read: complaints are collected here, and raised all at once.

    ``tree`` is what TOML says.  Every place in it is a tuple of keys, ``("values", "slide.mass")``.
    ``kind`` is what the messages call the file.
    """

    def __init__(self, text: str, file: str, kind: str = "a rig file") -> None:
        self.text, self.file, self.kind = text, file, kind
        self.messages: list[Message] = []
        self._lines = key_lines(text)
        try:
            self.tree: dict[str, Any] = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise InputError(self._unreadable(str(error))) from None

    def wrong(
        self,
        place: tuple[str, ...],
        what: str,
        *,
        item: str = "",
        expected: str = "",
        known: Iterable[str] = (),
    ) -> None:
        """Note what is wrong at a place, or with one ``item`` of the list there; once is enough."""
        name = item or (place[-1] if place else "")
        near = nearest(name, known)
        line = self.line(place, item)
        message = Message(what, name, expected, near, file=self.file, line=line)
        if message not in self.messages:
            self.messages.append(message)

    def unknown(self, place: tuple[str, ...], owner: str, known: Iterable[str], item: str = ""):
        """Note a name that ``owner`` does not have."""
        known = list(known)
        what = f"{owner} has no such name"
        self.wrong(place, what, item=item, expected=f"one of {listed(known)}", known=known)

    def keys_among(self, place: tuple[str, ...], table: Mapping[str, Any], known: Iterable[str]):
        """Note every key of the table at ``place`` that is not known."""
        known = list(known)
        owner = f"[{'.'.join(place)}]" if place else self.kind
        for key in table:
            if key not in known:
                self.unknown((*place, key), owner, known)

    def table(self, *place: str) -> dict[str, Any]:
        """The table at a place, empty where there is none."""
        return self.typed(place, dict, {}, "a table")

    def flat(self, key: str) -> dict[str, Any]:
        """A table of dotted names, ``slide.mass``, whether they are quoted there or not."""
        found: dict[str, Any] = {}
        for name, value in _leaves(self.table(key)):
            if name in found:
                self.wrong((key, name), "stands here a second time", expected="each name once")
            found[name] = value
        return found

    def typed(self, place: tuple[str, ...], kind: type, default: Any, expected: str) -> Any:
        """What stands at a place, of this type; ``default`` where nothing does, or another type."""
        found: Any = self.tree
        for key in place:
            if not isinstance(found, dict) or key not in found:
                return default
            found = found[key]
        if isinstance(found, kind) and not (kind is int and isinstance(found, bool)):
            return found
        self.wrong(place, f"{found!r} is of the wrong type", expected=expected)
        return default

    def names(self, place: tuple[str, ...]) -> list[str]:
        """A list of names at a place, empty where there is none; what is no text is noted."""
        found = self.typed(place, list, [], "a list of names")
        for item in found:
            if not isinstance(item, str):
                self.wrong(place, f"{item!r} is no name")
        return [item for item in found if isinstance(item, str)]

    def line(self, place: tuple[str, ...], item: str = "") -> int:
        """The line of a key, or of an item of the list there; of the table around it if need be."""
        while place and place not in self._lines:
            place = place[:-1]
        first = self._lines.get(place, 0)
        if item and first:
            for number, line in enumerate(self.text.splitlines()[first - 1 :], start=first):
                if re.search(rf"""["']{re.escape(item)}["']""", line):
                    return number
        return first

    def placed(
        self, error: InputError, place_of: Callable[[Message], tuple[str, ...]]
    ) -> InputError:
        """The error of what was built from this file, with the lines of what it is about.

        What has no place in the file, by ``place_of``, is left as it is.
        """
        lines = [self.line(place_of(each)) for each in error.messages]
        pairs = zip(error.messages, lines, strict=True)
        return type(error)(
            *(replace(each, file=self.file, line=line) if line else each for each, line in pairs)
        )

    def finish(self) -> None:
        """Raise all complaints, sorted by line.

        Raises
        ------
        InputError
            If there is any.
        """
        if self.messages:
            raise InputError(*sorted(self.messages, key=lambda message: message.line))

    def _unreadable(self, said: str) -> Message:
        found = re.search(r"\s*\(at line (\d+), column \d+\)", said)
        line = int(found[1]) if found else len(self.text.splitlines())
        what = said[: found.start()] if found else said
        name = ""
        if "overwrite" in what or "declare" in what or "twice" in what:
            name = _first_key(self.text.splitlines()[line - 1])
            what = "stands here a second time"
        return Message(what, name, expected="each name once" if name else "TOML", file=self.file,
                       line=line)  # fmt: skip


def read_text(path_or_text: Path | str) -> tuple[str, Path | None]:
    """The text of a rig, from a file or as it is, and the file's path.

    Raises
    ------
    InputError
        If there is no such file, naming those beside it that look like it.
    """
    if isinstance(path_or_text, str) and ("\n" in path_or_text or "=" in path_or_text):
        return path_or_text, None
    path = Path(path_or_text)
    try:
        return path.read_text(encoding="utf-8-sig"), path
    except OSError as error:
        raise unreadable(path, error) from None
    except UnicodeDecodeError as error:
        raise InputError(Message(f"cannot be read: {error}", file=str(path))) from None


def key_lines(text: str) -> dict[tuple[str, ...], int]:
    """The line of every table and key of a TOML text, from 1."""
    lines: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    depth = 0
    for number, line in enumerate(text.splitlines(), start=1):
        if not depth:
            head = re.match(r"\s*\[\[?", line)
            keys = _keys(line, head.end() if head else 0)
            table = keys if head else table
            place = keys if head else table + keys
            if keys:
                lines.setdefault(place, number)
                lines.setdefault((*table, ".".join(keys)), number)
            if head:
                continue
        bare = _QUOTED.sub("", line).partition("#")[0]
        depth += sum(bare.count(c) for c in "[{") - sum(bare.count(c) for c in "]}")
    return lines


def _keys(line: str, start: int) -> tuple[str, ...]:
    """The dotted key that begins at ``start``; none where the line holds no key."""
    keys: list[str] = []
    while found := _KEY.match(line, start):
        keys.append(_unquoted(found[1]))
        if found[2] != ".":
            return tuple(keys)
        start = found.end()
    return ()


def _leaves(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Every value of a table and the tables in it, by its dotted name."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{before}{key}.")
        else:
            yield before + key, value


def _first_key(line: str) -> str:
    return ".".join(_keys(line, 0)) or line.strip().strip("[]")


def _unquoted(key: str) -> str:
    return key[1:-1] if key[0] in "\"'" else key


def quoted(text: str) -> str:
    """A TOML string."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
