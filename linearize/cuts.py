"""Where a plant's range is cut: intervals of signals, levels of switches, and what is wrong there.

Cuts come from a user, so everything wrong with them is said at once, one message for each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import isfinite

import numpy as np

from linearize.reduction import DesignModel
from workbench.errors import InputError, Message, listed, nearest

SAME_LEVEL = 1e-6


@dataclass(frozen=True)
class Interval:
    """Part of a signal's range, and the value inside it where the plant is linearised.

    ``holds`` names states that do not move in it: a slide that sticks has no velocity.
    """

    label: str
    lower: float
    upper: float
    point: float
    holds: tuple[str, ...] = ()

    def contains(self, value: float | np.ndarray) -> bool | np.ndarray:
        """True from the lower end up to, and without, the upper one; a value or any array."""
        return (self.lower <= value) & (value < self.upper)


@dataclass(frozen=True)
class Level:
    """One value of a switched command.

    A switch has no slope: it chooses the mode and is no input inside of it.
    """

    label: str
    point: float

    @property
    def holds(self) -> tuple[str, ...]:
        """No state: a switch holds nothing."""
        return ()

    def contains(self, value: float | np.ndarray) -> bool | np.ndarray:
        """True at the value; a value or any array."""
        return abs(value - self.point) <= SAME_LEVEL


@dataclass(frozen=True)
class Guard:
    """A half-space of signals in which a mode holds: offset + sum of weight * signal >= 0."""

    weights: Mapping[str, float]
    offset: float

    def holds(self, signals: Mapping[str, float | np.ndarray]) -> bool | np.ndarray:
        """True inside of it; each signal a value, or all arrays of one shape."""
        return self.offset + sum(w * signals[name] for name, w in self.weights.items()) >= 0.0


@dataclass(frozen=True)
class Jump:
    """A state that is multiplied at once where a signal rises to a value: a body picks up another.

    signal, at      what rises, and to which value
    state, ratio    what changes, and by how much: v <- ratio * v
    """

    signal: str
    at: float
    state: str
    ratio: float


@dataclass(frozen=True)
class Wording:
    """What signals and their values are called where something is wrong with them.

    name     a signal: by default its full name, which a program knows it by
    value    what a signal is at, of its full name and the value: by default in SI
    """

    name: Callable[[str], str] = str
    value: Callable[[str, float], str] = lambda signal, value: f"{value:g}"


Region = Interval | Level
Cuts = Mapping[str, tuple[Region, ...]]
Box = Mapping[str, Region]


def checked(
    model: DesignModel, cuts: Mapping[str, Iterable[Region]], words: Wording | None = None
) -> Cuts:
    """The same cuts as tuples, once nothing is wrong with them.

    Raises
    ------
    InputError
        One message for every unknown signal, empty interval, gap, overlap, point outside its
        interval, label that stands twice, and level that a switch does not have or that is missing.
    """
    found = {signal: tuple(regions) for signal, regions in cuts.items()}
    words = words or Wording()
    if wrong := [m for item in found.items() for m in _wrong(model, *item, words)]:
        raise InputError(*wrong)
    return found


def _wrong(
    model: DesignModel, signal: str, regions: tuple[Region, ...], words: Wording
) -> Iterator[Message]:
    known, called = [words.name(n) for n in (*model.states, *model.commands)], words.name(signal)
    if called not in known:
        what = f"{model.plant.name} has no such signal to cut"
        yield Message(what, called, listed(known), nearest(called, known))
        return
    if not regions:
        yield Message("is cut into nothing", called, "at least one interval or level")
    labels = [region.label for region in regions]
    for label in dict.fromkeys(label for label in labels if labels.count(label) > 1):
        yield Message(f"{labels.count(label)} regions are called '{label}'", called)
    states = [words.name(name) for name in model.states]
    for region in regions:
        for held in map(words.name, region.holds):
            if held not in states:
                what = f"'{region.label}' holds {held}, which is no state"
                yield Message(what, called, listed(states), nearest(held, states))
    intervals = [region for region in regions if isinstance(region, Interval)]
    levels = [region for region in regions if isinstance(region, Level)]
    at = partial(words.value, signal)
    if levels or _values(model, signal):
        wrong = _wrong_levels(model, signal, levels, intervals, at)
    else:
        wrong = _wrong_intervals(intervals, at)
    yield from (replace(each, name=called) for each in wrong)


def _wrong_intervals(intervals: list[Interval], at: Callable[[float], str]) -> Iterator[Message]:
    for part in intervals:
        span = f"'{part.label}', {at(part.lower)} to {at(part.upper)}"
        if not part.lower < part.upper:
            yield Message(f"{span}, is empty", expected="lower < upper")
        elif not (isfinite(part.point) and part.contains(part.point)):
            what = f"the point {at(part.point)} lies outside {span}"
            yield Message(what, expected="lower <= point < upper")
    whole = sorted((p for p in intervals if p.lower < p.upper), key=lambda part: part.lower)
    for left, right in pairwise(whole):
        if right.lower < left.upper:
            shared = f"{at(right.lower)} to {at(min(left.upper, right.upper))}"
            yield Message(f"'{left.label}' and '{right.label}' overlap from {shared}")
        elif right.lower > left.upper:
            gap = f"{at(left.upper)} to {at(right.lower)}"
            yield Message(f"nothing covers {gap}, between '{left.label}' and '{right.label}'")


def _wrong_levels(
    model: DesignModel,
    signal: str,
    levels: list[Level],
    intervals: list[Interval],
    at: Callable[[float], str],
) -> Iterator[Message]:
    values = _values(model, signal)
    if signal in model.states:
        yield Message("a state passes through its values", expected="intervals instead of levels")
        return
    if intervals:
        named = listed(f"'{part.label}'" for part in intervals)
        what = f"{named}: a switched command has no intervals"
        yield Message(what, expected="a level for each of its values")
    for level in levels:
        if not isfinite(level.point) or (values and not any(map(level.contains, values))):
            expected = " or ".join(map(at, values)) or "a finite value"
            yield Message(f"'{level.label}' is at {at(level.point)}", expected=expected)
        elif sum(other.contains(level.point) for other in levels) > 1:
            yield Message(f"'{level.label}' stands at {at(level.point)} as another one")
    for value in values:
        if not intervals and not any(level.contains(value) for level in levels):
            what, expected = f"nothing covers {at(value)}", "a level for each of its values"
            yield Message(what, expected=expected)


def _values(model: DesignModel, signal: str) -> tuple[float, ...]:
    """The only values of a switched command; none for anything else."""
    return next((s.levels for s in model.plant.commands if s.name == signal), ())
