"""Columns of a text file: any separator, decimal comma or point, with or without names and units.

The numbers are read in one go by numpy; only a file it refuses is gone through cell by cell.
"""

from __future__ import annotations

import codecs
import csv
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from workbench.errors import InputError, Message
from workbench.reading.table import RecordingWarning, Table, open_bytes
from workbench.recording_format import RecordingFormat, TimeFormat

NUMBER = re.compile(r"[-+]?(?:[\d.]*\d[\d.]*(?:e[-+]?\d+)?|nan|inf)", re.IGNORECASE)
COMMA_NUMBER = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?|[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
DECIMAL_COMMA = re.compile(r"[-+]?0?,\d+|[-+]?\d+,(?:\d{1,2}|\d{4,})")  # never between thousands
QUOTED = re.compile(r'"([^"\n]*)"')
MISSING = {"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"}
LOOKED_AT = 50  # lines that decide on separator and decimal sign
BRACKETED = re.compile(r"^[\[(](.*)[\])]$")  # all of it, not the end of ``bar(g)``
BINARY = re.compile(r"[\x00-\x08\x0e-\x19\x1b-\x1f\x7f]")  # control characters of no text
BINARY_SHARE = 0.05  # of them in the first lines; a text has a spoiled cell at the most
SHOWN = 30  # characters of a cell in a message
NO_NUMBER = "not a number"
DATE = r"(\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4})"
CLOCK = r"(\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d*)?)?(?: ?[AP]M)?(?:Z| ?[-+]\d{2}:?\d{2})?)"
STAMP = re.compile(f"{DATE}?[T ]*{CLOCK}?", re.IGNORECASE)  # a time as loggers write it


@dataclass(frozen=True)
class _Body:
    """Rows of numbers: their text, where they stand, and what their columns are called."""

    file: str
    lines: list[str]
    numbers: np.ndarray  # of the lines in the file
    separator: str
    names: Sequence[str]  # empty where they stand above no columns
    time: TimeFormat

    def no_number(self, cell: str, row: int, column: int) -> Message:
        """What is wrong with a cell, and what would do."""
        name = self.names[column] if column < len(self.names) else ""
        kind, timed = _kind(cell), self.time.column in (name, column + 1)
        expected = "an empty cell where nothing was measured"
        if timed and kind != NO_NUMBER:
            between = 'the time between rows, time = { step = "1 ms" } in [recording]'
            expected = f"numbers in {self.time.unit}, or {between}"
        elif "," in cell and self.separator == ",":
            expected = 'decimal or thousands = "," in [recording]'
        elif "," in cell and COMMA_NUMBER.fullmatch(cell.strip()):
            expected = 'decimal = "," in [recording]'
        elif timed or kind != NO_NUMBER:
            expected = f"numbers{f' in {self.time.unit}' if timed else ''}"
        what = f"{cell[:SHOWN]!r} in column {column + 1} is {kind}"
        return Message(what, name, expected, file=self.file, line=int(self.numbers[row]))


def text_table(path: Path, reader: RecordingFormat) -> Table:
    """The columns of a text file, as ``reader`` says or as the file shows.

    Raises
    ------
    InputError
        If it holds no rows of numbers, numbers where names were expected, or other columns than
        names.
    """
    file, lines = str(path), decoded(open_bytes(path)).splitlines()
    if _binary(lines):
        raise InputError(Message("is no text", expected="a CSV, MAT or MDF file", file=file))
    rows = [
        (number, line)
        for number, line in enumerate(lines, start=1)
        if number > reader.skip and line.strip()
    ]
    comments = [row for row in rows if row[1].lstrip()[0] in "#%"]
    rows = [row for row in rows if row[1].lstrip()[0] not in "#%"] if comments else rows
    if not rows:
        raise InputError(Message(f"no rows after the first {reader.skip}", file=file))
    if reader.header and comments and _numeric(rows[0][1]):
        before = [row for row in comments if row[0] < rows[0][0]]
        rows = [(n, line.lstrip("#% ")) for n, line in before[-1:]] + rows
    head = rows[0] if reader.header else None
    data = rows[1:] if head else rows
    if head and _numeric(head[1]):
        what = "the first row holds numbers, not the names of columns"
        raise InputError(Message(what, expected="header = false", file=file, line=head[0]))
    units = None
    if head and data and not any(_numeric(word) for word in re.split(r"[;,\t| ]+", data[0][1])):
        units, data = data[0][1], data[1:]
    if not data:
        raise InputError(Message("there are names of columns but no rows of numbers", file=file))
    sample = [line for _, line in data[:LOOKED_AT]]
    separator = reader.separator or find_separator(sample)
    numbers = np.fromiter((n for n, _ in data), int, len(data))
    body = plain_numbers([line for _, line in data], separator, reader)
    names = _names(head[1], separator) if head else []
    cells = _cells(body[0], separator)
    if head and not _aligned(names, cells, separator) and _by_name(reader):
        what = f"{len(names)} names of columns stand above {len(cells)} columns"
        expected = "a name above each column, or numbers of columns in [recording]"
        raise InputError(Message(what, expected=expected, file=file, line=head[0]))
    n_columns = max(len(names), len(cells))
    told_names = names if _aligned(names, cells, separator) else []
    load = partial(_load, body=_Body(file, body, numbers, separator, told_names, reader.time))
    told = [BRACKETED.sub(r"\1", word) for word in _names(units, separator)] if units else []
    return Table(file, names, n_columns, load, lambda row: f"line {numbers[row]}", told)


def decoded(content: bytes) -> str:
    """Text in the encodings that loggers and spreadsheets write."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def find_separator(lines: Sequence[str]) -> str:
    """The character between the cells of these rows; a space stands for any white space."""
    for separator in "\t;|":
        if all(separator in line for line in lines):
            return separator
    words = [line.split() for line in lines]
    if all(len(w) > 1 and all(COMMA_NUMBER.fullmatch(c) for c in w) for w in words):
        return " "
    return "," if all("," in line for line in lines) else " "


def find_decimal(lines: Sequence[str], separator: str) -> str:
    """The decimal sign of these rows: the last of point and comma in a number that has both."""
    cells = [cell for line in lines for cell in _cells(line, separator)]
    if separator == ",":  # those in quotes
        commas = [cell for cell in cells if "," in cell]
        surely = any(DECIMAL_COMMA.fullmatch(c) for c in commas) and not any(
            "." in c for c in commas
        )
        return "," if surely else "."
    both = [cell for cell in cells if "," in cell and "." in cell]
    if both:
        return max(",.", key=both[0].rfind)
    return "," if any("," in cell for cell in cells) else "."


def plain_numbers(lines: list[str], separator: str, reader: RecordingFormat) -> list[str]:
    """The rows with a decimal point and without signs between thousands."""
    decimal = reader.decimal or find_decimal(lines[:LOOKED_AT], separator)
    thousands = reader.thousands
    if decimal == "." and thousands is None:
        return lines
    text = "\n".join(lines)
    if separator in (decimal, thousands):  # in quotes alone
        inside = replace(reader, decimal=decimal)
        return QUOTED.sub(lambda cell: plain_numbers([cell[1]], " ", inside)[0], text).split("\n")
    if thousands and thousands == decimal:  # the last one in a number is the decimal sign
        text = re.sub(rf"(?<=\d){re.escape(thousands)}(?=\d+{re.escape(thousands)})", "", text)
    elif thousands:
        text = re.sub(rf"(?<=\d){re.escape(thousands)}(?=\d)", "", text)
    if decimal != ".":
        text = text.replace(decimal, ".")
    return text.split("\n")


def _binary(lines: Sequence[str]) -> bool:
    """Whether these are no lines of a text: the first of a text have no control characters."""
    sample = "\n".join(lines[:LOOKED_AT])
    many = len(BINARY.findall(sample)) > BINARY_SHARE * len(sample)
    return many or BINARY.search("\n".join(lines[:3])) is not None


def _numeric(text: str) -> bool:
    """True when the first cell of a row is a number."""
    first = re.split(r"[;,\t| ]+", text.strip().strip('"'))[0]
    return bool(NUMBER.fullmatch(first.strip('"')))


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    if '"' in line:
        return [c.strip() for c in next(csv.reader([line], delimiter=separator))]
    return [cell.strip() for cell in line.split(separator)]


def _names(line: str, separator: str) -> list[str]:
    if separator == " " and re.search(r"\s{2,}|\t", line.strip()):
        return [name.strip(" \"'") for name in re.split(r"\s{2,}|\t", line.strip())]
    return [name.strip(" \"'") for name in _cells(line, separator)]


def _aligned(names: Sequence[str], cells: Sequence[str], separator: str) -> bool:
    """Whether each name stands above its column.

    A column of row numbers has no name in what some programs write, and a name with a space in it
    is two where spaces separate.  Rows may end early, and with a separator.
    """
    filled = max((k for k, cell in enumerate(cells, start=1) if cell), default=0)
    return filled <= len(names) and (separator != " " or len(names) <= len(cells))


def _by_name(reader: RecordingFormat) -> bool:
    """Whether any column is looked up by its name."""
    columns = [channel.column for channel in reader.channels.values()]
    timed = [] if reader.time.step_s is not None else [reader.time.column or "time"]
    return any(isinstance(column, str) for column in (*timed, *columns))


def _load(wanted: Sequence[int], body: _Body) -> np.ndarray:
    delimiter = None if body.separator == " " else body.separator
    try:
        found = np.loadtxt(body.lines, delimiter=delimiter, usecols=wanted, ndmin=2, comments=None)
    except ValueError:
        return _cell_by_cell(wanted, body)
    return found.T


def _cell_by_cell(wanted: Sequence[int], body: _Body) -> np.ndarray:
    """The columns with NaN where a cell is empty or says so; names the first that is no number."""
    file, count = body.file, len(body.lines)
    found = np.full((len(wanted), count), np.nan)
    for row, line in enumerate(body.lines):
        cells, place = _cells(line, body.separator), int(body.numbers[row])
        if len(cells) <= max(wanted):
            if row == count - 1:
                warnings.warn(f"{file}:{place}: unfinished row left out", RecordingWarning, 2)
                return found[:, :-1]
            what = f"this row has {len(cells)} columns"
            expected = f"at least {max(wanted) + 1}"
            raise InputError(Message(what, expected=expected, file=file, line=place))
        for i, column in enumerate(wanted):
            if cells[column].lower() in MISSING:
                continue
            try:
                found[i, row] = float(cells[column])
            except ValueError:
                raise InputError(body.no_number(cells[column], row, column)) from None
    return found


def _kind(cell: str) -> str:
    """What a cell is that is no number: a time as loggers write it, or anything."""
    stamp = STAMP.fullmatch(cell.strip("\"'"))
    date, clock = stamp.groups() if stamp else (None, None)
    if date and clock:
        return "a date and time"
    return "a date" if date else "a time of day" if clock else NO_NUMBER
