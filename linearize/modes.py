"""Hybrid modes: boxes of operating conditions, each with its own affine model.

Paper 003, Sec. V, reduces its plant to 2 x 2 x 2 = 8 modes: two sides of the piston stroke, two
states for each valve.  :func:`hybrid_modes` does the same for any plant: each signal is cut into
intervals, a switched command into its levels, and every combination of them is a mode.

A mode says how friction enters it.  Sliding, the velocity at the point fixes the direction, so
that dry friction is a constant of the drift and only its slope stands in A.  Sticking, position
and velocity are held and leave the model.

Source: paper 003, Sec. V, with the errata E003-2 to E003-4: A = df/dx at (x0, u0), drift kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from linearize.cuts import Box, Guard, Interval, Jump, Level, Region, checked
from linearize.equilibrium import OperatingPoint, operating_point
from linearize.reduction import DesignModel, LeftOut, design_model
from workbench.errors import InputError, Message
from workbench.plant import Plant

if TYPE_CHECKING:
    import control

__all__ = ["Guard", "HybridModel", "Interval", "Level", "Mode", "hybrid_modes"]

Placing = Callable[[DesignModel, Box], OperatingPoint]
"""Finds the point of a box."""


@dataclass(frozen=True)
class Mode:
    """An affine model and the box of conditions it stands for.

    dx/dt = drift + A (x - state) + B (u - command),   y = output + C (x - state) + D (u - command)

    The point need not be an equilibrium; ``drift`` is zero where it is one.  Commands are those
    behind the dead zone; a switched one is no input, since its level belongs to the box.

    Attributes
    ----------
    A, B, C, D
        Shapes (n_x, n_x), (n_x, n_u), (n_y, n_x) and (n_y, n_u), SI units.
    state, command, output, drift
        The point, shapes (n_x,), (n_u,), (n_y,) and (n_x,).
    scale
        Typical size of each state, shape (n_x,).
    guards, elsewhere
        What must hold besides the box; values at the point of what is left out, where not initial.
    """

    name: str
    box: Box
    state_names: tuple[str, ...]
    command_names: tuple[str, ...]
    output_names: tuple[str, ...]
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    state: np.ndarray
    command: np.ndarray
    output: np.ndarray
    drift: np.ndarray
    scale: np.ndarray
    guards: tuple[Guard, ...] = ()
    elsewhere: Mapping[str, float] = field(default_factory=dict)

    def holds(self, signals: Mapping[str, float]) -> bool:
        """True when every signal lies inside the box, and every guard holds."""
        inside = all(region.contains(signals[name]) for name, region in self.box.items())
        return inside and all(guard.holds(signals) for guard in self.guards)

    @property
    def scaled(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B and C, shapes as above, with every state in units of its scale."""
        size = self.scale
        return self.A * size / size[:, None], self.B / size[:, None], self.C * size

    @property
    def system(self) -> control.StateSpace:
        """The linear part in SI units with named signals; each dot of a name is a colon."""
        import control

        labels = {
            "states": _labels(self.state_names),
            "inputs": _labels(self.command_names),
            "outputs": _labels(self.output_names),
        }
        return control.ss(self.A, self.B, self.C, self.D, name=self.name, **labels)

    def sent(self, model: DesignModel, command: np.ndarray) -> np.ndarray:
        """All commands of the model, (n_u,): the mode's own, and switches at their level."""
        own = {**self.elsewhere, **dict(zip(self.command_names, command, strict=True))}
        return np.array([own[n] if n in own else self.box[n].point for n in model.commands])

    def rates(self, state: np.ndarray, command: np.ndarray) -> np.ndarray:
        """dx/dt of the affine model, shape (n_x,)."""
        return self.drift + self.A @ (state - self.state) + self.B @ (command - self.command)


@dataclass(frozen=True)
class HybridModel:
    """A plant as a set of modes of its design model that together cover its operating range.

    Where several modes hold, the first of them is the active one.  ``no_modes`` are combinations of
    regions that are none, with what takes their place and why; ``jumps`` what a change of modes
    does to the state at once.
    """

    plant: Plant
    model: DesignModel
    modes: tuple[Mode, ...]
    no_modes: tuple[LeftOut, ...] = ()
    jumps: tuple[Jump, ...] = ()

    def __getitem__(self, name: str) -> Mode:
        for mode in self.modes:
            if mode.name == name:
                return mode
        names = ", ".join(mode.name for mode in self.modes)
        raise KeyError(f"{self.model.plant.name} has no mode {name!r}; it has {names}")

    def active(self, signals: Mapping[str, float]) -> Mode:
        """The mode whose box contains the signals.

        Raises
        ------
        LookupError
            If no box does.
        """
        for mode in self.modes:
            if mode.holds(signals):
                return mode
        raise LookupError(f"no mode of {self.model.plant.name} covers {dict(signals)}")


def at_points(model: DesignModel, box: Box) -> OperatingPoint:
    """Each cut signal at its interval's point, all else at its initial value."""
    return operating_point(model, {name: region.point for name, region in box.items()})


def placed_at(values: Mapping[str, float]) -> Placing:
    """Each cut signal at its interval's point, these at the values given, all else initial."""

    def placed(model: DesignModel, box: Box) -> OperatingPoint:
        return operating_point(model, {**values, **{name: r.point for name, r in box.items()}})

    return placed


def hybrid_modes(
    plant: Plant,
    cuts: Mapping[str, Iterable[Region]],
    placing: Placing = at_points,
    model: DesignModel | None = None,
) -> HybridModel:
    """One mode for every combination of intervals and levels.

    Each is linearised where ``placing`` says, with the derivatives of the plant's one model.

    Parameters
    ----------
    plant
        The plant that the modes are to stand for.
    cuts
        Intervals of a state or a continuous command, levels of a switched one, by signal.
    placing
        Gives the operating point of a box; it need not be an equilibrium.
    model
        The reduction of the plant that is linearised; :func:`design_model` of it by default.

    Raises
    ------
    InputError
        If a signal is unknown, an interval is empty, intervals of a signal leave a gap or overlap,
        a point lies outside its interval, or a switch lacks a level.
    """
    model = model or design_model(plant)
    regions = checked(model, cuts)
    boxes = [dict(zip(regions, taken, strict=True)) for taken in product(*regions.values())]
    points = [placing(model, box) for box in boxes]
    return HybridModel(plant, model, linearised_all(model, boxes, points))


def linearised(model: DesignModel, box: Box, point: OperatingPoint) -> Mode:
    """The mode of a box at a point, by exact Jacobians."""
    return linearised_all(model, [box], [point])[0]


def linearised_all(
    model: DesignModel, boxes: Sequence[Box], points: Sequence[OperatingPoint]
) -> tuple[Mode, ...]:
    """The modes of boxes at their points; all Jacobians come from one call.

    Raises
    ------
    InputError
        If a point lies outside its box, or the plant has no finite derivative there.
    """
    made: dict[int, Mode] = {}
    for held, places in _by_held(model, boxes).items():
        taken = ([boxes[k] for k in places], [points[k] for k in places])
        made |= zip(places, _linearised(model.holding(held), *taken), strict=True)
    return tuple(made[k] for k in range(len(boxes)))


def _by_held(model: DesignModel, boxes: Sequence[Box]) -> dict[tuple[str, ...], list[int]]:
    """Places of the boxes by the velocities held in them that others feel; one group for most."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for k, box in enumerate(boxes):
        held = [name for region in box.values() for name in region.holds]
        groups.setdefault(model.holding(held).held, []).append(k)
    return groups


def _linearised(
    model: DesignModel, boxes: Sequence[Box], points: Sequence[OperatingPoint]
) -> Iterator[Mode]:
    states = np.column_stack([point.state for point in points])
    commands = np.column_stack([point.command for point in points])
    found = [block.full() for block in (*model.jacobians(states, commands),)]
    # not the rates of the points: what a box holds there is still free in those
    rates, outputs = (value.full().T for value in model.f(states, commands))
    blocks = zip(*(np.split(block, len(boxes), axis=1) for block in found), strict=True)
    for each in zip(boxes, points, blocks, rates, outputs, strict=True):
        yield _mode(model, *each)


def _mode(
    model: DesignModel,
    box: Box,
    point: OperatingPoint,
    blocks: tuple[np.ndarray, ...],
    rates: np.ndarray,
    output: np.ndarray,
) -> Mode:
    name = " ".join(region.label for region in box.values())
    _require_inside(model, name, box, point, blocks)
    held = {state for region in box.values() for state in region.holds}
    kept = [i for i, state in enumerate(model.states) if state not in held]
    driven = [i for i, c in enumerate(model.commands) if not isinstance(box.get(c), Level)]
    A, B, C, D = blocks
    return Mode(
        name=name,
        box=box,
        state_names=tuple(model.states[i] for i in kept),
        command_names=tuple(model.commands[i] for i in driven),
        output_names=model.measured,
        A=A[np.ix_(kept, kept)],
        B=B[np.ix_(kept, driven)],
        C=C[:, kept],
        D=D[:, driven],
        state=point.state[kept],
        command=point.command[driven],
        output=output,
        drift=rates[kept],
        scale=model.scale[kept],
    )


def _require_inside(
    model: DesignModel,
    name: str,
    box: Box,
    point: OperatingPoint,
    blocks: tuple[np.ndarray, ...],
) -> None:
    values = (*point.state, *point.command)
    at = dict(zip((*model.states, *model.commands), values, strict=True))
    wrong = [
        Message(
            f"the point of mode '{name}' is at {at[signal]:g}, outside '{region.label}'", signal
        )
        for signal, region in box.items()
        if not region.contains(at[signal])
    ]
    if not all(np.isfinite(block).all() for block in blocks):
        wrong.append(Message("the plant has no finite derivative at the point", f"mode '{name}'"))
    if wrong:
        raise InputError(*wrong)


def _labels(names: tuple[str, ...]) -> list[str]:
    return [name.replace(".", ":") for name in names]
