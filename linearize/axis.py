"""What moves, and the cylinder that drives it: how its range is cut, and where its modes lie.

All values are in the units of the signals that are named: m or rad, m/s or rad/s, V.

Source: physics.md 4.3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from linearize.cuts import Box, Interval
from linearize.equilibrium import OperatingPoint, operating_point
from linearize.reduction import DesignModel

BESIDE = 0.1  # of the half-width of the middle interval of a command


@dataclass(frozen=True, kw_only=True)
class Travel:
    """What moves between two stops against dry friction, by the names of its signals.

    position, velocity    states of what moves: a slide, a rod, a joint, a piston
    resting, sliding      speed below which it sticks, and speed at the points of sliding modes
    ends                  of its range, where the stops are
    prefix                tells the labels of several apart
    """

    position: str
    velocity: str
    resting: float
    sliding: float
    ends: tuple[float, float]
    prefix: str = ""

    def friction_cut(self) -> tuple[Interval, ...]:
        """Sliding down, sticking, which holds position and velocity, and sliding up."""
        rest, held = self.resting, (self.position, self.velocity)
        return (
            Interval(self.prefix + "slide -", -inf, -rest, -self.sliding),
            Interval(self.prefix + "stick", -rest, rest, 0.0, held),
            Interval(self.prefix + "slide +", rest, inf, self.sliding),
        )


@dataclass(frozen=True, kw_only=True)
class Axis(Travel):
    """A travel driven by a cylinder behind a proportional valve.

    pressures             of the chamber that drives it up, then of the one that drives it down
    command               of its valve, behind the dead zone
    centre                command at which the valve stands at its centre
    middle, opening       half-width of the middle interval of the command; from the centre to the
                          points of the outer ones
    valves                labels of the command below, at and above the centre
    places                labels of equal parts of the range
    shut                  True where the valve shuts at its centre, but for a leak
    """

    pressures: tuple[str, str]
    command: str
    centre: float
    middle: float
    opening: float
    valves: tuple[str, str, str]
    places: tuple[str, ...]
    shut: bool = False

    def valve_cut(self) -> tuple[Interval, ...]:
        """The command below, at and above the valve's centre.

        A valve that does not shut has a corner at its very centre: the point lies beside it.
        """
        low, high = self.centre - self.middle, self.centre + self.middle
        edges = (-inf, low, high, inf)
        middle = self.centre + (0.0 if self.shut else BESIDE * self.middle)
        points = (self.centre - self.opening, middle, self.centre + self.opening)
        return self._cut(self.valves, edges, points)

    def place_cut(self) -> tuple[Interval, ...]:
        """Equal parts of the range, with their points in the middle."""
        steps = [float(place) for place in np.linspace(*self.ends, 2 * len(self.places) + 1)]
        return self._cut(self.places, (-inf, *steps[2:-1:2], inf), steps[1::2])

    def _cut(
        self, labels: Sequence[str], edges: Sequence[float], points: Sequence[float]
    ) -> tuple[Interval, ...]:
        parts = zip(labels, edges, edges[1:], points, strict=False)
        return tuple(Interval(self.prefix + label, *rest) for label, *rest in parts)

    def point(self, model: DesignModel, box: Box) -> OperatingPoint:
        """Steady sliding in the direction of the box, or rest.

        Where that is not in the box, as when the valve drives against the motion, there is no
        steady state: what the box cuts is at its points, all else as in the steady state, and the
        drift says how far from rest that is.
        """
        points = {name: region.point for name, region in box.items()}
        found = self.steady(model, points)
        if lies_in(model, box, found):
            return found
        at = dict(
            zip((*model.states, *model.commands), (*found.state, *found.command), strict=True)
        )
        return operating_point(model, at | points)

    def steady(self, model: DesignModel, points: Mapping[str, float]) -> OperatingPoint:
        """The steady slide at the speed of the points, or rest where that is zero.

        At rest the pressures carry the load without friction; behind a valve that shuts they are
        those that its leak leaves.
        """
        given = {name: points[name] for name in (self.position, self.velocity) if name in points}
        if self.shut and not given.setdefault(self.velocity, 0.0):
            given[self.command] = self.centre
            return operating_point(model, given, self.pressures, self.pressures)
        return operating_point(model, given, *self.balanced)

    @property
    def balanced(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """What is free, and whose rates vanish, in a steady slide or at rest."""
        return (self.command, *self.pressures), (self.velocity, *self.pressures)


def lies_in(model: DesignModel, box: Box, point: OperatingPoint) -> bool:
    """True where every cut signal is in its region at the point."""
    values = (*point.state, *point.command)
    at = dict(zip((*model.states, *model.commands), values, strict=True))
    return all(region.contains(at[name]) for name, region in box.items())
