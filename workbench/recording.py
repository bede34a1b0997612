"""Recordings: named channels on one uniform time grid, measured or simulated alike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from workbench.errors import Message, UnknownNameError, nearest


@dataclass(frozen=True)
class Recording:
    """Channels in SI units, named like the plant's signals; a missing sample is NaN.

    Attributes
    ----------
    channels
        Values by full name with unit, each of shape (n,).
    noise
        Standard deviation of the sensor noise by channel, where it is known.
    starts
        First sample of each piece, in order; a recording without gaps has one piece, (0,).
        Pieces are simulated separately.
    unmapped
        Names of the columns in its file that the rig does not read.
    begins_s
        Time of its first sample on the clock of its file.
    """

    name: str
    sample_time_s: float
    channels: Mapping[str, np.ndarray]
    noise: Mapping[str, float] = field(default_factory=dict)
    starts: tuple[int, ...] = (0,)
    source: str = ""
    unmapped: tuple[str, ...] = ()
    begins_s: float = 0.0

    def __post_init__(self) -> None:
        lengths = {channel: len(values) for channel, values in self.channels.items()}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"{self.name}: channels differ in length: {lengths}")

    def __getitem__(self, channel: str) -> np.ndarray:
        if channel not in self.channels:
            what = f"{self.name} has no {channel}; it has {', '.join(self.channels)}"
            raise UnknownNameError(Message(what, nearest=nearest(channel, self.channels)))
        return self.channels[channel]

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())))

    @property
    def time_s(self) -> np.ndarray:
        """Sample times from zero, shape (n,)."""
        return self.sample_time_s * np.arange(len(self))

    def rows(self, channels: Iterable[str]) -> np.ndarray:
        """The named channels, one per row, shape (n_channels, n)."""
        found = [self[channel] for channel in channels]
        return np.array(found) if found else np.zeros((0, len(self)))

    def part(self, first: int, last: int) -> Recording:
        """Samples ``first`` up to, not including, ``last``."""
        cut = {name: values[first:last] for name, values in self.channels.items()}
        inside = tuple(start - first for start in self.starts if first < start < last)
        begins_s = self.begins_s + self.sample_time_s * first
        return replace(self, channels=cut, starts=(0, *inside), begins_s=begins_s)

    @property
    def pieces(self) -> tuple[Recording, ...]:
        """The gap-free pieces, in order."""
        ends = (*self.starts[1:], len(self))
        return tuple(self.part(a, b) for a, b in zip(self.starts, ends, strict=True))


def joined(recordings: Sequence[Recording]) -> Recording:
    """Recordings of one clock as the pieces of one, with the channels that all of them have.

    Time runs on from one to the next; nothing is simulated across.
    """
    first, *others = recordings
    if not others:
        return first
    shared = [c for c in first.channels if all(c in other.channels for other in others)]
    channels = {c: np.concatenate([each[c] for each in recordings]) for c in shared}
    ends = np.cumsum([0, *(len(each) for each in recordings)]).tolist()
    starts = [end + s for end, each in zip(ends, recordings, strict=False) for s in each.starts]
    name = " + ".join(each.name for each in recordings)
    return replace(first, name=name, channels=channels, starts=tuple(starts))


def same_data(one: Recording, other: Recording) -> bool:
    """True where two recordings hold the same samples in all channels that both have."""
    both = [name for name in one.channels if name in other.channels]
    return len(one) == len(other) and all(
        np.array_equal(one[name], other[name], equal_nan=True) for name in both
    )
