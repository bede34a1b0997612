"""A recording from a file, read as its rig says."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from workbench.differentiator import WINDOW, derivative
from workbench.errors import InputError, Message, listed
from workbench.plant import Plant
from workbench.reading.formats import table_of
from workbench.reading.grid import Grid, missing_stretch, uniform_grid
from workbench.reading.outliers import impossible, warn_of_outliers, without_infinite
from workbench.reading.plausible import warn_of_commands, warn_of_sensors
from workbench.reading.table import RecordingWarning, Table
from workbench.reading.time_unit import check_time_unit
from workbench.recording import Recording
from workbench.recording_format import REFERENCE, default_format, derived_channels
from workbench.rig import Rig
from workbench.spelled_units import GAUGE, is_gauge, spelled
from workbench.units import UnitError, public_name, scale

NO_UNIT = {"", "-", "--", "1"}  # what a row of units says where there is none


def read_recording(rig: Rig, path: Path | str) -> Recording:
    """The channels of a file in SI units, by full name, on one uniform time grid.

    Velocities that the plant wants as measured inputs, and the file lacks, are derived from the
    position.  Doubtful sensors give a :class:`RecordingWarning`.  A file as the workbench writes it
    (:mod:`workbench.reading.writer`) is read by its own names, whatever those of the rig's files.

    Raises
    ------
    InputError
        With everything that is wrong with the file, each with its place.
    """
    path = Path(path)
    table = table_of(path, rig.reader)
    rig, table = _as_written_here(rig, table, path)
    columns = _columns(rig, table)
    _require_units(rig, table, columns)
    numbers = sorted(set(columns.values()))
    raw = dict(zip(numbers, table.load(numbers), strict=True))
    time_s = _time(rig, table, raw, columns)
    values = {name: raw[number] for name, number in columns.items() if name != "time"}
    channels = _in_si(rig, table, values)
    derived = {k: v for k, v in derived_channels(rig.plant).items() if k not in channels}
    if "time" in columns:  # before a grid of far too many points
        check_time_unit(raw[columns["time"]], rig.reader.time.unit, rig.plant, table.file)
    grid = uniform_grid(
        time_s,
        table.place,
        table.file,
        gaps=rig.reader.gaps,
        resample_s=rig.reader.resample_s,
        least=WINDOW if derived else 2,
    )
    outputs = set(rig.plant.measured + rig.plant.optional_outputs)
    channels = {name: grid.on(each, filled=name not in outputs) for name, each in channels.items()}
    for velocity, position in derived.items():
        channels[velocity] = derivative(channels[position], grid.sample_time_s, grid.starts)
    warn_of_sensors(channels, outputs, table.file)
    warn_of_commands(channels, rig.plant, table.file)
    unmapped = tuple(name for k, name in enumerate(table.names) if k not in numbers)
    return _recording(rig, path, channels, grid, unmapped)


def _as_written_here(rig: Rig, table: Table, path: Path) -> tuple[Rig, Table]:
    """The rig reading the workbench's own names, where the file has these and none of the rig's."""
    reader, own = rig.reader, default_format(rig.plant)
    columns = {channel.column for channel in reader.channels.values()}
    if {*table.names} & columns or any(isinstance(column, int) for column in columns):
        return rig, table
    try:
        written = table_of(path, own)
    except InputError:
        return rig, table
    needed = {public_name(signal.name) for signal in rig.plant.commands}
    if not needed or not {"time", *needed} <= {*written.names}:
        return rig, table
    noise = {name: channel.noise for name, channel in reader.channels.items()}
    channels = {name: replace(c, noise=noise.get(name)) for name, c in own.channels.items()}
    own = replace(own, channels=channels, resample_s=reader.resample_s, gaps=reader.gaps)
    return replace(rig, reader=own), written


def _recording(
    rig: Rig, path: Path, channels: dict[str, np.ndarray], grid: Grid, unmapped: tuple[str, ...]
) -> Recording:
    noise = {
        name: channel.noise
        for name, channel in rig.reader.channels.items()
        if channel.noise is not None and name in channels
    }
    return Recording(
        name=path.stem,
        sample_time_s=grid.sample_time_s,
        channels=channels,
        noise=noise,
        starts=grid.starts,
        source=str(path),
        unmapped=unmapped,
        begins_s=grid.begins_s,
    )


def _columns(rig: Rig, table: Table) -> dict[str, int]:
    """Column numbers from 0 by full channel name, and of ``time``; optional ones may be missing."""
    reader = rig.reader
    wanted = {name: (c.column, c.optional) for name, c in reader.channels.items()}
    found: dict[str, int] = {}
    wrong: list[Message] = []
    named = {column for column, _ in wanted.values()}
    for name, (column, optional) in wanted.items():
        number = table.find(column, public_name(name))
        if isinstance(number, int):
            found[name] = number
        elif not optional:
            wrong.append(number)
        elif number.nearest not in {"", *named} and not number.nearest.startswith(REFERENCE):
            warnings.warn(f"{number}; left out", RecordingWarning, stacklevel=4)
    if not found:
        what = f"none of the columns of {rig.name} ({rig.plant.name}) is in this file"
        expected = listed(column for column, _ in wanted.values())
        if table.names:
            expected += f" among its columns {listed(table.names)}"
        hint = "; is it a recording of another plant?"
        raise InputError(Message(what + hint, expected=expected, file=table.file))
    if reader.time.step_s is None:
        number = table.find(reader.time.column or "time", "time")
        if isinstance(number, int):
            found["time"] = number
        else:
            wrong.insert(0, number)
    wrong += _shared(table, found)
    if wrong:
        raise InputError(*wrong)
    return found


def _shared(table: Table, columns: dict[str, int]) -> list[Message]:
    """Columns that the rig reads as two signals, one by its name and one by its number."""
    wrong, first = [], {}
    for name, number in columns.items():
        other = first.setdefault(number, name)
        if other != name:
            what = f"column {number + 1} is that of {public_name(other)} already"
            wrong.append(Message(what, public_name(name), "a column of its own", file=table.file))
    return wrong


def _require_units(rig: Rig, table: Table, columns: dict[str, int]) -> None:
    """Refuse a unit of the file that is another one than the rig says; warn of what is none."""
    wrong = []
    for name, number in columns.items():
        told = table.units[number].strip() if number < len(table.units) else ""
        unit = rig.reader.time.unit if name == "time" else rig.reader.channels[name].unit
        quantity = "time_s" if name == "time" else name
        if told in NO_UNIT:
            continue
        try:
            same = scale(told, quantity) == scale(_as_told(unit, told), quantity)
        except UnitError as error:
            expected = f"read as {unit or 'a plain number'}, as the rig says"
            text = f"{table.file}: {public_name(name)}: the file's {error}; {expected}"
            warnings.warn(text, RecordingWarning, stacklevel=3)
            continue
        if not same:
            what = f"the file says {told}, the rig {unit or 'none'}"
            expected = f"unit = '{told}' in the rig's [recording], or {unit or 'none'} in the file"
            wrong.append(Message(what, public_name(name), expected, file=table.file))
    if wrong:
        raise InputError(*wrong)


def _as_told(unit: str, told: str) -> str:
    """The rig's unit beside one of the file: a logger that writes bar may mean a gauge too.

    One that says gauge or absolute means just that.
    """
    explicit = is_gauge(told) or spelled(told) != told
    return unit if explicit else spelled(unit).removesuffix(GAUGE)


def _time(
    rig: Rig, table: Table, raw: dict[int, np.ndarray], columns: dict[str, int]
) -> np.ndarray:
    reader = rig.reader.time
    if reader.step_s is not None:
        return reader.step_s * np.arange(len(next(iter(raw.values()))))
    return scale(reader.unit, "time_s").to_si(raw[columns["time"]])


def _in_si(rig: Rig, table: Table, raw: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Channels in SI, still on the file's own times; refuses what cannot be."""
    plant, found, wrong = rig.plant, {}, []
    for name, values in raw.items():
        unit, values = rig.reader.channels[name].unit, without_infinite(name, values, table)
        found[name] = scale(unit, name, rig.ambient_pa).to_si(values)
        said = _missing(plant, table, found, name)
        if said is None and np.isfinite(values).any():
            said = impossible(name, values, found[name], unit, plant, table)
        if said is None and name in plant.measured and np.nanmin(values) == np.nanmax(values):
            seen = values[np.isfinite(values)]
            times = f"all {len(seen)} samples" if len(seen) > 1 else "its one sample"
            what = f"is {seen[0]:.6g} {unit} in {times}".replace("  ", " ")
            said = Message(what, public_name(name), "a sensor that moves", file=table.file)
        if said is None and name in plant.measured + plant.optional_outputs:
            warn_of_outliers(name, values, unit, table)
        wrong += [said] if said else []
    if wrong:
        raise InputError(*wrong)
    return found


def _missing(plant: Plant, table: Table, found: dict[str, np.ndarray], name: str) -> Message | None:
    """What is wrong with the missing samples of a channel: an input must be complete."""
    stretch = missing_stretch(found[name])
    if stretch is None:
        return None
    first, length = stretch
    kind = public_name(name)
    if length == len(found[name]):
        return Message("has no samples at all", kind, file=table.file)
    if name in plant.measured or name in plant.optional_outputs:
        return None
    what = f"{length} samples are missing from {table.place(first)} on"
    return Message(what, kind, "an input without missing samples", file=table.file)
