"""Recordings as CSV files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from workbench.recording import Recording
from workbench.units import STANDARD_ATMOSPHERE_PA, display_unit, public_name, scale
from workbench.whole_file import whole_file

CLOCK = "%.15g"  # of a time that does not begin at zero, as one since 1970
GAP = 10.5  # samples of time between two pieces, so that they are found again


def write_recording(
    recording: Recording,
    path: Path | str,
    units: Mapping[str, str] | None = None,
    ambient_pa: float = STANDARD_ATMOSPHERE_PA,
) -> None:
    """A recording as CSV: a row of names, a row of units, then the samples.

    ``units`` by channel (full or public name) replace the units people usually read.  Without them
    a default rig of the plant reads the file back; where the recording has pieces, with
    ``gaps = "split"``.  Its time is that of the file from which the recording is.
    The file appears only once it is complete.
    """
    names = list(recording.channels)
    chosen = dict(units or {})
    shown = [chosen.get(n, chosen.get(public_name(n), display_unit(n))) for n in names]
    after = np.searchsorted(recording.starts, np.arange(len(recording)), side="right") - 1
    columns = [recording.begins_s + recording.time_s + GAP * recording.sample_time_s * after]
    for name, unit in zip(names, shown, strict=True):
        columns.append(scale(unit, name, ambient_pa).from_si(recording.channels[name]))
    head = ",".join(["time", *map(public_name, names)])
    with whole_file(path) as unfinished, unfinished.open("w", encoding="utf-8") as file:
        file.write(f"{head}\n{','.join(['s', *shown])}\n")
        digits = [CLOCK if recording.begins_s else "%.10g", *["%.10g"] * len(names)]
        np.savetxt(file, np.column_stack(columns), delimiter=",", fmt=digits)
