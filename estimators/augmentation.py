"""A plant with unknown forces, flows and parameters among its states, for every estimator alike.

    dx/dt = f(x, u, d, p + S w) + E w,     dw/dt = -w / tau   (0 where w wanders)

An unknown w is added to the rate of a state (a force over the mass, a flow as a pressure rate) or
to a parameter.  With a time constant it is first-order coloured noise, of which the deviation is
that of w itself; without one it is a random walk, of which it is that at the start.  What comes out
is a plant, so that Kalman, unscented and moving-horizon estimators need no word about it.

Source: Jazwinski 1970, "Stochastic processes and filtering theory", Sec. 8.4 (state augmentation);
Gelb 1974, "Applied optimal estimation", Sec. 3.8 (shaping filters).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from math import inf, isfinite, sqrt

import casadi as ca
import numpy as np

from workbench.effect import State
from workbench.model import Model
from workbench.plant import Plant, require

PREFIX = "unknown "


@dataclass(frozen=True)
class Unknown:
    """What is added to the rate of a state, or to a parameter, and how fast it changes.

    Attributes
    ----------
    name
        Full name of a state or of a parameter.
    deviation
        Standard deviation, in the unit of the rate or of the parameter.
    time_constant_s
        Of coloured noise; infinite for a random walk.
    per_root_second
        What a random walk gains per square root of a second; coloured noise has its own.
    """

    name: str
    deviation: float
    time_constant_s: float = inf
    per_root_second: float = 0.0

    def __post_init__(self) -> None:
        if not (self.deviation > 0.0 and self.time_constant_s > 0.0):
            raise ValueError(f"unknown {self.name}: deviation and time constant above zero needed")

    @property
    def state(self) -> str:
        """Its name among the states."""
        return PREFIX + self.name

    @property
    def noise(self) -> float:
        """Standard deviation that it gains per square root of a second."""
        if isfinite(self.time_constant_s):
            return self.deviation * sqrt(2.0 / self.time_constant_s)
        return self.per_root_second


@dataclass(frozen=True, kw_only=True)
class AugmentedPlant(Plant):
    """A plant with ``unknown`` values behind its own states; see the module."""

    unknown: tuple[Unknown, ...]

    @property
    def state_list(self) -> dict[str, State]:
        """The plant's own states, then the unknown values, which start at zero."""
        more = {u.state: State(u.state, 0.0, u.deviation) for u in self.unknown}
        return super().state_list | more

    @property
    def process_noise(self) -> dict[str, float]:
        """What the unknown values gain per square root of a second, by state."""
        return {u.state: u.noise for u in self.unknown}

    @cached_property
    def model(self) -> Model:
        """The plant's model with the unknown values as states.

        ``quantities`` of it, which set the start, hold the parameters without what is unknown.
        """
        base = Plant(**{f.name: getattr(self, f.name) for f in fields(Plant)}).model
        x, u, d, p = base.symbols
        w = ca.SX.sym("w", len(self.unknown))
        S, E = (ca.DM(_entering(names, self.unknown)) for names in (base.parameters, base.states))
        rates, outputs = (ca.substitute(e, p, p + S @ w) for e in (base.rates, base.outputs))
        fading = ca.DM([-1.0 / each.time_constant_s for each in self.unknown])
        return replace(
            base,
            states=(*base.states, *(each.state for each in self.unknown)),
            symbols=(ca.vertcat(x, w), u, d, p),
            rates=ca.vertcat(rates + E @ w, fading * w),
            outputs=outputs,
            tolerances=np.append(base.tolerances, np.full(len(self.unknown), inf)),
        )


def augmented(plant: Plant, unknown: Iterable[Unknown]) -> AugmentedPlant:
    """The plant with these values unknown.

    Raises
    ------
    UnknownNameError
        If a name is neither a state nor a parameter of the plant.
    """
    several = tuple(unknown)
    known = (*plant.model.states, *plant.model.parameters)
    require((each.name for each in several), known, plant.name)
    own = {f.name: getattr(plant, f.name) for f in fields(Plant)}
    return AugmentedPlant(**own, unknown=several)


def _entering(names: tuple[str, ...], unknown: tuple[Unknown, ...]) -> np.ndarray:
    """1 where an unknown value adds to what is named, shape (n, n_w)."""
    rows = [[float(name == each.name) for each in unknown] for name in names]
    return np.array(rows).reshape(len(names), len(unknown))
