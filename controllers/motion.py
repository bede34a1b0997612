"""The wanted motion, and what pressures and opening go with it on a mode.

At a speed v, an acceleration and a jerk the axis needs certain pressures and a certain opening;
each is linear in the three and follows from the modes, Coulomb friction and gravity in their drift
included.  The three are differences of the coming reference.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from controllers.axis import Axis
from controllers.scheduled import Schedule
from linearize.modes import Mode

PREVIEW = 4  # columns of the reference whose differences are speed, acceleration and jerk


@dataclass(frozen=True, kw_only=True)
class MotionLimits:
    """Speed, acceleration and jerk above which a reference has jumped or has a corner."""

    speed: float = 2.0
    acceleration: float = 30.0
    jerk: float = 1e3


def motion(coming: np.ndarray, sample_time_s: float, limits: MotionLimits) -> np.ndarray:
    """Speed, acceleration and jerk of a reference, shape (3,), none where it jumps.

    ``coming`` has shape (PREVIEW,), the present sample first.
    """
    places = coming.tolist()
    steps = [(b - a) / sample_time_s for a, b in pairwise(places)]
    if max(map(abs, steps)) > limits.speed:
        return np.zeros(3)
    bends = [(b - a) / sample_time_s for a, b in pairwise(steps)]
    jerk = (bends[1] - bends[0]) / sample_time_s
    bend = bends[0] if max(map(abs, bends)) <= limits.acceleration else 0.0
    return np.array([steps[0], bend, jerk if abs(jerk) <= limits.jerk else 0.0])


@dataclass(frozen=True)
class Sliding:
    """Pressures and opening of a moving axis on one mode, (p_a, p_b, opening).

    by_motion    columns of 1, speed, acceleration and jerk, shape (3, 4)
    """

    by_motion: np.ndarray

    @property
    def level(self) -> np.ndarray:
        """Those at zero speed, shape (3,)."""
        return self.by_motion[:, 0]


def going_with(
    sliding: Schedule[Sliding], place: float, ahead: float, wanted: np.ndarray
) -> np.ndarray:
    """Pressures and opening (3,) of a motion (speed, acceleration, jerk), mixed of the modes."""
    moved = np.array([1.0, *wanted.tolist()])
    return sum(share * (each.by_motion @ moved) for share, each in sliding.weighted(place, ahead))


def sliding_on(mode: Mode, axis: Axis, centre_v: float) -> Sliding:
    """Pressures p and opening u that go with a motion, linear in v, dv/dt and d2v/dt2.

    (dv/dt, dp/dt) = drift + A_p (p - p0) + A_v (v - v0) + B (u - u0), solved for p and u, where
    dp/dt follows from p itself: what p changes with v times dv/dt, and so on.
    """
    rows = [mode.state_names.index(name) for name in (axis.velocity, *axis.pressures)]
    v, pressures = rows[0], rows[1:]
    size = mode.scale[rows]
    known = np.column_stack([mode.A[np.ix_(rows, pressures)], mode.B[rows]]) / size[:, None]

    def solved(rates: np.ndarray) -> np.ndarray:
        return np.linalg.solve(known, rates / size)

    centre = np.array([*mode.state[pressures], mode.command[0] - centre_v])
    per_speed = solved(-mode.A[rows, v])
    per_bend = solved(np.array([1.0, *per_speed[:2]]))
    per_jerk = solved(np.array([0.0, *per_bend[:2]]))
    level = centre + solved(-mode.drift[rows]) - per_speed * mode.state[v]
    return Sliding(np.column_stack([level, per_speed, per_bend, per_jerk]))
