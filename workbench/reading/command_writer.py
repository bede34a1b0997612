"""Commands as a file in the dialect of a rig: its own columns, units, separator and decimal sign.

So what a rig is to be played can be handed to what recorded it, and a file that was played reads
back like any recording of the rig.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from workbench.plant import Plant
from workbench.recording import Recording
from workbench.recording_format import REFERENCE
from workbench.rig import Rig
from workbench.units import display_scale, public_name, scale
from workbench.whole_file import whole_file

MISSING = "nan"  # in numbered columns that nothing is written to
SLACK = 1e-6  # of a sample: rows are at multiples of it up to rounding


def write_commands(
    rig: Rig, recording: Recording, path: Path | str, reference: Mapping[str, np.ndarray]
) -> None:
    """Time, commands and what else the plant needs as measured input, for :func:`read_inputs`.

    ``reference`` are further columns by output, (n,) in SI, in the output's own unit: what a
    position loop is to follow.  Where the rig tells the time between rows, commands are held at
    that: its recordings may be resampled.  The file appears only once it is complete.
    """
    rows = _rows(rig, recording)
    keyed = [(key, values[rows]) for key, values in _keyed(rig, recording, reference)]
    columns = _placed(keyed, reader_numbers=any(isinstance(key, int) for key, _ in keyed))
    reader = rig.reader
    decimal = reader.decimal or "."
    separator = reader.separator or (";" if decimal == "," else ",")
    texts = [[_text(value, decimal) for value in values] for _, values in columns]
    with whole_file(Path(path)) as unfinished, unfinished.open("w", encoding="utf-8") as file:
        file.write("# commands to be played\n" * reader.skip)
        if reader.header:
            names = [name for name, _ in columns]
            file.write(("  " if separator == " " else separator).join(names) + "\n")
        file.writelines(separator.join(row) + "\n" for row in zip(*texts, strict=True))


Keyed = Sequence[tuple[str | int, np.ndarray]]  # columns by name or number from 1


def _keyed(rig: Rig, recording: Recording, reference: Mapping[str, np.ndarray]) -> Keyed:
    """Time, inputs and references in the units of the rig's files."""
    time, found = rig.reader.time, []
    if time.step_s is None:
        key = "time" if time.column is None else time.column
        found.append((key, scale(time.unit, "time_s").from_si(recording.time_s)))
    for name in _inputs(rig.plant):
        channel = rig.reader.channels[name]
        values = scale(channel.unit, name, rig.ambient_pa).from_si(recording[name])
        found.append((channel.column, values))
    for name, values in reference.items():
        channel = rig.reader.channels.get(name)
        unit = scale(channel.unit, name, rig.ambient_pa) if channel else display_scale(name)
        label = channel.column if channel and isinstance(channel.column, str) else public_name(name)
        found.append((f"{REFERENCE}{label}", unit.from_si(values)))
    return found


def _rows(rig: Rig, recording: Recording) -> np.ndarray:
    """The sample that holds at each row of the file, (n_rows,)."""
    per_row = (rig.reader.time.step_s or recording.sample_time_s) / recording.sample_time_s
    count = int((len(recording) - 1) / per_row + SLACK) + 1
    return (per_row * np.arange(count) + SLACK).astype(int)


def _inputs(plant: Plant) -> list[str]:
    return [signal.name for signal in (*plant.commands, *plant.measured_inputs)]


def _placed(keyed: Keyed, reader_numbers: bool) -> list[tuple[str, np.ndarray]]:
    """Columns by name in their order: numbered ones at their places, named ones behind them."""
    if not reader_numbers:
        return [(str(key), values) for key, values in keyed]
    places = {key: values for key, values in keyed if isinstance(key, int)}
    empty = np.full(len(keyed[0][1]), np.nan)
    found = [(f"column {k}", places.get(k, empty)) for k in range(1, max(places) + 1)]
    return found + [(key, values) for key, values in keyed if isinstance(key, str)]


def _text(value: float, decimal: str) -> str:
    return f"{value:.10g}".replace(".", decimal) if np.isfinite(value) else MISSING
