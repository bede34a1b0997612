"""Columns of numbers as a file holds them, before anybody knows what they mean."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from workbench.errors import InputError, Message, listed, nearest, unreadable


class RecordingWarning(UserWarning):
    """Something in a recording that is worth a look but does not forbid its use."""


@dataclass(frozen=True)
class Table:
    """The columns of a file.

    names   what the columns are called; empty where they are only numbered
    load    the columns with these numbers (from 0), shape (n_columns, n_rows)
    place   where a row (from 0) stands in the file, for people: ``line 17``
    units   what the file says the columns are in; empty where it says nothing
    """

    file: str
    names: Sequence[str]
    n_columns: int
    load: Callable[[Sequence[int]], np.ndarray]
    place: Callable[[int], str]
    units: Sequence[str] = ()

    def find(self, column: str | int, channel: str) -> int | Message:
        """The number of a column from 0, or what is wrong with asking for it."""
        if isinstance(column, int):
            if column <= self.n_columns:
                return column - 1
            return self._wrong(f"there is no column {column}", f"1 to {self.n_columns}", channel)
        if not self.names:
            what = f"the columns have no names, so there is no '{column}'"
            return self._wrong(what, f"a number from 1 to {self.n_columns}", channel)
        found = [i for i, name in enumerate(self.names) if name == column]
        if len(found) == 1:
            return found[0]
        what = f"{len(found)} columns are called '{column}'" if found else f"no column '{column}'"
        near = "" if found else nearest(column, self.names)
        return self._wrong(what, f"one of {listed(self.names)}", channel, near)

    def _wrong(self, what: str, expected: str, channel: str, near: str = "") -> Message:
        return Message(what, channel, expected, near, file=self.file)


def open_bytes(path: Path, most: int = -1) -> bytes:
    """What a file holds: all of it, or its first bytes, ``most`` of them.

    Raises
    ------
    InputError
        If there is no such file (naming one that looks like it), or nothing in it.
    """
    try:
        with path.open("rb") as opened:
            content = opened.read(most)
    except OSError as error:
        raise unreadable(path, error) from None
    if not content.strip():
        raise InputError(Message("the file is empty", file=str(path)))
    return content
