"""What is played: commands, or references that a position loop follows, and the shapes of both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workbench.manoeuvres.limits import Drive, Limits

LEAD_S = 1.0  # in which a reference leaves the position where it starts
SEED = 5  # of steps and phases: the same manoeuvre every time


@dataclass(frozen=True)
class Play:
    """One manoeuvre on the clock of its limits, n samples.

    Attributes
    ----------
    commands
        Shape (n_u, n); NaN where a position loop is to give them.
    reference
        Of each axis, shape (n_axes, n), in SI; NaN where its loop is off.
    words
        What a person does, where the limits do not let it be what its manoeuvre says.
    """

    commands: np.ndarray
    reference: np.ndarray
    words: str = ""

    @property
    def looped(self) -> bool:
        """True where a position loop has to act."""
        return bool(np.isnan(self.commands).any())


@dataclass(frozen=True)
class Manoeuvre:
    """One entry of the library.

    Attributes
    ----------
    words
        What a person does.
    drive
        The plants that it is for.
    make
        (limits, share) -> what is played, ``share`` of its full size, 0 to 1.
    ends
        Meant to reach the stops.
    """

    words: str
    drive: Drive
    make: Callable[[Limits, float], Play]
    ends: bool = False


def followed(limits: Limits, place: np.ndarray, share: float) -> Play:
    """A position loop follows ``place``, (n,) or (n_axes, n): 0 to 1 is what was recorded.

    ``share`` shrinks it about the middle.
    """
    lead = np.clip(limits.time_s / LEAD_S, 0.0, 1.0)
    fade = 0.5 * (1.0 - np.cos(np.pi * lead))
    around = 0.5 + share * (place - 0.5)
    around = np.broadcast_to(around, (len(limits.axes), limits.samples))
    rows = [
        a.start + fade * (a.low + (a.high - a.low) * own - a.start)
        for a, own in zip(limits.axes, around, strict=True)
    ]
    return Play(np.full((len(limits.commands), limits.samples), np.nan), np.array(rows))


def commanded(limits: Limits, size: np.ndarray) -> Play:
    """Commands ``size``, (n,): -1 and 1 are the ends of their ranges, 0 is where they rest."""
    return Play(opened(limits, size), np.zeros((len(limits.axes), limits.samples)))


def opened(limits: Limits, size: np.ndarray) -> np.ndarray:
    """The commands themselves, shape (n_u, n)."""
    rows = [
        s.nominal + np.where(size > 0, s.upper - s.nominal, s.nominal - s.lower) * size
        for s in limits.commands
    ]
    return np.array(rows)


def random() -> np.random.Generator:
    """The numbers that manoeuvres draw."""
    return np.random.default_rng(SEED)


def zigzag(phase: np.ndarray) -> np.ndarray:
    """A triangle between 0 and 1 that begins at 0, with period 1."""
    return 1.0 - np.abs(1.0 - 2.0 * (phase % 1.0))


def odd_multisine(time_s: np.ndarray, base_hz: float, lines: int) -> np.ndarray:
    """Odd harmonics of equal speed with random phases, at most 1 in size.

    Odd lines alone tell effects that depend on direction from those that do not: what appears on
    the even ones is even.

    Source: Schoukens, Vaes and Pintelon 2016, "Linear system identification in a nonlinear
    setting".
    """
    harmonics = 2 * np.arange(lines) + 1
    phases = random().uniform(0.0, 2.0 * np.pi, lines)
    waves = np.sin(2.0 * np.pi * base_hz * harmonics[:, None] * time_s + phases[:, None])
    summed = (waves / harmonics[:, None]).sum(axis=0)
    return summed / np.abs(summed).max()


def levels(time_s: np.ndarray, places: np.ndarray, dwell_s: float, move_s: float) -> np.ndarray:
    """Places held for so long each, with half-cosine moves between; the last one stays."""
    found = np.full(len(time_s), places[0])
    for k in range(1, len(places)):
        phase = np.clip((time_s - k * dwell_s) / move_s, 0.0, 1.0)
        found += (places[k] - places[k - 1]) * 0.5 * (1.0 - np.cos(np.pi * phase))
    return found
