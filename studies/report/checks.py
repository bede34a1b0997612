"""The report of a check: what came out, of which parameters, with which versions and seeds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.catalogue_text import rig_parameters_text
from studies.figures.style import save_all
from studies.report.page import Section, write_report
from studies.tables import Table, write_tables
from studies.text import columns
from studies.versions import versions

if TYPE_CHECKING:
    from studies.checked_runs import CheckedRuns

SEEDS = (
    "Run 1 is of the rig's own plant.  Every other run k draws its plant with the seed (0, k - 1) "
    "of numpy's default generator, and every run its noise with the seed k - 1."
)


def report_check(found: CheckedRuns, noted: list[Table], folder: Path, command: str) -> Path:
    """Figures, tables and the page of a check; gives the page's path.

    ``noted`` are the tables of its text.
    """
    figures = found.figures()
    save_all(figures, folder, command)
    tables = write_tables(found.text, noted, folder / "tables")
    setup, made = found.setup, columns(("what", "version"), versions().items())
    runs = f"{len(found.rows)} runs" if found.several else "1 run"
    asked = f"{runs} of {setup.path.name} against {setup.rig.name}."
    files = ", ".join(f"tables/{name}.csv and .tex" for name in tables)
    sections = [
        Section("What came out", (asked, f"Tables: {files}."), found.text, (*figures,)),
        Section("Parameters of the rig", (), rig_parameters_text(setup.rig)),
        Section("The design", (), setup.design.rstrip()),
        Section("Versions and seeds", (SEEDS,), made),
    ]
    return write_report(folder, f"Check of {setup.path.stem}", command, sections)
