"""One design per mode, and which of them count: by direction of motion and place on the stroke.

Between the points of two neighbouring modes their designs are mixed linearly, and between the two
directions by how clearly the slide is to move: so nothing jumps when the mode changes.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import starmap
from typing import Generic, TypeVar

import numpy as np

from controllers.axis import Axis, axis_of
from linearize.analysis import require_controllable
from linearize.modes import HybridModel, Mode
from linearize.reduction import closed_command

Design = TypeVar("Design")
Other = TypeVar("Other")


@dataclass(frozen=True)
class Schedule(Generic[Design]):
    """Designs on the modes in which the valve drives the motion.

    Attributes
    ----------
    positions_m
        Points of the modes along the stroke, rising, shape (n,).
    forward, backward
        One design per point, for motion towards larger and smaller positions.
    """

    positions_m: np.ndarray
    forward: tuple[Design, ...]
    backward: tuple[Design, ...]

    @cached_property
    def _places(self) -> list[float]:
        """Those of the points, as bisection reads them fastest."""
        return self.positions_m.tolist()

    def _between(self, position_m: float) -> tuple[int, int, float]:
        """The points to the left and right, and the share of the right one."""
        places, last = self._places, len(self.positions_m) - 1
        if last == 0:
            return 0, 0, 0.0
        left = min(max(bisect_right(places, position_m) - 1, 0), last - 1)
        share = (position_m - places[left]) / (places[left + 1] - places[left])
        return left, left + 1, min(max(share, 0.0), 1.0)

    def weighted(self, position_m: float, ahead: float) -> list[tuple[float, Design]]:
        """Designs that count here with their weights; ``ahead`` is 1 forward, 0 backward."""
        left, right, right_share = self._between(position_m)
        counting = []
        for share, designs in ((ahead, self.forward), (1.0 - ahead, self.backward)):
            if share > 0.0:
                counting.append((share * (1.0 - right_share), designs[left]))
                counting.append((share * right_share, designs[right]))
        return counting

    def mapped(self, change: Callable[[Design], Other]) -> Schedule[Other]:
        """The same schedule of what is made of each design."""
        sides = (tuple(map(change, side)) for side in (self.forward, self.backward))
        return Schedule(self.positions_m, *sides)

    def heaviest(self, position_m: float, ahead: float) -> Design:
        """The design with the largest weight, for what cannot be mixed."""
        left, right, right_share = self._between(position_m)
        designs = self.forward if ahead >= 0.5 else self.backward
        return designs[right if right_share > 0.5 else left]


def constant(design: Design) -> Schedule[Design]:
    """One design everywhere."""
    return Schedule(np.zeros(1), (design,), (design,))


def driven_modes(hybrid: HybridModel, axis: Axis | None = None) -> tuple[list[Mode], list[Mode]]:
    """Modes whose valve drives the motion, forward and backward, by rising position.

    Where the command is not cut, that is every mode in which the axis moves; the plant's only axis
    unless one is given.
    """
    axis, sides = axis or axis_of(hybrid.plant), ([], [])
    for mode in hybrid.modes:
        if axis.velocity not in mode.box:
            continue
        speed = mode.box[axis.velocity].point
        drive = speed
        if axis.command in mode.box:
            drive = mode.box[axis.command].point - closed_command(hybrid.plant, axis.command)
        if speed * drive > 0.0:
            sides[speed < 0.0].append(mode)
    return tuple(sorted(side, key=lambda mode: mode.box[axis.position].point) for side in sides)


def with_modes(
    hybrid: HybridModel,
    designs: Schedule[Design],
    change: Callable[[Mode, Design], Other],
    axis: Axis | None = None,
) -> Schedule[Other]:
    """The schedule of what is made of each driven mode and its design."""
    pairs = zip(driven_modes(hybrid, axis), (designs.forward, designs.backward), strict=True)
    sides = (tuple(starmap(change, zip(modes, side, strict=True))) for modes, side in pairs)
    return Schedule(designs.positions_m, *sides)


def scheduled(
    hybrid: HybridModel, design: Callable[[Mode], Design], axis: Axis | None = None
) -> Schedule[Design]:
    """The same design method on every driven mode of the plant's only axis, or of this one.

    Raises
    ------
    InputError
        If the command cannot steer one of them.
    """
    axis = axis or axis_of(hybrid.plant)
    forward, backward = driven_modes(hybrid, axis)
    for mode in (*forward, *backward):
        require_controllable(mode)
    points = np.array([mode.box[axis.position].point for mode in forward])
    return Schedule(points, tuple(map(design, forward)), tuple(map(design, backward)))
