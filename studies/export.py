"""What other programs take: modes as a MAT file and a table, commands to be played."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import save
from workbench.whole_file import whole_file

if TYPE_CHECKING:
    from linearize.modes import HybridModel
    from workbench.diagnosis.result import NextRecording
    from workbench.rig import Rig

ARRAYS = ("A", "B", "C", "D", "state", "command", "output", "drift", "scale")
NAMES = ("state_names", "command_names", "output_names")


def export_modes(hybrid: HybridModel, folder: Path, command: str, text: str) -> None:
    """modes.mat, .npz and .txt; poles.*, mode_poles.*, mode_map.* and step.*.

    ``text`` is the table.  The MAT file holds a struct array with A, B, C, D, point and drift; the
    NumPy file the same arrays as ``A_0``, ``A_1`` and so on, and the names as ``name``,
    ``state_names_0``, ...  The map shows where each mode is active, the step the modes beside the
    plant; neither of cuts that do not cover them, or of modes of one joint each.  Each mode has its
    own pole map where there are at most 64.
    """
    from linearize.hybrid_simulation import sampled_hybrid
    from studies.figures.modes import SINGLE_MAPS, mode_poles_figure, pole_figure
    from studies.mode_pictures import map_figure, step_figure, step_of
    from studies.mode_views import VIEWS, view_of

    with whole_file(folder / "modes.mat") as unfinished:
        _write_mat(hybrid, unfinished)
    with whole_file(folder / "modes.npz") as unfinished:
        _write_npz(hybrid, unfinished)
    with whole_file(folder / "modes.txt") as unfinished:
        unfinished.write_text(text + "\n", encoding="utf-8")
    save(pole_figure(hybrid), folder / "poles", command)
    if len(hybrid.modes) <= SINGLE_MAPS:
        save(mode_poles_figure(hybrid), folder / "mode_poles", command)
    if hybrid.plant.name not in VIEWS or any(mode.elsewhere for mode in hybrid.modes):
        return
    try:
        modes = sampled_hybrid(hybrid, view_of(hybrid).sample_time_s)
        save(map_figure(modes), folder / "mode_map", command)
        save(step_figure(step_of({"modes": hybrid})), folder / "step", command)
    except LookupError as error:
        warnings.warn(f"no map and no step: {error.args[0]}", stacklevel=2)


def _write_npz(hybrid: HybridModel, path: Path) -> None:
    arrays: dict[str, np.ndarray] = {"name": np.array([mode.name for mode in hybrid.modes])}
    for k, mode in enumerate(hybrid.modes):
        arrays |= {f"{key}_{k}": getattr(mode, key) for key in ARRAYS}
        arrays |= {f"{key}_{k}": np.array(getattr(mode, key)) for key in NAMES}
    with path.open("wb") as file:
        np.savez(file, **arrays)


def _write_mat(hybrid: HybridModel, path: Path) -> None:
    from scipy.io import savemat

    kinds = [(key, object) for key in ("name", *ARRAYS, *NAMES)]
    modes = np.zeros(len(hybrid.modes), dtype=kinds)
    for row, mode in zip(modes, hybrid.modes, strict=True):
        row["name"] = mode.name
        for key in ARRAYS:
            value = getattr(mode, key)
            row[key] = value if value.ndim == 2 else value[:, None]
        for key in NAMES:
            row[key] = np.array(getattr(mode, key), dtype=object)
    with path.open("wb") as file:
        savemat(file, {"modes": modes})


def save_next_recording(rig: Rig, asked: NextRecording | None, folder: Path, command: str) -> None:
    """next_recording.pdf and .svg with what each rival would record, and what is to be played.

    next_recording.csv stands in place of the curves that stand beside other figures; see
    :func:`save_commands`.  Nothing where nothing can be played.
    """
    from studies.figures.next_recording import next_recording_figure

    if asked is None or not asked.predicted:
        return
    save(next_recording_figure(asked), folder / "next_recording", command)
    save_commands(rig, asked, folder / "next_recording.csv")


def save_commands(rig: Rig, asked: NextRecording, target: Path) -> None:
    """Commands and reference in the columns and units of the rig's files, and how to play them.

    The latter, with the speed map of the loop, is the file beside it whose name ends in _how.txt.
    """
    from studies.text_of_next_recording import instructions
    from workbench.reading.command_writer import write_commands

    write_commands(rig, asked.predicted[asked.separates[0]], target, asked.reference)
    with whole_file(target.with_name(f"{target.stem}_how.txt")) as unfinished:
        unfinished.write_text(instructions(asked), encoding="utf-8")
