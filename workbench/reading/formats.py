"""Which reader a file has, by its ending; whatever has none here is text."""

from __future__ import annotations

from pathlib import Path

from workbench.reading.matlab import matlab_table
from workbench.reading.mdf import mdf_table
from workbench.reading.table import Table
from workbench.reading.text_table import text_table
from workbench.recording_format import RecordingFormat

BINARY = {".mat": matlab_table, ".mf4": mdf_table, ".mdf": mdf_table}


def table_of(path: Path, reader: RecordingFormat) -> Table:
    """The columns of a file; ``reader`` tells how text is written.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    read = BINARY.get(path.suffix.lower())
    return read(path) if read else text_table(path, reader)
