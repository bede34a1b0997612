"""Columns of MATLAB files: version 5 by scipy, version 7.3 by h5py.

A vector is a column under its name, a matrix gives ``data(:,1)``, ``data(:,2)``, and the fields of
a structure ``s.y``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from workbench.errors import InputError, Message
from workbench.reading.table import Table, open_bytes

HDF5 = b"\x89HDF\r\n\x1a\n"
OPAQUE = "is a MATLAB object ({}), which only MATLAB can read"
REMEDY = "plain arrays: s = struct('t', ts.Time, 'y', ts.Data), then save('file.mat', 's')"


def matlab_table(path: Path) -> Table:
    """The columns of a MAT file; those that are read together must be of one length.

    Raises
    ------
    InputError
        If it cannot be read, or holds objects instead of arrays.
    """
    content = open_bytes(path)
    file = str(path)
    try:
        newer = HDF5 in content[:2048]
        columns = dict(_hdf5_columns(path, file) if newer else _version_5_columns(path, file))
    except InputError:
        raise
    except Exception as error:  # scipy and h5py raise what they please on a broken file
        raise InputError(Message(f"is no MAT file that can be read: {error}", file=file)) from None
    if not columns:
        raise InputError(Message("holds no vector or matrix of numbers", file=file))
    names = list(columns)

    def load(wanted: Sequence[int]) -> np.ndarray:
        chosen = {names[i]: columns[names[i]] for i in wanted}
        lengths = {name: len(values) for name, values in chosen.items()}
        if len(set(lengths.values())) > 1:
            said = ", ".join(f"{name} {n}" for name, n in lengths.items())
            raise InputError(Message(f"the columns differ in length: {said}", file=file))
        return np.array([columns[names[i]] for i in wanted])

    return Table(file, names, len(names), load, lambda row: f"sample {row + 1}")


def _version_5_columns(path: Path, file: str) -> Iterator[tuple[str, np.ndarray]]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabOpaque

    for name, value in loadmat(path, squeeze_me=False, struct_as_record=True).items():
        if isinstance(value, MatlabOpaque):
            fields = value.dtype.names or ()
            kind = value["s2"].item() if "s2" in fields else "object"
            kind = kind.decode() if isinstance(kind, bytes) else kind
            raise _opaque(file, "" if name in {"None", "__function_workspace__"} else name, kind)
        if not name.startswith("__"):
            yield from _plain(name, value)


def _plain(name: str, value: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Columns of an array; of every field where it is a structure."""
    if value.dtype.names:
        for key in value.dtype.names:
            yield from _plain(f"{name}.{key}", np.asarray(value[key].flat[0]))
    elif value.dtype.kind in "fiub":
        yield from _split(name, value)


def _hdf5_columns(path: Path, file: str) -> Iterator[tuple[str, np.ndarray]]:
    import h5py

    with h5py.File(path, "r") as root:
        yield from _group(root, "", file)


def _group(group: Mapping[str, Any], before: str, file: str) -> Iterator[tuple[str, np.ndarray]]:
    for key, value in group.items():
        if key.startswith("#"):  # where MATLAB keeps what cells and objects point to
            continue
        name = f"{before}{key}"
        kind = value.attrs.get("MATLAB_class", b"")
        kind = kind.decode() if isinstance(kind, bytes) else str(kind)
        if "MATLAB_object_decode" in value.attrs:
            raise _opaque(file, name, kind)
        if hasattr(value, "items"):
            yield from _group(value, f"{name}.", file)
        elif value.dtype.kind in "fiub" and kind not in {"char", "cell"}:
            yield from _split(name, np.asarray(value).T)  # MATLAB stores columns first


def _split(name: str, value: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """A vector as it is; the columns of a matrix one by one."""
    value = value.astype(float)
    if value.size == max(value.shape, default=0):
        yield name, value.ravel()
    elif value.ndim == 2:
        yield from ((f"{name}(:,{i + 1})", column) for i, column in enumerate(value.T))


def _opaque(file: str, name: str, kind: str) -> InputError:
    return InputError(Message(OPAQUE.format(kind), name, expected=REMEDY, file=file))
