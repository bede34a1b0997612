"""Samples that are no measurement: the -9999 of a logger that had none, or infinity."""

from __future__ import annotations

import warnings

import numpy as np

from workbench.errors import Message
from workbench.plant import Plant
from workbench.reading.plausible import cannot_be
from workbench.reading.table import RecordingWarning, Table
from workbench.units import public_name

INNER = (0.01, 0.99)  # quantiles between which no sample is alone
FAR = 5.0  # ranges of the inner samples beyond their ends
ALONE = 3  # samples in a row at most: what moves so far takes longer


def outliers(values: np.ndarray) -> np.ndarray:
    """True for single samples far off all others, shape (n,)."""
    seen = values[np.isfinite(values)]
    if not len(seen):
        return np.zeros(len(values), bool)
    low, high = np.quantile(seen, INNER)
    room = FAR * (high - low)
    far = (values < low - room) | (values > high + room)
    if room <= 0.0 or not far.any():
        return np.zeros(len(values), bool)
    edges = np.diff(np.concatenate([[0], far.astype(int), [0]]))
    for first, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        far[first:end] = end - first <= ALONE
    return far


def without_infinite(name: str, values: np.ndarray, table: Table) -> np.ndarray:
    """A channel as in its file, NaN where it is infinite, with a word on that."""
    infinite = np.isinf(values)
    if not infinite.any():
        return values
    count, place = int(infinite.sum()), table.place(int(infinite.argmax()))
    many = f", the first of {count} such samples" if count > 1 else ""
    text = f"{table.file}: {public_name(name)}: is infinite at {place}{many}; taken as missing"
    warnings.warn(text, RecordingWarning, stacklevel=3)
    return np.where(infinite, np.nan, values)


def impossible(
    name: str, raw: np.ndarray, si: np.ndarray, unit: str, plant: Plant, table: Table
) -> Message | None:
    """What makes a channel impossible in its unit: a few samples of it, or all in another unit."""
    said = cannot_be(name, raw, si, unit, plant, table.file)
    far = outliers(si)
    if said is None or not far.any() or any(signal.name == name for signal in plant.commands):
        return said
    if cannot_be(name, raw[~far], si[~far], unit, plant, table.file) is not None:
        return said
    what, expected = _far_off(raw, far, unit, table), "an empty cell where nothing was measured"
    return Message(what, public_name(name), expected, file=table.file)


def warn_of_outliers(name: str, raw: np.ndarray, unit: str, table: Table) -> None:
    """Warn of samples, as in the file, far off all others: they count in all that follows."""
    far = outliers(raw)
    if far.any():
        expected = "an empty cell where nothing was measured"
        said = Message(
            _far_off(raw, far, unit, table), public_name(name), expected, file=table.file
        )
        warnings.warn(str(said), RecordingWarning, stacklevel=3)


def _far_off(raw: np.ndarray, far: np.ndarray, unit: str, table: Table) -> str:
    first, count = int(far.argmax()), int(far.sum())
    more = f", the first of {count} such samples" if count > 1 else ""
    return f"is {raw[first]:.6g} {unit} at {table.place(first)}, far off all others{more}"
