"""What other programs take: modes as a MAT file and a table, commands to be played."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.modes import pole_figure
from studies.figures.style import save
from workbench.errors import whole_file

if TYPE_CHECKING:
    from linearize.modes import HybridModel
    from workbench.diagnosis.result import NextRecording
    from workbench.rig import Rig


def export_modes(hybrid: HybridModel, folder: Path, command: str) -> None:
    """modes.mat, a struct array with A, B, C, D, point and drift; modes.txt; poles.*.

    Of a slide also mode_map.* and step.*: where each mode is active, and the modes through a step
    of the valve beside the plant.
    """
    from linearize.hybrid_simulation import sampled_hybrid
    from linearize.listing import table
    from linearize.standard import SLIDE_MODES
    from studies.slide_modes import STEP_S, map_figure, step_figure, step_of

    with whole_file(folder / "modes.mat") as unfinished:
        _write_mat(hybrid, unfinished)
    with whole_file(folder / "modes.txt") as unfinished:
        unfinished.write_text(table(hybrid) + "\n", encoding="utf-8")
    save(pole_figure(hybrid), folder / "poles", command)
    if hybrid.plant.name in SLIDE_MODES:
        modes = sampled_hybrid(hybrid, STEP_S)
        save(map_figure(modes), folder / "mode_map", command)
        save(step_figure(step_of({"modes": hybrid})), folder / "step", command)


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


def save_next_recording(rig: Rig, asked: NextRecording | None, folder: Path, command: str) -> None:
    """next_recording.pdf and .svg with what each rival would record, and what is to be played.

    next_recording.csv holds commands and reference in the columns and units of the rig's files,
    in place of the curves that stand beside other figures.  Nothing where nothing can be played.
    """
    from studies.figures.next_recording import next_recording_figure
    from workbench.reading.command_writer import write_commands

    if asked is None or not asked.predicted:
        return
    save(next_recording_figure(asked), folder / "next_recording", command)
    commands = asked.predicted[asked.separates[0]]
    write_commands(rig, commands, folder / "next_recording.csv", asked.reference)
