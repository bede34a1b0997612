"""Every gear shift in a recording, from the energising that began it to where the gear is reached.

Valves that are energised a few milliseconds after each other begin one shift, not two, and a lever
that is still under way when a valve switches again is in the shift that it was in.  So a change of
the commands begins a new one only where the one before is long past, and the lever is not moved
any more by what it energised.

Source: physics.md 2.5 and S003-2 (from energising to reaching the position).  Neighbourhoods and
times are *chosen*.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from workbench.comparison.course import Course
from workbench.comparison.gear_shift import BETWEEN, REACH, Gears, gears_of, notch_at

REACHED = 1.0 / 24.0  # of the pitch: half a millimetre, which friction leaves to the detent
SETTLED_S = 0.02  # after a change of the commands valves and delays are at rest again
GEARS = {-1: "L", 0: "N", 1: "H"}


@dataclass(frozen=True)
class Shift:
    """From the sample of the energising that began it to the one at which the gear is reached."""

    case: str
    first: int
    last: int


@dataclass(frozen=True)
class _Attempt:
    """An energising with the change that followed last, and the shift that came of it, if one."""

    first: int
    end: int
    shift: Shift | None


def shifts(course: Course) -> tuple[Shift, ...]:
    """Every energising after which another gear was reached.

    Where a piece begins with energised valves it is not known since when they are.
    """
    return tuple(each.shift for each in _attempts(course) if each.shift)


def unfinished(course: Course) -> tuple[int, ...]:
    """First samples of those after which the lever left its notch and reached no other gear."""
    gears = gears_of(course)
    if gears is None:
        return ()
    x, reach_m = gears.place.value, REACH * gears.pitch_m
    failed = (each for each in _attempts(course) if each.shift is None)
    return tuple(
        each.first
        for each in failed
        if np.any(np.abs(x[each.first : each.end] - _nearest_m(gears, each.first)) > reach_m)
    )


def begins_energised(course: Course) -> bool:
    """True where a shift may have begun before the recording did, or a piece of it."""
    on = _energised(course)
    return gears_of(course) is not None and bool(on[:, list(course.recording.starts)].any())


def _attempts(course: Course) -> Iterator[_Attempt]:
    """All that was tried, one after the other, piece by piece."""
    gears, on = gears_of(course), _energised(course)
    if gears is None or not len(on):
        return
    settled = round(SETTLED_S / course.recording.sample_time_s)
    changed = np.flatnonzero(np.any(on[:, 1:] != on[:, :-1], axis=0)) + 1
    for begin, end in pairwise((*course.recording.starts, on.shape[1])):
        inside = [int(k) for k in changed if begin < k < end]
        yield from _attempts_of_piece(gears, on, inside, end, settled)


def _attempts_of_piece(
    gears: Gears, on: np.ndarray, changes: list[int], end: int, settled: int
) -> Iterator[_Attempt]:
    """What was tried within one piece; ``changes`` are the samples at which its commands change."""
    going: _Attempt | None = None
    for first, until in pairwise((*changes, end)):
        if not on[:, first].any():
            continue
        if going and not _still_acts(gears, on, changes, first, settled):
            yield going
            going = None
        waiting = next((k for k in changes if k > first and on[:, k].any()), end)
        begun = going.first if going else first
        going = _Attempt(begun, waiting, _shift(gears, begun, until, waiting))
        if going.shift:
            yield going
            going = None
    if going:
        yield going


def _still_acts(gears: Gears, on: np.ndarray, changes: list[int], first: int, settled: int) -> bool:
    """True where what was energised before a change still moves the lever, or is about to."""
    before = changes[changes.index(first) - 1]
    if first - before <= settled:
        return True
    between = notch_at(gears.place.value[first : first + 1], gears.pitch_m, REACHED)[0] == BETWEEN
    return bool(on[:, first - 1].any() and between and gears.place.moving[first] != 0.0)


def _shift(gears: Gears, first: int, until: int, waiting: int) -> Shift | None:
    """The shift that began at ``first``, ended by the next change, or else by the next energising.

    The gear is reached where the position enters its neighbourhood for good; none is where it ends
    within reach of no notch.
    """
    for end in (until, waiting):
        near = notch_at(gears.place.value[first:end], gears.pitch_m, REACHED)
        if near[-1] != BETWEEN:
            break
    origin = round(_nearest_m(gears, first) / gears.pitch_m)
    (target,) = notch_at(gears.place.value[end - 1 : end], gears.pitch_m, REACH).tolist()
    if target in (origin, BETWEEN):
        return None
    outside = np.flatnonzero(near != target)
    last = min(first + int(outside[-1]) + 1, end - 1)
    names = (GEARS.get(gear, f"{gear:+d}") for gear in (origin, target))
    return Shift(" to ".join(names), first, last)


def _nearest_m(gears: Gears, sample: int) -> float:
    """Place of the notch nearest to the lever at a sample."""
    return gears.pitch_m * round(float(gears.place.value[sample]) / gears.pitch_m)


def _energised(course: Course) -> np.ndarray:
    """Which switched commands are on, shape (n_switched, n)."""
    switched = [signal for signal in course.plant.commands if signal.levels]
    rows = [course.recording[s.name] > sum(s.levels) / len(s.levels) for s in switched]
    return np.array(rows, dtype=bool).reshape(len(rows), len(course.recording))
