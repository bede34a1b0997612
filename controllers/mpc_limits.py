"""What the openings of linear and nonlinear MPC must keep, and how a program reads it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from controllers.mpc_spec import MpcSpec
from controllers.positioning import STATES
from linearize.axes import stroke_m
from linearize.standard import SUPPLY
from workbench.errors import InputError, Message, listed
from workbench.plant import Plant

SLACK_UNIT = np.array([1e-3, 0.1, 1e4, 1e4])  # m, m/s, Pa, Pa: violations that cost alike
SLACKS = len(STATES) + 1  # one per state, and one for the rate of the opening, in V per sample


@dataclass(frozen=True)
class Limits:
    """Of N openings hard, of their changes and of the stacked states softly.

    states      lower and upper over the horizon, shape (2, 4 N)
    openings    smallest and largest opening
    move_v      largest change of the opening from sample to sample
    """

    states: np.ndarray
    openings: tuple[float, float]
    move_v: float

    @property
    def horizon(self) -> int:
        return self.states.shape[1] // len(STATES)

    @cached_property
    def within(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest openings, stacked states and moves, shapes (6 N,)."""
        n, (low, high) = self.horizon, self.states
        first, last = (np.full(n, side) for side in self.openings)
        moved = np.full(n, self.move_v)
        return np.concatenate([first, low, -moved]), np.concatenate([last, high, moved])

    def kept(self, at: np.ndarray) -> bool:
        """Whether openings, stacked states and moves (6 N,) are all within; not finite, no."""
        low, high = self.within
        return bool(((at >= low) & (at <= high)).all())

    def bounds(self, unforced: np.ndarray, last_v: float) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper side of the rows of a program: openings, what is soft twice, slacks.

        For stacked states (4 N,) under zero openings, and the last opening.
        """
        n, (lower, upper) = self.horizon, (side.copy() for side in self.sides)
        at = (unforced.reshape(n, -1) / SLACK_UNIT).ravel()
        soft = len(at) + n
        lower[n : n + len(at)] -= at
        upper[n + soft : n + soft + len(at)] -= at
        lower[n + len(at)] += last_v
        upper[n + soft + len(at)] += last_v
        return lower, upper

    @cached_property
    def sides(self) -> tuple[np.ndarray, np.ndarray]:
        """What :meth:`bounds` gives for states and a last opening of zero."""
        n, unit = self.horizon, np.ones(len(self.within[0]))
        unit[n:-n] = np.tile(SLACK_UNIT, n)
        low, high = (side / unit for side in self.within)
        none, slack = np.full(len(low) - n, np.inf), np.zeros(SLACKS)
        upper = [high[:n], none, high[n:], slack + np.inf]
        return np.concatenate([low, -none, slack]), np.concatenate(upper)


def soft_rows(N: int) -> tuple[slice, slice]:
    """Rows of what is soft below and above: the states of all samples, then the N moves."""
    below, above, end = (N * (1 + side * SLACKS) for side in range(3))
    return slice(below, above), slice(above, end)


def state_limits(plant: Plant, spec: MpcSpec, method: str = "mpc") -> np.ndarray:
    """Lowest and highest position, velocity and pressures, shape (2, 4).

    ``method`` is the controller whose numbers they are.

    Raises
    ------
    InputError
        If nothing is left between them.
    """
    low, high = ends = state_ends(plant, spec)
    if wrong := [*_numbers_without_room(spec, plant, method, np.less(low, high))]:
        raise InputError(*wrong)
    return ends


def state_ends(plant: Plant, spec: MpcSpec) -> np.ndarray:
    """As :func:`state_limits`, also where nothing is left between them."""
    highest_pa = float(plant.values[SUPPLY]) - spec.below_supply_pa
    lowest_m, below_m = (max(spec.margin_m, each) for each in (spec.lowest_m, spec.below_end_m))
    low = [lowest_m, -spec.fastest_m_s, spec.lowest_pa, spec.lowest_pa]
    high = [stroke_m(plant) - below_m, spec.fastest_m_s, highest_pa, highest_pa]
    return np.array([low, high])


def _numbers_without_room(
    spec: MpcSpec, plant: Plant, method: str, roomy: np.ndarray
) -> Iterator[Message]:
    """The numbers between which nothing is left, of the states that are not ``roomy``, (4,)."""
    position, _, *pressures = roomy
    kept = (
        (position, ("margin_m", "lowest_m", "below_end_m"), "the stroke"),
        (all(pressures), ("lowest_pa", "below_supply_pa"), "the supply pressure"),
    )
    for room, names, whole in kept:
        if not room:
            what = listed([f"{name} {getattr(spec, name):g}" for name in names])
            expected = f"less than {whole} between them"
            yield Message(f"{what} leave no room on {plant.name}", method, expected)
