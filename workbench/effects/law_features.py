"""What the terms of an empirical law are made of: functions of scaled quantities, alone or two.

Everything is counted in sizes of the recordings, so that a coefficient is a force in N, or a flow
in kg/s, where the recordings reached: v in the largest speed, s = -1 to 1 over the stroke (sines
and cosines of its whole, half and double length), a difference of two pressures in the largest one,
one above ambient in the largest absolute one, and a command as a share of its range to either side.

Source: diagnosis.md 1.9.  Its rate of the command is not among them: it needs a state of its own,
and is what the catalogue knows as lag and delay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import casadi as ca

from workbench.effect import Expression

ROUND = 1e-3  # where a size turns smoothly, and of a speed where its sign does


def size_of(value: Expression, rounding: float) -> Expression:
    """|value|, with a derivative everywhere."""
    return (value**2 + rounding**2) ** 0.5


@dataclass(frozen=True)
class Here:
    """Scaled quantities at one place and instant."""

    speed: Expression = 0.0
    place: Expression = 0.0
    pressure: Expression = 0.0
    command: Expression = 0.0


def _wave(waves: float, cosine: bool) -> Callable[[Here], Expression]:
    function = ca.cos if cosine else ca.sin
    return lambda here: function(ca.pi * waves * here.place)


_FUNCTIONS: dict[str, Callable[[Here], Expression]] = {
    "v": lambda here: here.speed,
    "|v|": lambda here: size_of(here.speed, ROUND),
    "sign v": lambda here: here.speed / size_of(here.speed, 10.0 * ROUND),
    "v^2": lambda here: here.speed**2,
    "x": lambda here: here.place,
    "sin(pi x/L)": _wave(0.5, False),
    "cos(pi x/L)": _wave(0.5, True),
    "sin(2 pi x/L)": _wave(1.0, False),
    "cos(2 pi x/L)": _wave(1.0, True),
    "sin(4 pi x/L)": _wave(2.0, False),
    "cos(4 pi x/L)": _wave(2.0, True),
    "dp": lambda here: here.pressure,
    "p": lambda here: here.pressure,
    "u": lambda here: here.command,
    "|u|": lambda here: size_of(here.command, ROUND),
}


class Factor(Enum):
    """A function of one scaled quantity, by how it is written."""

    SPEED = "v"
    SPEED_SIZE = "|v|"
    SPEED_SIGN = "sign v"
    SPEED_SQUARE = "v^2"
    PLACE = "x"
    SINE_HALF = "sin(pi x/L)"
    COSINE_HALF = "cos(pi x/L)"
    SINE = "sin(2 pi x/L)"
    COSINE = "cos(2 pi x/L)"
    SINE_TWICE = "sin(4 pi x/L)"
    COSINE_TWICE = "cos(4 pi x/L)"
    DIFFERENCE = "dp"
    PRESSURE = "p"
    COMMAND = "u"
    COMMAND_SIZE = "|u|"

    def of(self, here: Here) -> Expression:
        """Its value under these conditions."""
        return _FUNCTIONS[self.value](here)


Feature = tuple[Factor, ...]  # none, one, or the product of two
_SIZES = (  # forms of a law that a factor is counted in, by what stands in how it is written
    ("v", ("speed_m_s",)),
    ("x", ("middle_m", "stroke_m")),
    ("p", ("pressure_pa",)),
)


def written(feature: Feature) -> str:
    """A feature as a law writes it: ``v sign v``; ``1`` where it is constant."""
    return " ".join(factor.value for factor in feature) or "1"


def counted_in(feature: Feature) -> tuple[str, ...]:
    """Names of the forms that a feature is counted in."""
    letters = {letter for factor in feature for letter in factor.value.replace("pi", "")}
    return tuple(form for letter, forms in _SIZES if letter in letters for form in forms)


def product(feature: Feature, here: Here) -> Expression:
    """The value of a feature."""
    value: Expression = 1.0
    for factor in feature:
        value = value * factor.of(here)
    return value


_WAVES = (
    Factor.SINE_HALF, Factor.COSINE_HALF, Factor.SINE, Factor.COSINE,
    Factor.SINE_TWICE, Factor.COSINE_TWICE,
)  # fmt: skip
_SPEEDS = (Factor.SPEED, Factor.SPEED_SIZE, Factor.SPEED_SIGN)
_OPENINGS = (Factor.COMMAND, Factor.COMMAND_SIZE)

PLAIN_FORCES: tuple[Feature, ...] = (
    (),
    *((one,) for one in (*_SPEEDS, Factor.SPEED_SQUARE, Factor.PLACE, *_WAVES)),
    *((Factor.SPEED, wave) for wave in _WAVES),
    *((one, Factor.PLACE) for one in _SPEEDS),
)
DRAGS: tuple[Feature, ...] = ((Factor.SPEED,), (Factor.SPEED_SIGN,))  # against the movement
PRESSED_FORCES: tuple[Feature, ...] = (
    (Factor.DIFFERENCE,),
    (Factor.SPEED, Factor.DIFFERENCE),
    (Factor.SPEED_SIGN, Factor.DIFFERENCE),
)
GAUGE_FLOWS: tuple[Feature, ...] = ((Factor.PRESSURE,),)
MOVED_FLOWS: tuple[Feature, ...] = (
    (Factor.SPEED,),
    (Factor.SPEED, Factor.PRESSURE),
    (Factor.SPEED_SIZE, Factor.PRESSURE),
)
COMMANDED_FLOWS: tuple[Feature, ...] = (
    *((one,) for one in _OPENINGS),
    *((one, Factor.PRESSURE) for one in _OPENINGS),
)
