"""Files of a command: what it may write, recordings it reads, JSON it writes."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from workbench.recording import Recording

ANOTHER = "the name of another file to write"
TAKEN = "is a file that this command writes besides"


def writable(
    *files: Path | None,
    folders: Iterable[Path | None] = (),
    reads: Iterable[Path | None] = (),
    besides: Iterable[Path | None] = (),
) -> None:
    """Refuse, before any work, a file or a folder that could not be written in the end.

    ``reads`` are the files that the command reads and that are not to be written over: a slip of
    the hand must not cost a recording.  Nor must one result cost another: ``besides`` are files
    that the command writes too.

    Raises
    ------
    InputError
        Naming all of them.
    """
    from workbench.errors import InputError, Message
    from workbench.whole_file import is_channel

    wrong, read, written = [], [*filter(None, reads)], [*filter(None, besides)]
    for path in filter(None, files):
        if any(_same(path, other) for other in read):
            what = "is a file that this command reads"
            wrong.append(Message(what, str(path), ANOTHER))
        elif is_channel(path):  # takes as much as comes, beside a folder that may take nothing
            shut = not os.access(path, os.W_OK)
            wrong += [Message("cannot be written", str(path), ANOTHER)] if shut else []
        elif path.is_dir():
            wrong.append(Message("is a folder", str(path), "the name of a file to write"))
        elif any(_below(path, other) or _below(other, path) for other in written):
            wrong.append(Message(TAKEN, str(path), ANOTHER))
        else:
            wrong += _no_folder(path, Path(os.path.realpath(path)).parent)
            written.append(path)
    for path in filter(None, folders):
        if any(_below(path, other) for other in written):
            wrong.append(Message(TAKEN, str(path), "a folder to write into"))
        else:
            wrong += _no_folder(path, path)
    if wrong:
        raise InputError(*wrong)


def text_to_write(path: Path) -> None:
    """Refuse, before any work, to write a recording under the ending of a binary file.

    It would be text all the same, which nothing reads back by that name.

    Raises
    ------
    InputError
        With a name that does.
    """
    from workbench.errors import InputError, Message
    from workbench.reading.formats import BINARY

    if path.suffix.lower() in BINARY:
        what = f"recordings are written as CSV, not as {path.suffix}"
        raise InputError(Message(what, str(path), f"{path.with_suffix('.csv')}"))


def warn_in_place(output: Path | None, *rigs: Path | None) -> None:
    """A word where a rig file that is read is the one to be written: comments do not survive."""
    if output and any(_same(output, rig) for rig in filter(None, rigs)):
        what = "is a rig file that is read, and is written anew: its own comments and order are "
        warnings.warn(f"{output}: {what}lost; another name for -o keeps it", stacklevel=2)


def _same(path: Path, other: Path) -> bool:
    """Whether two names stand for one file that is there, by a link too."""
    try:
        return path.samefile(other)
    except OSError:
        return False


def _below(path: Path, other: Path) -> bool:
    """Whether a name stands for the file of another one, or lies below it as below a folder."""
    whole, above = path.resolve(), other.resolve()
    return above in (whole, *whole.parents)


def _no_folder(path: Path, folder: Path) -> list[Any]:
    """What stands in the way of writing into a folder, which need not be there yet."""
    from workbench.errors import Message

    nearest = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not nearest.is_dir():
        what = "is a file" if nearest == path else f"cannot be written: {nearest} is a file"
        return [Message(what, str(path), "a folder to write into")]
    if not os.access(nearest, os.W_OK | os.X_OK):
        return [Message(f"cannot be written: {nearest} is read-only", str(path))]
    try:  # some folders allow it and take no file all the same, such as /proc
        tempfile.TemporaryFile(dir=nearest).close()
    except OSError as error:
        return [Message(f"cannot be written: {nearest}: {error.strerror}", str(path))]
    return []


def write_json(path: Path | None, document: dict[str, Any]) -> None:
    """Write a document, if a file is wanted."""
    if path is None:
        return
    import json

    from workbench.whole_file import whole_file

    with whole_file(path) as unfinished:
        text = json.dumps(document, indent=2, allow_nan=False)
        unfinished.write_text(text + "\n", encoding="utf-8")


def read_all(rig: Any, paths: list[Path] | None, say: Callable[[str], None]) -> list[Recording]:
    """All recordings of a rig, each with a name of its own; all that is wrong is said at once.

    Raises
    ------
    InputError
        With the messages of all recordings.
    """
    from workbench.errors import InputError
    from workbench.reading import read_recording

    found, wrong = [], []
    for path in paths or ():
        say(f"reading {path}")
        try:
            found.append(read_recording(rig, path))
        except InputError as error:
            wrong += error.messages
    if wrong:
        raise InputError(*wrong)
    return with_own_names(found)


def read_to_fit(
    rig: Any, paths: list[Path], say: Callable[[str], None], only: tuple[str, ...] = ()
) -> list[Recording]:
    """Recordings with samples enough for the parameters that are to be fitted to them."""
    from workbench.reading import enough_samples

    found = read_all(rig, paths, say)
    enough_samples(rig, found, only)
    return found


def with_own_names(recordings: list[Recording]) -> list[Recording]:
    """The same recordings; of files of one name the folder tells them apart, else a number.

    Figures are named after recordings, with ``_`` for a space.
    """
    names = [each.name for each in recordings]
    folders = [Path(each.source).absolute().parent.name for each in recordings]
    pairs = [*zip(folders, names, strict=True)]
    names = [f"{a} {b}" if c else b for (a, b), c in zip(pairs, _repeated(names), strict=True)]
    again = _repeated(names)
    names = [f"{name} {k}" if again[k - 1] else name for k, name in enumerate(names, start=1)]
    return [replace(each, name=name) for each, name in zip(recordings, names, strict=True)]


def _repeated(names: list[str]) -> list[bool]:
    """Which names stand for the same file name as another."""
    files = [name.replace(" ", "_").casefold() for name in names]
    return [files.count(name) > 1 for name in files]
