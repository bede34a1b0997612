"""Hybrid modes: boxes of operating conditions, each with its own affine model.

Paper 003, Sec. V, reduces its plant to 2 x 2 x 2 = 8 modes: two sides of the piston stroke, two
states for each valve.  :func:`hybrid_modes` does the same for any plant: each signal is cut into
intervals, and every combination of intervals is a mode.

A mode says how friction enters it.  Sliding, the velocity at the point fixes the direction, so
that dry friction is a constant of the drift and only its slope stands in A.  Sticking, position
and velocity are held and leave the model.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from linearize.equilibrium import OperatingPoint, operating_point
from linearize.reduction import DesignModel, design_model
from workbench.plant import Plant

if TYPE_CHECKING:
    import control

Placing = Callable[[DesignModel, Mapping[str, "Interval"]], OperatingPoint]
"""Finds the point of a box."""


@dataclass(frozen=True)
class Interval:
    """Part of a signal's range, and the value inside it where the plant is linearised.

    ``holds`` names states that do not move in it: a slide that sticks has no velocity.
    """

    label: str
    lower: float
    upper: float
    point: float
    holds: tuple[str, ...] = ()


@dataclass(frozen=True)
class Mode:
    """An affine model and the box of conditions it stands for.

    dx/dt = drift + A (x - state) + B (u - command),   y = output + C (x - state) + D (u - command)

    The point need not be an equilibrium; ``drift`` is zero where it is one.  Commands are those
    behind the dead zone.

    Attributes
    ----------
    A, B, C, D
        Shapes (n_x, n_x), (n_x, n_u), (n_y, n_x) and (n_y, n_u), SI units.
    state, command, output, drift
        The point, shapes (n_x,), (n_u,), (n_y,) and (n_x,).
    scale
        Typical size of each state, shape (n_x,).
    """

    name: str
    box: Mapping[str, Interval]
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

    def holds(self, signals: Mapping[str, float]) -> bool:
        """True when every signal lies inside the box."""
        return all(i.lower <= signals[name] < i.upper for name, i in self.box.items())

    @property
    def scaled(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B and C with every state in units of its scale."""
        size = self.scale
        return self.A * size / size[:, None], self.B / size[:, None], self.C * size

    @property
    def system(self) -> control.StateSpace:
        """The linear part with named signals; python-control takes no dot, so it is a colon."""
        import control

        labels = {
            "states": _labels(self.state_names),
            "inputs": _labels(self.command_names),
            "outputs": _labels(self.output_names),
        }
        return control.ss(self.A, self.B, self.C, self.D, name=self.name, **labels)

    def rates(self, state: np.ndarray, command: np.ndarray) -> np.ndarray:
        """dx/dt of the affine model, shape (n_x,)."""
        return self.drift + self.A @ (state - self.state) + self.B @ (command - self.command)


@dataclass(frozen=True)
class HybridModel:
    """A plant as a set of modes of its design model that together cover its operating range."""

    plant: Plant
    model: DesignModel
    modes: tuple[Mode, ...]

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


def at_points(model: DesignModel, box: Mapping[str, Interval]) -> OperatingPoint:
    """Each cut signal at its interval's point, all else at its initial value."""
    return operating_point(model, {name: interval.point for name, interval in box.items()})


def hybrid_modes(
    plant: Plant, cuts: Mapping[str, Iterable[Interval]], placing: Placing = at_points
) -> HybridModel:
    """One mode for every combination of intervals, each linearised where ``placing`` says."""
    model = design_model(plant)
    boxes = (dict(zip(cuts, intervals, strict=True)) for intervals in product(*cuts.values()))
    return HybridModel(
        plant, model, tuple(linearised(model, box, placing(model, box)) for box in boxes)
    )


def linearised(model: DesignModel, box: Mapping[str, Interval], point: OperatingPoint) -> Mode:
    """The mode of a box at a point, by exact Jacobians."""
    A, B, C, D = (block.full() for block in model.jacobians(point.state, point.command))
    output = model.f(point.state, point.command)[1].full().ravel()
    held = {name for interval in box.values() for name in interval.holds}
    kept = [i for i, name in enumerate(model.states) if name not in held]
    return Mode(
        name=" ".join(interval.label for interval in box.values()),
        box=box,
        state_names=tuple(model.states[i] for i in kept),
        command_names=model.commands,
        output_names=model.measured,
        A=A[np.ix_(kept, kept)],
        B=B[kept],
        C=C[:, kept],
        D=D,
        state=point.state[kept],
        command=point.command,
        output=output,
        drift=point.rates[kept],
        scale=model.scale[kept],
    )


def _labels(names: tuple[str, ...]) -> list[str]:
    return [name.replace(".", ":") for name in names]
