"""The phases of gear shifts in a recording.

The detent has a notch every pitch of the lever's tip and pulls back hardest a quarter of a pitch
away from one; the synchroniser blocks between two distances from Neutral on the way out.  With x
the position of the body that moves the lever, and a notch's reach a quarter of the pitch:

in neutral, in gear     within reach of a notch, from the first rest there to the last
release                 within reach, from the last rest on
engaging                within reach, before the first rest
synchronising           in the synchroniser's zone, on the way from Neutral
travel                  all else

The geometry is the plant's own and holds where the effect itself is absent, because a recording may
show what the model lacks.

Source: physics.md 2.5 and 6 (detent, synchroniser).  The reach is *chosen*: the papers name no
phases.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from workbench.comparison.course import Course, Place
from workbench.effects.detent import Detent
from workbench.effects.synchroniser import Synchroniser
from workbench.lever import Lever

REACH = 1.0 / 4.0  # of the pitch, on either side of a notch
BETWEEN = 99  # no notch
PHASES = ("in neutral", "in gear", "release", "engaging", "synchronising", "travel")


@dataclass(frozen=True, eq=False)
class Gears:
    """The gears of a plant: who moves, how far the notches lie apart, where speeds are matched."""

    place: Place
    pitch_m: float
    zone_m: tuple[float, float] | None


def gears_of(course: Course) -> Gears | None:
    """The gears; None where the plant has no detent or the position was not recorded."""
    members = course.whole.members
    detent = next((m for m in members if isinstance(m, Detent)), None)
    if detent is None:
        return None
    lever = next(m for m in members if m.name == detent.lever)
    moved = f"{lever.tip_body}.position_m" if isinstance(lever, Lever) else ""
    place = next((p for p in course.places if p.name == moved), None)
    if place is None:
        return None
    gate = next((m for m in members if isinstance(m, Synchroniser)), None)
    zone_m = (float(gate.start_m), float(gate.end_m)) if gate else None
    return Gears(place, float(detent.pitch_m), zone_m)


def phases(course: Course) -> dict[str, np.ndarray]:
    """Which samples belong to each phase, shape (n,) each; they part the time."""
    gears = gears_of(course)
    if gears is None:
        return {}
    x, moving = gears.place.value, gears.place.moving
    notch = notch_at(x, gears.pitch_m, REACH)
    found = {name: np.zeros(len(x), dtype=bool) for name in PHASES}
    for first, last in _visits(notch, course.recording.starts):
        rest = np.flatnonzero(moving[first:last] == 0) + first
        if not len(rest):
            continue
        held = "in neutral" if notch[first] == 0 else "in gear"
        found["engaging"][first : rest[0]] = True
        found[held][rest[0] : rest[-1] + 1] = True
        found["release"][rest[-1] + 1 : last] = True
    rest_of = ~np.any([*found.values()], axis=0)
    if gears.zone_m:
        within = (np.abs(x) >= gears.zone_m[0]) & (np.abs(x) <= gears.zone_m[1])
        found["synchronising"] = within & rest_of & (_last_notch(notch) == 0)
    found["travel"] = rest_of & ~found["synchronising"]
    return found


def notch_at(position_m: np.ndarray, pitch_m: float, share: float) -> np.ndarray:
    """Number of the notch within that share of the pitch, ``BETWEEN`` where there is none, (n,)."""
    nearest = np.round(position_m / pitch_m)
    near = np.abs(position_m - nearest * pitch_m) <= share * pitch_m
    return np.where(near, nearest, BETWEEN).astype(int)


def _visits(notch: np.ndarray, starts: tuple[int, ...]) -> list[tuple[int, int]]:
    """First sample and the one behind the last of each stay at a notch."""
    edges = {0, len(notch), *starts, *(np.flatnonzero(np.diff(notch)) + 1).tolist()}
    return [(a, b) for a, b in pairwise(sorted(edges)) if notch[a] != BETWEEN]


def _last_notch(notch: np.ndarray) -> np.ndarray:
    """The notch last visited, ``BETWEEN`` before the first, shape (n,)."""
    visited = np.where(notch != BETWEEN, np.arange(len(notch)), 0)
    return notch[np.maximum.accumulate(visited)]
