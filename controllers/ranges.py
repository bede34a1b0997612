"""Numbers of a design in ranges of its axis, so that one set serves a slide, a rod and a joint."""

from __future__ import annotations

from dataclasses import dataclass

from controllers.axis import Axis
from controllers.motion import MotionLimits
from controllers.spec import ranged
from linearize.axes import joint_axes, travel_axis
from workbench.plant import Plant


@dataclass(frozen=True, kw_only=True)
class InRanges:
    """Of the wanted motion, in ranges of the axis and seconds.

    Attributes
    ----------
    turn, turn_per_s
        The direction is that of speed + turn_per_s * error, mixed within the speed ``turn``.
    speed, acceleration, jerk
        Above which a reference has jumped.
    """

    turn: float = 0.03
    turn_per_s: float = ranged(20.0)
    speed: float = 10.0
    acceleration: float = 150.0
    jerk: float = 5e3

    def limits(self, wide: float) -> MotionLimits:
        """Those of an axis whose range is so wide."""
        return MotionLimits(
            speed=self.speed * wide, acceleration=self.acceleration * wide, jerk=self.jerk * wide
        )


def ranges_of(plant: Plant) -> list[tuple[Axis, float]]:
    """Every axis of a plant with the width of its range, in units of its position."""
    several = len(plant.commands) > 1
    found = joint_axes(plant) if several else (travel_axis(plant),)
    return [
        (Axis(a.position, a.velocity, a.pressures, a.command), a.ends[1] - a.ends[0]) for a in found
    ]
