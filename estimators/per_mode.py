"""An estimator of its own in every mode: all of them run side by side, that of the mode speaks.

The mode is looked up where the usual estimate lay and under the command that held since, as a
filter on the modes does: the word of an estimator for one mode does not keep it there.  Every
estimator sees every sample, so that none has to be begun anew where its mode begins, and what it
costs is the sum.  A choice is written as

    ekf,kalman@slide,ukf@stick middle

the usual estimator first, then others with a mode's name or some words of it as they stand there;
where several fit, the last counts.

Source: P. S. Maybeck, "Stochastic Models, Estimation, and Control", vol. 2, 1982, Sec. 10.8 (banks
of filters); here the mode is known by its box and its guards, not by likelihoods.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from estimators.scheduled_kalman import ScheduledKalman
from estimators.wrapped import Wrapped
from workbench.contracts import Estimate, Estimator
from workbench.errors import Message, UnknownNameError, nearest

NEXT, AT = ",", "@"


@dataclass(frozen=True, kw_only=True)
class PerMode(Wrapped):
    """See the module; ``inner`` is the usual one, note ``speaks`` counts from it, 0.

    Attributes
    ----------
    others
        Those of some modes; the states that all estimators have are estimated.
    finder
        Whose modes they are.
    speaks
        Which estimator speaks in each mode of the finder, 0 the usual one.
    """

    others: tuple[Estimator, ...]
    finder: ScheduledKalman
    speaks: tuple[int, ...]

    def start(self, measurement: np.ndarray) -> Estimate:
        return self._told(0, tuple(each.start(measurement) for each in self._bank))

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        now = tuple(
            each.update(before, command, measurement)
            for each, before in zip(self._bank, last.memory, strict=True)
        )
        x = last.memory[0].pick(self.finder.sampled.hybrid.model.states)
        return self._told(self.speaks[self.finder.mode_at(x, command)], now)

    @property
    def _bank(self) -> tuple[Estimator, ...]:
        return (self.inner, *self.others)

    def _told(self, k: int, every: tuple[Estimate, ...]) -> Estimate:
        """The estimate of one, in the states that all have; all of them are its memory."""
        names = tuple(n for n in every[0].names if all(n in other.names for other in every))
        rows = [every[k].names.index(name) for name in names]
        notes = {**every[k].notes, "speaks": float(k)}
        covariance = every[k].covariance[np.ix_(rows, rows)]
        return Estimate(names, every[k].state[rows], covariance, every, notes)


def names_of(choice: str) -> tuple[str, ...]:
    """The estimators that a choice names, the usual one first."""
    return tuple(part.partition(AT)[0].strip() for part in choice.split(NEXT))


def _phrases(names: Sequence[str], count: int) -> list[str]:
    """So many words in a row, of any of these names."""
    every = [name.split() for name in names]
    found = (" ".join(ws[k : k + count]) for ws in every for k in range(len(ws) - count + 1))
    return [*dict.fromkeys(found)] if count else []


def chosen_per_mode(
    choice: str, finder: ScheduledKalman, make: Callable[[str], Estimator]
) -> Estimator:
    """The estimator of a choice; a plain one where only one is named.

    Parameters
    ----------
    make
        An estimator by its name.

    Raises
    ------
    UnknownNameError
        If no mode has the words of a choice, or a later estimator has none.
    """
    names, parts = names_of(choice), choice.split(NEXT)
    if len(parts) == 1 and AT not in choice:
        return make(names[0])
    known = [mode.name for mode in finder.sampled.hybrid.modes]
    different = tuple(dict.fromkeys(names))
    speaks = np.zeros(len(known), dtype=int)
    for name, part in zip(names[1:], parts[1:], strict=True):
        words = part.partition(AT)[2].strip()
        fits = [k for k, mode in enumerate(known) if f" {words} " in f" {mode} "]
        if not words or not fits:
            what = f"{part.strip()!r} is for no mode; they are {', '.join(known)}"
            near = nearest(words, _phrases(known, len(words.split())))
            near = f"{name}{AT}{near}" if near else ""
            raise UnknownNameError(Message(what, "", f"words of one, as {name}@{known[0]}", near))
        speaks[fits] = different.index(name)
    if AT in parts[0]:
        what = f"{parts[0].strip()!r} comes first, which is for all other modes"
        raise UnknownNameError(Message(what, expected=f"{names[0]}{NEXT}{choice}"))
    usual, *others = map(make, different)
    return PerMode(inner=usual, others=(*others,), finder=finder, speaks=(*speaks.tolist(),))
