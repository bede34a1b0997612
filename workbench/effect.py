"""What a physical effect is: named parameters, and the flows it puts into the balances.

A pneumatic actuator is a set of balances: the gas in each chamber, the momentum of each body.
An effect puts a flow into one of them, or alters a named signal.  No effect knows which others are
present; flows simply add.  That is what makes them composable.

Parameters come in two kinds.

strength    Has a null value, which is also its default: every effect is born absent.  With all
            strengths at null the effect contributes exactly nothing.
form        Has a typical value.  It says what the effect looks like once it is present.

A parameter holds a float or a CasADi symbol: each equation is written once, and simulation,
linearisation, MPC, MHE and fitting all read it.

What a strength *means* to a person who looks for what a model lacks is a :class:`Cause`: its name,
the balance it enters, the variables that reveal it and the sizes worth trying.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from enum import Enum
from functools import cache
from math import inf, isfinite
from typing import TYPE_CHECKING, Any, ClassVar

import casadi as ca
import numpy as np

from workbench.conditions import Conditions

if TYPE_CHECKING:
    from workbench.balances import BalanceEquation

Expression = float | ca.SX


@dataclass(frozen=True)
class Term:
    """One flow into the balance of one part."""

    balance: str
    value: Expression


class Force(Term):
    """A force on a body in N, positive towards growing position."""


class Torque(Term):
    """A torque on a joint in N m, positive towards growing angle."""


class HeatFlow(Term):
    """Heat entering the gas of a chamber, in W."""


class AddedMass(Term):
    """Mass that moves along with a body, in kg."""


@dataclass(frozen=True)
class MassFlow(Term):
    """Gas entering a balance, in kg/s, with the temperature it brings along.

    ``choked_share`` is psi(p_d/p_u) of its path, 1 where it is choked; none where there is no path.
    """

    temperature_k: Expression
    choked_share: Expression | None = None


Received = Callable[[str], list[Term]]  # the terms that a balance received, by its name


@dataclass(frozen=True)
class State:
    """A state a part or an effect brings with it; ``scale`` is a typical size for the solvers.

    ``tolerance`` is the error of one step that the integrator lets pass, in the state's unit; none
    where an error shows in other states as soon as it matters.
    """

    quantity: str
    initial: Expression
    scale: float
    tolerance: float = inf


@dataclass(frozen=True)
class Parameter:
    """What is known of a parameter besides its value.

    ``relative_deviation`` and ``deviation`` give one standard deviation, as a share of the value
    and in the parameter's unit; with neither, the value is known (geometry from a drawing).
    """

    null: float | None
    typical: float
    lower: float
    upper: float
    relative_deviation: float = 0.0
    deviation: float = 0.0

    def standard_deviation(self, value: float) -> float:
        """One standard deviation at this value, 0 where the value is known."""
        return self.deviation or self.relative_deviation * abs(value)

    @property
    def signed(self) -> bool:
        """True when the parameter may lie on either side of its null."""
        return self.null is not None and self.lower < self.null


class Balance(Enum):
    """The equation a cause enters."""

    VALVE = "valve"
    FLOW = "flow"
    MASS = "mass"
    ENERGY = "energy"
    MOMENTUM = "momentum"
    SUPPLY = "supply"
    SENSOR = "sensor"
    TIMING = "timing"


class Kind(Enum):
    """How a cause is scored."""

    EFFECT = "effect"  # a term that the model lacks
    PARAMETER = "parameter"  # a shift of a parameter that the prior fit may move (``held``)


ONE_SIDED = (0.03, 0.1, 0.3, 0.8)


@dataclass(frozen=True, kw_only=True)
class Cause:
    """One cause under its public name: one strength, and what belongs to it.

    name        public name, without place
    strength    field that makes it vanish
    forms       fields that are fitted once the strength is
    balance     the equation it enters
    drivers     quantities that reveal it, for people: ``velocity``, ``pressure difference``
    kinked      the derivative at the null is not to be trusted: slopes are tested by secants
    kind, held  a shift of the fitted field ``held`` is scored with that field at its prior
    sizes       shares of the typical strength that the scan tries (both signs where signed)
    shapes      values of form fields to scan, by field
    needs       field that must not be at its null for this cause to be one: static friction is
                counted over Coulomb's, and means nothing without it
    tolerated   (standard deviation, largest size) of what is always there and never worth a name:
                a fit may use that much of the strength as a nuisance
    shown_by    the recording that shows it
    source      paper and equation, or book
    """

    name: str
    strength: str
    balance: Balance
    drivers: tuple[str, ...]
    shown_by: str
    source: str
    forms: tuple[str, ...] = ()
    kinked: bool = False
    kind: Kind = Kind.EFFECT
    held: str | None = None
    sizes: tuple[float, ...] = ONE_SIDED
    shapes: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    needs: str | None = None
    tolerated: tuple[float, float] | None = None


def strength(
    *,
    typical: float,
    null: float = 0.0,
    lower: float = 0.0,
    upper: float = inf,
    relative_deviation: float = 0.05,
    deviation: float = 0.0,
) -> Any:
    """A parameter whose null value makes its cause disappear."""
    known = Parameter(null, typical, lower, upper, relative_deviation, deviation)
    return field(default=null, metadata={"parameter": known})


def form(
    typical: float,
    *,
    lower: float = 0.0,
    upper: float = inf,
    relative_deviation: float = 0.0,
    deviation: float = 0.0,
) -> Any:
    """A parameter that matters only once the cause is present."""
    known = Parameter(None, typical, lower, upper, relative_deviation, deviation)
    return field(default=typical, metadata={"parameter": known})


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Base of all effects.  Override only the hooks the physics needs."""

    causes: ClassVar[tuple[Cause, ...]] = ()

    name: str

    def __post_init__(self) -> None:
        for key, known in self.parameters().items():
            value = getattr(self, key)
            if not isinstance(value, int | float):
                continue
            if not (isfinite(value) and known.lower <= value <= known.upper):
                raise ValueError(
                    f"{self.name}.{key} is {value:g}, outside [{known.lower:g}, {known.upper:g}]"
                )

    @classmethod
    @cache  # asked for some hundred thousand times in a diagnosis
    def parameters(cls) -> dict[str, Parameter]:
        """All parameters by field name, strengths and forms."""
        return {f.name: f.metadata["parameter"] for f in fields(cls) if "parameter" in f.metadata}

    @property
    def place(self) -> str | None:
        """Where the effect sits, the part of its name behind ``@``."""
        return self.name.partition("@")[2] or None

    @property
    def absent(self) -> bool:
        """True when the effect has strengths and every one is at its null value."""
        nulls = {k: v.null for k, v in self.parameters().items() if v.null is not None}
        held = ((getattr(self, k), null) for k, null in nulls.items())
        return bool(nulls) and all(isinstance(v, int | float) and v == null for v, null in held)

    def reduced(self) -> Effect:
        """The same effect without what is absent in it, where that spares it a state."""
        return self

    def shapes_of(self, cause: Cause) -> Mapping[str, tuple[float, ...]]:
        """Values of form fields to scan, by field: those of the cause that are something here."""
        return cause.shapes

    def states(self) -> Iterable[State]:
        """States this effect adds, for example a bristle deflection or a valve lag."""
        return ()

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        """Change a command or source on its way in, or a measurement on its way out."""
        return value

    def terms(self, now: Conditions) -> Iterable[Term]:
        """Flows this effect puts into the balances."""
        return ()

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        """Time derivative of each own state, in SI units per second."""
        return {}

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        """Own states from what was recorded: value at every sample and its standard deviation.

        ``seen`` holds recorded channels and estimates of earlier members, each of shape (n,).  A
        state that is not named here starts at its initial value, give or take its scale.
        """
        return {}

    def resample(self, channel: str, values: np.ndarray, sample_time_s: float) -> np.ndarray:
        """The sampled command sequence as this effect hands it on, shape (n,): delay, pause."""
        return values


class Part(Effect):
    """A part owns balances: it collects the flows that others put in."""

    balances: ClassVar[tuple[BalanceEquation, ...]] = ()

    def derive(self, now: Conditions) -> dict[str, Expression]:
        """Quantities that follow from the states at once, for example a volume."""
        return {}

    def close(self, now: Conditions, received: Received) -> dict[str, Expression]:
        """Quantities that follow from what was received, for example a held rod's force."""
        return {}
