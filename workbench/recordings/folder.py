"""Where the real recordings lie: they are not part of the project."""

from __future__ import annotations

import os
from pathlib import Path

from workbench.errors import InputError, Message

VARIABLE = "WORKBENCH_DATA"
BESIDE = Path(__file__).parents[2].parent / "shared" / "data"


def real_data_folder(given: Path | str | None = None) -> Path | None:
    """The folder with the real recordings; None where there is none.

    The first of: what was given, the environment variable WORKBENCH_DATA, and shared/data beside
    the project.
    """
    folder = Path(given or os.environ.get(VARIABLE) or BESIDE)
    return folder if folder.is_dir() else None


def use_real_data(folder: Path) -> None:
    """Take the real recordings from this folder, in processes started from here as well.

    Raises
    ------
    InputError
        If it is no folder.
    """
    if not folder.is_dir():
        raise InputError(
            Message("is no folder", expected="that of the recordings", file=str(folder))
        )
    os.environ[VARIABLE] = str(folder.resolve())
