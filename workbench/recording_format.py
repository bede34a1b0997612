"""How the recordings of a rig are read: the ``[recording]`` section of a rig file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from workbench.errors import listed
from workbench.plant import Plant
from workbench.rig_text import RigText, quoted
from workbench.units import (
    UnitError,
    deviation,
    display_unit,
    public_name,
    quantity,
    scale,
    written,
)

SEPARATORS = {"tab": "\t", "space": " ", "whitespace": " "}
GAPS = ("refuse", "split")
REFERENCE = "reference "  # before the column of an output: what a position loop is to follow


@dataclass(frozen=True)
class TimeFormat:
    """The column of the time, by name or 1-based number; or the time between two rows."""

    column: str | int | None = "time"
    unit: str = "s"
    step_s: float | None = None


@dataclass(frozen=True)
class ChannelFormat:
    """The column of a channel, its unit there, and its noise in SI where that is known.

    A recording that lacks the column is refused, unless the channel is ``optional``.
    """

    column: str | int
    unit: str
    noise: float | None = None
    optional: bool = False


@dataclass(frozen=True)
class RecordingFormat:
    """How the recordings of a rig are read; what is None is found out from the file.

    ``channels`` are by full name.  ``skip`` rows are dropped before the names, or before the data
    without a header.  Where ``thousands`` and ``decimal`` are the same, the last one in a number
    is the decimal one: 1.234.000 is 1234.
    """

    time: TimeFormat = TimeFormat()
    channels: Mapping[str, ChannelFormat] = field(default_factory=dict)
    header: bool = True
    skip: int = 0
    separator: str | None = None
    decimal: str | None = None
    thousands: str | None = None
    resample_s: float | None = None
    gaps: str = "refuse"


def channel_names(plant: Plant) -> dict[str, str]:
    """Full name of every signal that a recording of this plant may carry, by public name."""
    signals = (*plant.commands, *plant.measured_inputs, *plant.optional_inputs)
    names = (*(s.name for s in signals), *plant.measured, *plant.optional_outputs)
    return {public_name(name): name for name in names}


def optional_channels(plant: Plant) -> set[str]:
    """Full names of the signals that a recording may do without."""
    return {*(s.name for s in plant.optional_inputs), *plant.optional_outputs}


def default_format(plant: Plant) -> RecordingFormat:
    """Columns named like the channels, in the units people read: as recordings are written.

    A recording may lack any output.
    """
    optional = optional_channels(plant) | derived_channels(plant).keys() | {*plant.measured}
    channels = {
        full: ChannelFormat(public, display_unit(full), optional=full in optional)
        for public, full in channel_names(plant).items()
    }
    return RecordingFormat(channels=channels)


def derived_channels(plant: Plant) -> dict[str, str]:
    """Measured velocities that follow from a measured position, with that position."""
    inputs = {signal.name for signal in plant.measured_inputs}
    pairs = ((n, n.replace(".velocity_m_s", ".position_m")) for n in inputs)
    return {speed: place for speed, place in pairs if speed != place and place in inputs}


def read_format(text: RigText, plant: Plant) -> RecordingFormat:
    """The ``[recording]`` section of a rig file; complaints go to ``text``."""
    usual = default_format(plant)
    if "recording" not in text.tree:
        return usual
    section = text.table("recording")
    known = "time channels header skip separator decimal thousands resample gaps"
    text.keys_among(("recording",), section, known.split())
    time = _time(text)
    return RecordingFormat(
        time=time,
        channels=_channels(text, plant, time) if "channels" in section else usual.channels,
        header=text.typed(("recording", "header"), bool, True, "true or false"),
        skip=_skip(text),
        separator=_character(text, "separator", SEPARATORS),
        decimal=_character(text, "decimal", {}, among=".,"),
        thousands=_character(text, "thousands", {}),
        resample_s=_seconds(text, ("recording", "resample")),
        gaps=_gaps(text),
    )


def format_lines(reader: RecordingFormat, plant: Plant) -> list[str]:
    """The ``[recording]`` section that reads back to the same format for this plant."""
    optional = optional_channels(plant)
    words = {value: key for key, value in SEPARATORS.items()}
    lines = ["[recording]"]
    if reader.time.step_s is not None:
        lines += [f"time = {{ step = {quoted(written(reader.time.step_s, 't_s'))} }}"]
    else:
        column, unit = _column_text(reader.time.column), quoted(reader.time.unit)
        lines += [f"time = {{ column = {column}, unit = {unit} }}"]
    lines += ["header = false"] if not reader.header else []
    lines += [f"skip = {reader.skip}"] if reader.skip else []
    for key in ("separator", "decimal", "thousands"):
        value = getattr(reader, key)
        lines += [f"{key} = {quoted(words.get(value, value))}"] if value is not None else []
    if reader.resample_s is not None:
        lines += [f"resample = {quoted(written(reader.resample_s, 't_s'))}"]
    lines += [f"gaps = {quoted(reader.gaps)}"] if reader.gaps != "refuse" else []
    lines += ["", "[recording.channels]"]
    for name, channel in reader.channels.items():
        entry = f"column = {_column_text(channel.column)}, unit = {quoted(channel.unit)}"
        if channel.noise is not None:
            entry += f", noise = {quoted(written(channel.noise, name))}"
        if channel.optional != (name in optional):
            entry += f", optional = {str(channel.optional).lower()}"
        lines.append(f"{quoted(public_name(name))} = {{ {entry} }}")
    return lines


def _column_text(column: str | int | None) -> str:
    return str(column) if isinstance(column, int) else quoted(str(column))


def _time(text: RigText) -> TimeFormat:
    place = ("recording", "time")
    entry = text.typed(place, dict, {}, '{ column = "time_s", unit = "s" }')
    text.keys_among(place, entry, ("column", "unit", "step"))
    if "step" in entry:
        for key in {"column", "unit"} & entry.keys():
            expected = "a column of times or the step between rows"
            text.wrong((*place, key), "does not go with step", expected=expected)
        return TimeFormat(None, "s", _seconds(text, (*place, "step")))
    unit = text.typed((*place, "unit"), str, "s", "a unit of time")
    try:
        scale(unit, "time_s")
    except UnitError as error:
        text.wrong((*place, "unit"), str(error))
    return TimeFormat(_column(text, place, entry, "time"), unit)


def _channels(text: RigText, plant: Plant, time: TimeFormat) -> dict[str, ChannelFormat]:
    names, found = channel_names(plant), {}
    optional = optional_channels(plant)
    for public, entry in text.table("recording", "channels").items():
        place = ("recording", "channels", public)
        if public not in names:
            text.unknown(place, plant.name, names)
            continue
        if not isinstance(entry, dict):
            example = f'{{ column = "name or number", unit = "{display_unit(names[public])}" }}'
            text.wrong(place, f"{entry!r} is of the wrong type", expected=example)
            continue
        text.keys_among(place, entry, ("column", "unit", "noise", "optional"))
        found[names[public]] = _channel(text, place, entry, names[public], optional)
    inputs = {s.name for s in (*plant.commands, *plant.measured_inputs)}
    missing = inputs - found.keys() - derived_channels(plant).keys()
    if missing and not text.messages:
        missing_names = listed(sorted(map(public_name, missing)))
        text.wrong(("recording", "channels"), f"{plant.name} also needs {missing_names}")
    _require_own_columns(text, found, time)
    return found


def _require_own_columns(
    text: RigText, channels: Mapping[str, ChannelFormat], time: TimeFormat
) -> None:
    """Note every column that two signals are read from: no sensor measures both."""
    first = {} if time.column is None else {time.column: "time"}
    for name, channel in channels.items():
        public = public_name(name)
        other = first.setdefault(channel.column, public)
        if other != public:
            what = f"column {_column_text(channel.column)} is that of {other} already"
            place = ("recording", "channels", public)
            text.wrong(place, what, expected="a column of its own")


def _channel(
    text: RigText, place: tuple[str, ...], entry: Mapping[str, Any], name: str, optional: set[str]
) -> ChannelFormat:
    unit = text.typed((*place, "unit"), str, "", "a unit")
    noise = None
    try:
        if "unit" not in entry and display_unit(name):
            raise UnitError(f"has no unit; expected for example '{display_unit(name)}'")
        scale(unit, name)
        noise = deviation(entry["noise"], name, 0.0) if "noise" in entry else None
    except UnitError as error:
        text.wrong(place, str(error))
    may_lack = text.typed((*place, "optional"), bool, name in optional, "true or false")
    return ChannelFormat(_column(text, place, entry, public_name(name)), unit, noise, may_lack)


def _column(
    text: RigText, place: tuple[str, ...], entry: Mapping[str, Any], default: str
) -> str | int:
    column = entry.get("column", default)
    by_number = isinstance(column, int) and not isinstance(column, bool) and column >= 1
    if not by_number and not (isinstance(column, str) and column):
        text.wrong(place, f"column {column!r} is neither a name nor a number from 1 on")
    return column


def _character(text: RigText, key: str, words: Mapping[str, str], among: str = "") -> str | None:
    place = ("recording", key)
    found = text.typed(place, str, None, "one character")
    if found is None:
        return None
    found = words.get(found, found)
    if len(found) != 1 or (among and found not in among):
        expected = f"one of {' '.join(among)}" if among else "one character"
        text.wrong(place, f"{found!r} is no {key}", expected=" or ".join([expected, *words]))
    return found


def _skip(text: RigText) -> int:
    place, rows = ("recording", "skip"), "a number of rows from 0 on"
    found = text.typed(place, int, 0, rows)
    if found < 0:
        text.wrong(place, f"{found} rows cannot be skipped", expected=rows)
    return found


def _seconds(text: RigText, place: tuple[str, ...]) -> float | None:
    typed = text.typed(place, str, None, 'a time such as "1 ms"')
    if typed is None:
        return None
    try:
        seconds = quantity(typed, "time_s")
    except UnitError as error:
        text.wrong(place, str(error))
        return None
    if not 0 < seconds < 1e6:
        text.wrong(place, f"'{typed}' is no time between samples")
    return seconds


def _gaps(text: RigText) -> str:
    found = text.typed(("recording", "gaps"), str, "refuse", "refuse or split")
    if found not in GAPS:
        text.wrong(("recording", "gaps"), f"'{found}' is unknown", expected=" or ".join(GAPS))
    return found
