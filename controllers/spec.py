"""Specifications: frozen dataclasses of numbers, each with the range in which it makes sense.

A number is finite and above zero unless its field says otherwise by :func:`ranged`; a sample time
has one range everywhere.  What is no number is one of a few named things for each mode: see
:func:`chosen`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import Field, dataclass, field, fields, is_dataclass
from enum import Enum
from math import inf, isfinite, log
from typing import Any

from workbench.errors import InputError, Message, listed, nearest


@dataclass(frozen=True)
class Range:
    """From ``least`` to ``most``, both included; or from just above ``least``."""

    least: float = 0.0
    most: float = inf
    above: bool = True

    def holds(self, value: float) -> bool:
        """True when a finite value lies inside."""
        bottom = value > self.least if self.above else value >= self.least
        return isfinite(value) and bottom and value <= self.most

    def __str__(self) -> str:
        bottom = f"above {self.least:g}" if self.above else f"from {self.least:g}"
        return bottom + (f" to {self.most:g}" if self.most < inf else "")


SAMPLE_TIMES = Range(1e-4, 5e-2, above=False)
"""In s: below no computer keeps up, above a piston crosses its stroke between two samples."""


def ranged(default: float, *, least: float = 0.0, most: float = inf, above: bool = False) -> Any:
    """A number of a specification with a range of its own."""
    return field(default=default, metadata={"range": Range(least, most, above)})


def chosen(kinds: type[Enum]) -> Any:
    """A choice of one of these for each mode by its name; none is made by default."""
    return field(default_factory=dict, metadata={"kinds": kinds})


def replaced(spec: Any, numbers: object, where: str) -> Any:
    """The specification with some numbers replaced, tables inside it likewise.

    Raises
    ------
    InputError
        Naming every number that is unknown, of the wrong type or out of its range.
    """
    found, wrong = _replaced(spec, numbers, where)
    if wrong:
        raise InputError(*wrong)
    return found


def farthest(spec: Any) -> str:
    """The number that is farthest from its usual value by their ratio; empty where none is off."""
    usual, off = type(spec)(), {}
    for each in fields(spec):
        value, other = getattr(spec, each.name), getattr(usual, each.name)
        if isinstance(value, int | float) and value != other and value > 0.0 and other > 0.0:
            off[each.name] = abs(log(value) - log(other))
    return max(off, key=off.__getitem__, default="")


def _replaced(spec: Any, numbers: object, where: str) -> tuple[Any, list[Message]]:
    known = {f.name: f for f in fields(spec)}
    if not isinstance(numbers, Mapping):
        expected = f"a table of some of {listed(known)}"
        return spec, [Message(f"{numbers!r} is no table", where, expected)]
    values = {name: getattr(spec, name) for name in known}
    wrong: list[Message] = []
    for key, value in numbers.items():
        inside = f"{where}.{key}"
        if key not in known:
            wrong.append(_unknown(spec, key, where))
        elif is_dataclass(values[key]):
            values[key], more = _replaced(values[key], value, inside)
            wrong += more
        elif kinds := known[key].metadata.get("kinds"):
            values[key], more = _choices(kinds, value, inside)
            wrong += more
        elif expected := _refused(known[key], values[key], value):
            wrong.append(Message(f"is {value!r}", inside, expected))
        else:
            values[key] = type(values[key])(value)
    return (spec if wrong else type(spec)(**values)), wrong


def _choices(
    kinds: type[Enum], choices: object, where: str
) -> tuple[dict[str, Enum], list[Message]]:
    """Choices by the name of a mode, and what is wrong with them."""
    known = {kind.value: kind for kind in kinds}
    if not isinstance(choices, Mapping):
        return {}, [Message(f"{choices!r} is no table", where, f"by mode, {listed(known)}")]
    right = {n: known[v] for n, v in choices.items() if isinstance(v, str) and v in known}
    wrong = [
        Message(f"is {value!r}", f"{where}.{name}", listed(known), nearest(str(value), known))
        for name, value in choices.items()
        if name not in right
    ]
    return right, wrong


def _refused(known: Field, default: float, value: object) -> str:
    """What was expected in place of this value; empty where it is right."""
    whole = isinstance(default, int)
    usual = SAMPLE_TIMES if known.name == "sample_time_s" else Range()
    inside = known.metadata.get("range", usual)
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if number and inside.holds(value) and (not whole or value == round(value)):
        return ""
    return f"a {'whole ' if whole else ''}number {inside}"


def _unknown(spec: Any, key: str, where: str) -> Message:
    """A key that is not there, with the nearest one, also of the tables inside.

    Where ``ELSEWHERE`` of a specification knows of another method that has it, with that.
    """
    names = [f.name for f in fields(spec)]
    deeper = {
        f.name: f"{name}.{f.name}"
        for name in names
        if is_dataclass(getattr(spec, name))
        for f in fields(getattr(spec, name))
    }
    near = nearest(key, names) or deeper.get(nearest(key, deeper), "")
    expected = f"one of {listed(names)}"
    if elsewhere := getattr(spec, "ELSEWHERE", {}).get(key):
        expected += f"; {elsewhere}"
    return Message(f"{where} has no such number", f"{where}.{key}", expected, near)
