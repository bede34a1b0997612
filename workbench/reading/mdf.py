"""Columns of ASAM MDF files, versions 3 and 4, by asammdf (extra ``automotive``).

Such a file holds groups of channels, and each group has a clock of its own, its master channel.
What is read together has one clock here, under the name of the first master: that of the group
with most samples.  A sample of a slower group stands at the nearest sample of it, less than half a
sample away; between them its channel is missing, as that of a slow sensor is.

Source: ASAM MDF 4.2, channel groups and master channels.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from traceback import clear_frames
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.errors import InputError, Message
from workbench.reading.table import Table, open_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator

CLOCK = "time"  # where a file does not name its masters
HEAD = 64  # bytes of the block that every such file begins with


@dataclass(frozen=True)
class _Channel:
    """Where a channel of numbers stands in its file; ``samples`` are those of its group."""

    name: str
    unit: str
    group: int
    index: int
    samples: int


def mdf_table(path: Path) -> Table:
    """The columns of an MDF file: a clock, then every channel that holds a number per sample.

    Raises
    ------
    InputError
        If asammdf is not there, or the file cannot be read or holds no numbers.
    """
    open_bytes(path, HEAD)
    file = str(path)
    with _opened(path) as opened:
        clock, channels = _clock_name(opened), [*_channels(opened)]
    if not channels:
        raise InputError(Message("holds no channel of numbers", file=file))

    def load(wanted: Sequence[int]) -> np.ndarray:
        chosen = [channels[k - 1] for k in wanted if k > 0]
        finest = max(chosen or channels, key=lambda each: each.samples)
        with _opened(path) as opened:
            clock_s = np.asarray(opened.get_master(finest.group), dtype=float)
            return np.array(
                [clock_s if k == 0 else _on(clock_s, opened, channels[k - 1]) for k in wanted]
            )

    names, units = zip((clock, "s"), *((each.name, each.unit) for each in channels), strict=True)
    return Table(file, names, len(names), load, lambda row: f"sample {row + 1}", units)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The file, as asammdf has it."""
    try:
        from asammdf import MDF
    except ImportError:
        what = "is an MDF file, and asammdf, which reads them, is not installed"
        expected = "`pip install 'workbench[automotive]'`"
        raise InputError(Message(what, expected=expected, file=str(path))) from None
    try:
        with MDF(path) as opened:
            yield opened
    except InputError:
        raise
    except Exception as error:  # asammdf raises what it pleases on a broken file
        what = f"is no MDF file that can be read: {error}"
        _drop_half_opened(error)
        raise InputError(Message(what, file=str(path))) from None


def _drop_half_opened(error: Exception) -> None:
    """Let go of what asammdf opened half-way, whose complaint on its end is for nobody to read."""
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        clear_frames(error.__traceback__)
        gc.collect()
    finally:
        sys.unraisablehook = hook


def _clock_name(opened: Any) -> str:
    """What the master of the first group is called."""
    for group, index in sorted(opened.masters_db.items()):
        return opened.groups[group].channels[index].name
    return CLOCK


def _channels(opened: Any) -> Iterator[_Channel]:
    """Every channel but masters that holds one number per sample."""
    for number, group in enumerate(opened.groups):
        master = opened.masters_db.get(number)
        for index, channel in enumerate(group.channels):
            if index == master:
                continue
            samples = int(group.channel_group.cycles_nr)
            first = opened.get(group=number, index=index, record_count=1).samples
            if first.ndim == 1 and first.dtype.kind in "biuf" and samples:
                yield _Channel(channel.name, channel.unit or "", number, index, samples)


def _on(clock_s: np.ndarray, opened: Any, channel: _Channel) -> np.ndarray:
    """The samples of a channel at the nearest ones of a clock, NaN where there is none."""
    signal = opened.get(group=channel.group, index=channel.index)
    values, own_s = signal.samples.astype(float), np.asarray(signal.timestamps, dtype=float)
    if signal.invalidation_bits is not None:
        values[np.asarray(signal.invalidation_bits, dtype=bool)] = np.nan
    if np.array_equal(own_s, clock_s):
        return values
    edges_s = 0.5 * (clock_s[1:] + clock_s[:-1])
    nearest = np.searchsorted(edges_s, own_s)
    reach_s = 0.5 * np.median(np.diff(clock_s)) if len(edges_s) else 0.0
    near = np.abs(clock_s[nearest] - own_s) <= reach_s
    found = np.full(len(clock_s), np.nan)
    found[nearest[near]] = values[near]
    return found
