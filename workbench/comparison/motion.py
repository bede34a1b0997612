"""Regimes of motion: direction, rest and what follows it, ends of the stroke, reversals."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from workbench.comparison.course import Course, Place
from workbench.effects.forces import EndStops
from workbench.linkage import JointRod

NEAR_SHARE = 0.1  # of the stroke at each end
REVERSAL_S = 0.05  # on either side of a change of direction
AFTER_REST_S = 0.2  # for so long, behind a rest of at least as long

Rule = Callable[[np.ndarray, int], np.ndarray]


def motion(course: Course, place: Place) -> dict[str, np.ndarray]:
    """Which samples belong to each regime of one body or joint, shape (n,) each."""
    moving, dt = place.moving, course.recording.sample_time_s
    return {
        "at rest": moving == 0.0,
        "moving forward": moving > 0.0,
        "moving backward": moving < 0.0,
        "near the ends": _near_the_ends(course, place),
        "reversal": _by_piece(course, moving, _reversals, round(REVERSAL_S / dt)),
        "after rest": _by_piece(course, moving, _after_rest, round(AFTER_REST_S / dt)),
    }


def _by_piece(course: Course, moving: np.ndarray, rule: Rule, samples: int) -> np.ndarray:
    bounds = pairwise((*course.recording.starts, len(moving)))
    return np.concatenate([rule(moving[first:last], samples) for first, last in bounds])


def _near_the_ends(course: Course, place: Place) -> np.ndarray:
    """Near the stops of the body, or of the rod that turns the joint; else of what was recorded."""
    for stops in course.whole.effects:
        if isinstance(stops, EndStops) and stops.body in _bodies(course, place):
            (x,) = course.along(course.plant.model.conditions.read(f"{stops.body}.position_m"))
            return _outer(x, float(stops.lower_m), float(stops.upper_m))
    x = place.value
    return _outer(x, float(np.nanmin(x)), float(np.nanmax(x)))


def _bodies(course: Course, place: Place) -> set[str]:
    """What carries the stops of a place: the body itself, or the rod of the joint."""
    rods = (p for p in course.plant.parts if isinstance(p, JointRod) and p.joint == place.member)
    return {place.member, *(rod.name for rod in rods)}


def _outer(x: np.ndarray, low: float, high: float) -> np.ndarray:
    near = NEAR_SHARE * (high - low)
    return (x < low + near) | (x > high - near)


def _reversals(moving: np.ndarray, around: int) -> np.ndarray:
    """Samples near a change of direction, rests between two directions passed over, shape (n,)."""
    last = np.maximum.accumulate(np.where(moving != 0, np.arange(len(moving)), 0))
    direction = moving[last]
    turns = np.flatnonzero(direction[1:] * direction[:-1] < 0) + 1
    near = np.zeros(len(moving), dtype=bool)
    for turn in turns:
        near[max(turn - around, 0) : turn + around] = True
    return near


def _after_rest(moving: np.ndarray, samples: int) -> np.ndarray:
    """So many samples behind every rest of at least as many, shape (n,)."""
    edges = np.flatnonzero(np.diff(moving == 0.0)) + 1
    near = np.zeros(len(moving), dtype=bool)
    for first, last in pairwise((0, *edges, len(moving))):
        if moving[first] == 0.0 and last - first >= samples:
            near[last : last + samples] = True
    return near
