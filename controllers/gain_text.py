"""The gains of a design as text for people: each number with name, unit and four digits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from controllers.positioning import STATES
from workbench.contracts import Controller
from workbench.units import public_name, si_unit

DIGITS = 4
OUTER = {"stiffness": "N/m", "damping": "N s/m", "restoring": "N/(m s)"}
"""The outer gains of a cascade, in their order."""


def gains(controller: Controller) -> Iterator[tuple[str, str]]:
    """The numbers of each mode's design, forward then backward, where it has gains.

    The poles of a mode follow its gains; a leg has those of each joint.
    """
    parts = getattr(controller, "regulators", (controller,))
    for part in parts:
        schedule, states = getattr(part, "gains", None), _states(part)
        body = f"{states[0].rpartition('.')[0]}, " if len(parts) > 1 else ""
        if schedule is not None:
            yield from _of_axis(schedule, states, body)


def _states(part: Any) -> tuple[str, ...]:
    """What is fed back, the position first."""
    if axis := getattr(part, "axis", None):
        return axis.states
    signal = getattr(part, "signal", "")
    return (signal,) if signal else STATES


def _of_axis(schedule: Any, states: tuple[str, ...], body: str) -> Iterator[tuple[str, str]]:
    unit = si_unit(states[0])
    for way in ("forward", "backward"):
        for place, gain in zip(schedule.positions_m, getattr(schedule, way), strict=True):
            name = f"{body}{way} at {place:.{DIGITS}g} {unit}"
            yield name, ", ".join(_numbers(gain, states, unit))
            if hasattr(gain, "poles"):
                yield f"{name}, poles", f"{_poles(gain.poles)} 1/s"


def _numbers(gain: Any, states: tuple[str, ...], unit: str) -> Iterator[str]:
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
            yield from (f"{_short(n)} {_quantity(v, _per(n))}" for n, v in _pairs(states, value))
        elif each.name == "outer":
            yield from (f"{n} {_quantity(v, OUTER[n])}" for n, v in _pairs(OUTER, value))
        elif each.name != "poles":
            yield f"{each.name} {_quantity(value, units.get(each.name, ''))}"


def _pairs(names: Iterable[str], values: np.ndarray) -> Iterator[tuple[str, float]]:
    return zip(names, values, strict=True)


def _quantity(value: float, unit: str) -> str:
    return f"{value:.{DIGITS}g} {unit}".strip()


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
    words = (f"{p.real:.{DIGITS}g}" + (f"±{p.imag:.{DIGITS}g}j" if p.imag else "") for p in rising)
    return ", ".join(words)
