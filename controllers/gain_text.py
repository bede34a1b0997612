"""The gains of a design with names and units, as numbers and as text of four digits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from controllers.on_measurement import OnMeasurement
from controllers.positioning import STATES
from workbench.contracts import Controller
from workbench.units import public_name, si_unit

DIGITS = 4
ROUNDED = 1e-6  # of the farthest place: what is nearer to zero is a zero that was searched for
ALONE = "alone: alternates each sample"
OUTER = {"stiffness": "N/m", "damping": "N s/m", "restoring": "N/(m s)"}
"""The outer gains of a cascade, in their order."""


@dataclass(frozen=True)
class NamedGain:
    """One number of a law."""

    name: str
    value: float
    unit: str

    @property
    def text(self) -> str:
        """As people read it."""
        return f"{self.name} {self.value:.{DIGITS}g} {self.unit}".strip()


@dataclass(frozen=True)
class GainRow:
    """The gains of one mode's law, and the poles of its closed loop in 1/s where they are known."""

    name: str
    gains: tuple[NamedGain, ...]
    poles: np.ndarray | None = None


def gain_rows(controller: Controller) -> Iterator[GainRow]:
    """The numbers of each mode's design, forward then backward, where it has gains.

    A leg has those of each joint.
    """
    parts = getattr(controller, "regulators", (controller,))
    for part in parts:
        schedule, states = getattr(part, "gains", None), _states(part)
        body = f"{states[0].rpartition('.')[0]}, " if len(parts) > 1 else ""
        if schedule is not None:
            yield from _of_axis(schedule, states, body)


def gains(controller: Controller) -> Iterator[tuple[str, str]]:
    """The same in words, by name; the poles of a mode follow its gains."""
    for row in gain_rows(controller):
        yield row.name, ", ".join(gain.text for gain in row.gains)
        if row.poles is not None:
            yield f"{row.name}, poles", f"{_poles(row.poles)} 1/s"


def _states(part: Any) -> tuple[str, ...]:
    """What is fed back, the position first."""
    if axis := getattr(part, "axis", None):
        return axis.states
    return (part.signal,) if isinstance(part, OnMeasurement) else STATES


def _of_axis(schedule: Any, states: tuple[str, ...], body: str) -> Iterator[GainRow]:
    unit, widest = si_unit(states[0]), float(np.abs(schedule.positions_m).max())
    for way in ("forward", "backward"):
        for place, gain in zip(schedule.positions_m, getattr(schedule, way), strict=True):
            at = 0.0 if abs(place) < ROUNDED * widest else place
            name = f"{body}{way} at {at:.{DIGITS}g} {unit}"
            yield GainRow(name, tuple(_numbers(gain, states, unit)), getattr(gain, "poles", None))


def _numbers(gain: Any, states: tuple[str, ...], unit: str) -> Iterator[NamedGain]:
    units = {
        "proportional": f"V/{unit}",
        "integral": f"V/({unit} s)",
        "derivative": f"V s/{unit}",
        "force": "V/N",
        "speed": f"V s/{unit}",
    }
    for each in fields(gain):
        value = getattr(gain, each.name)
        if each.name == "feedback":
            yield from (NamedGain(_short(n), v, _per(n)) for n, v in _pairs(states, value))
        elif each.name == "outer":
            yield from (NamedGain(n, v, OUTER[n]) for n, v in _pairs(OUTER, value))
        elif each.name != "poles":
            yield NamedGain(each.name, value, units.get(each.name, ""))


def _pairs(names: Iterable[str], values: np.ndarray) -> Iterator[tuple[str, float]]:
    return zip(names, map(float, values), strict=True)


def _per(state: str) -> str:
    """Volts per unit of a state: ``V s/m`` of a velocity."""
    over, _, under = si_unit(state).partition("/")
    return f"V {under}/{over}" if under else f"V/{over}"


def _short(state: str) -> str:
    """A pressure with its chamber; of a position and its velocity there is one each."""
    name = public_name(state)
    return name if name.endswith("pressure") else name.rpartition(".")[2]


def _poles(poles: np.ndarray) -> str:
    """The slowest first, both of a pair at once."""
    rising = sorted(poles[poles.imag >= 0.0], key=lambda pole: -pole.real)
    return ", ".join(_pole(p, paired=np.isclose(poles, p.conjugate()).any()) for p in rising)


def _pole(pole: complex, paired: bool) -> str:
    """One pole, or a pair.

    One alone off the real axis is that of a sampled loop at a negative z, which has no partner: its
    logarithm has pi over the sample time for an imaginary part.
    """
    real, imaginary = f"{pole.real:.{DIGITS}g}", f"{pole.imag:.{DIGITS}g}j"
    if not pole.imag:
        return real
    return f"{real}±{imaginary}" if paired else f"{real}+{imaginary} ({ALONE})"
