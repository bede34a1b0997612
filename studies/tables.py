"""Tables of a result: as a terminal shows them, as CSV, and as LaTeX for a paper.

Whoever makes a text by :func:`~studies.text.columns` inside :func:`noted_tables` finds the tables
of that text there, to be written beside it: a table has one source, whatever its form.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from io import StringIO
from itertools import count
from pathlib import Path

from workbench.whole_file import whole_file

GAP = "  "
NEVER = "never"  # stands for a number where something is not reached
_NUMBER = re.compile(r"[-+]*\.?\d(?!.* [a-z]{4})")  # and what follows it, but no names: "1 slide +"
_IN_LATEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_",
    "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
    "<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}",
}  # fmt: skip


@dataclass(frozen=True)
class Table:
    """Words by row and column, each row as long as the head."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @property
    def text(self) -> str:
        """Aligned columns: numbers to the right, words to the left."""
        if not self.rows:
            return ""
        widths = [max(map(len, column)) for column in zip(self.head, *self.rows, strict=True)]
        lines = (
            GAP.join(
                word.rjust(width) if flush else word.ljust(width)
                for word, width, flush in zip(row, widths, self._flush, strict=True)
            ).rstrip()
            for row in (self.head, *self.rows)
        )
        return "\n".join(lines)

    @property
    def csv(self) -> str:
        """Comma-separated, the head first."""
        file = StringIO()
        csv.writer(file, lineterminator="\n").writerows((self.head, *self.rows))
        return file.getvalue()

    @property
    def latex(self) -> str:
        """A ``tabular`` with the rules of the package booktabs."""
        kinds = "".join("r" if flush else "l" for flush in self._flush)
        lines = [" & ".join(map(_latex, row)) + r" \\" for row in (self.head, *self.rows)]
        begin = [r"% needs \usepackage{booktabs}", rf"\begin{{tabular}}{{{kinds}}}", r"\toprule"]
        end = [r"\bottomrule", r"\end{tabular}"]
        return "\n".join([*begin, lines[0], r"\midrule", *lines[1:], *end]) + "\n"

    @property
    def _flush(self) -> list[bool]:
        return [all(_numeric(row[k]) for row in self.rows) for k in range(len(self.head))]


_NOTED: ContextVar[list[Table]] = ContextVar("tables")


@contextmanager
def noted_tables() -> Iterator[list[Table]]:
    """The tables that :func:`note` was told of inside."""
    found: list[Table] = []
    before = _NOTED.set(found)
    try:
        yield found
    finally:
        _NOTED.reset(before)


def note(table: Table) -> None:
    """Tell the innermost :func:`noted_tables`, if there is one."""
    _NOTED.get([]).append(table)


def write_tables(text: str, noted: Iterable[Table], folder: Path) -> list[str]:
    """Tables that the text holds, in its order: ``table_1.csv`` and ``.tex``, and so on.

    Further ones that a former run left there are taken away: they are not of this text.
    """
    held = {table.text: table for table in noted if table.rows and table.text in text}
    names = []
    for number, shown in enumerate(sorted(held, key=text.index), start=1):
        names.append(f"table_{number}")
        for ending, content in (("csv", held[shown].csv), ("tex", held[shown].latex)):
            with whole_file(folder / f"{names[-1]}.{ending}") as unfinished:
                unfinished.write_text(content, encoding="utf-8")
    _remove_from(len(names) + 1, folder)
    return names


def _remove_from(number: int, folder: Path) -> None:
    """Take away the tables from a number on, as far as they follow one another in both forms."""
    for k in count(number):
        pair = [folder / f"table_{k}.{ending}" for ending in ("csv", "tex")]
        if not all(path.is_file() for path in pair):
            return
        for path in pair:
            path.unlink()


def _numeric(word: str) -> bool:
    return word in ("-", NEVER) or bool(_NUMBER.match(word))


def _latex(word: str) -> str:
    return "".join(_IN_LATEX.get(letter, letter) for letter in word)
