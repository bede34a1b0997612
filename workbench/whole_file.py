"""Files that are there as a whole or not at all, also where a run is stopped while it writes."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path: Path | str) -> Iterator[Path]:
    """A name to write to; it becomes ``path`` once all is written, and vanishes on an error.

    A link stays, and what it leads to is written.  A pipe or a device stays too, and gets all of it
    at once.
    """
    path = Path(path)
    if is_channel(path):
        with tempfile.TemporaryDirectory() as folder:
            unfinished = Path(folder, path.name)
            yield unfinished
            with unfinished.open("rb") as source, path.open("wb") as sink:
                shutil.copyfileobj(source, sink)
        return
    path = Path(os.path.realpath(path))  # which no ring of links stops
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    os.close(handle)
    try:
        yield Path(name)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)  # as any new file; mkstemp keeps others out
        os.replace(name, path)
    finally:
        Path(name).unlink(missing_ok=True)


def is_channel(path: Path) -> bool:
    """Whether something is there that is no file and no folder: a pipe, a device, also by a link.

    It must not be resolved: what the name of an open pipe leads to has no place.
    """
    return path.exists() and not path.is_file() and not path.is_dir()
