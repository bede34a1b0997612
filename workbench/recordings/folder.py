"""Where the real recordings lie: they are not part of the project."""

from __future__ import annotations

import os
from pathlib import Path

VARIABLE = "WORKBENCH_DATA"
BESIDE = Path(__file__).parents[2].parent / "shared" / "data"


def real_data_folder(given: Path | str | None = None) -> Path | None:
    """The folder with the real recordings; None where there is none.

    The first of: what was given, the environment variable WORKBENCH_DATA, and shared/data beside
    the project.
    """
    folder = Path(given or os.environ.get(VARIABLE) or BESIDE)
    return folder if folder.is_dir() else None
