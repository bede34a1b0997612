"""Modes for other programs: a MAT file, a table, and the pole map."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.modes import pole_figure
from studies.figures.style import save
from workbench.errors import whole_file

if TYPE_CHECKING:
    from linearize.modes import HybridModel


def export_modes(hybrid: HybridModel, folder: Path, command: str) -> None:
    """modes.mat, a struct array with A, B, C, D, point and drift; modes.txt; poles.*."""
    from linearize.listing import table

    with whole_file(folder / "modes.mat") as unfinished:
        _write_mat(hybrid, unfinished)
    with whole_file(folder / "modes.txt") as unfinished:
        unfinished.write_text(table(hybrid) + "\n", encoding="utf-8")
    save(pole_figure(hybrid), folder / "poles", command)


def _write_mat(hybrid: HybridModel, path: Path) -> None:
    from scipy.io import savemat

    fields = ("A", "B", "C", "D", "state", "command", "output", "drift")
    names = ("state_names", "command_names", "output_names")
    kinds = [(key, object) for key in ("name", *fields, *names)]
    modes = np.zeros(len(hybrid.modes), dtype=kinds)
    for row, mode in zip(modes, hybrid.modes, strict=True):
        row["name"] = mode.name
        for key in fields:
            value = getattr(mode, key)
            row[key] = value if value.ndim == 2 else value[:, None]
        for key in names:
            row[key] = np.array(getattr(mode, key), dtype=object)
    with path.open("wb") as file:
        savemat(file, {"modes": modes})
