"""Where the stops of a plant are, as ends of what it measures: a position, or the angle of a joint.

A joint has none of its own: they are at the rod that turns it.
"""

from __future__ import annotations

from math import floor, inf, isfinite, pi

import casadi as ca
import numpy as np

from workbench.effects.forces import EndStops
from workbench.linkage import Joint, JointRod
from workbench.plant import Plant

NEAR = 3e-3  # of the stroke: closer to a stop a body comes to it, whether it touches it or not
SWEPT = 2001  # angles of the half turn from the shortest rod to the longest

Ends = tuple[float, float]  # the lower one and the upper one
NOWHERE: Ends = (-inf, inf)


def stops_of(plant: Plant, output: str, give_m: float = 0.0) -> Ends:
    """Ends of the stroke of a measured position or angle, infinite where nothing stops it; in SI.

    ``give_m`` is how far the stops give way, at the body or the rod that meets them.
    """
    member, _, quantity = output.rpartition(".")
    if quantity == "position_m":
        return _ends_m(plant, member, give_m) or NOWHERE
    rods = [p for p in plant.parts if isinstance(p, JointRod) and p.joint == member]
    for rod in rods if quantity == "angle_rad" else ():
        ends_m = _ends_m(plant, rod.name, give_m)
        if ends_m:
            return _angles_rad(plant, rod, ends_m)
    return NOWHERE


def near_stop(stops: Ends) -> float:
    """How near to a stop something comes to it, in m or rad; infinite where it has not both."""
    return NEAR * (stops[1] - stops[0])


def reach_of(recorded: Ends, room: float, stops: Ends, deep: Ends) -> Ends:
    """How far to go beyond what was recorded: by ``room``, but not beyond a stop.

    Stops that recordings came to give way, as far as ``deep``: what leans on one is beyond it.
    """
    near = near_stop(stops)
    near = near if isfinite(near) else 0.0
    low = deep[0] if recorded[0] < stops[0] + near else stops[0]
    high = deep[1] if recorded[1] > stops[1] - near else stops[1]
    return max(low, recorded[0] - room), min(high, recorded[1] + room)


def _ends_m(plant: Plant, body: str, give_m: float) -> Ends | None:
    ends = [e for e in plant.effects if isinstance(e, EndStops) and e.body == body]
    return (float(ends[0].lower_m) - give_m, float(ends[0].upper_m) + give_m) if ends else None


def _angles_rad(plant: Plant, rod: JointRod, ends_m: Ends) -> Ends:
    """Angles of the joint where its rod is at two places; infinite where it never is.

    In half a turn, that of the joint's start, the rod only grows or only shrinks.
    """
    (joint,) = (p for p in plant.parts if isinstance(p, Joint) and p.name == rod.joint)
    turns = floor((float(joint.initial_angle_rad) + float(rod.datum_rad)) / pi)
    angles_rad = turns * pi - float(rod.datum_rad) + np.linspace(0.0, pi, SWEPT)
    places_m = ca.DM(rod.position_m(angles_rad)).full().ravel()
    grows = turns % 2 == 0
    if not grows:
        angles_rad, places_m = angles_rad[::-1], places_m[::-1]
    beyond = NOWHERE if grows else (inf, -inf)
    found = np.interp(ends_m, places_m, angles_rad, left=beyond[0], right=beyond[1])
    return float(found.min()), float(found.max())
