"""Whether a user's own effect classes say of their causes and parameters what can be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import Field
from enum import Enum
from math import isfinite
from numbers import Real
from typing import Any

from workbench.effect import Balance, Cause, Effect, Kind, Parameter
from workbench.errors import Message, listed, nearest
from workbench.plant import Plant

STRENGTH, FORM, EITHER = "strength()", "form()", "strength() or form()"


def own(member: Effect) -> bool:
    """True where the class is a user's own; those of the project are tested as they are."""
    return not type(member).__module__.startswith("workbench.")


def cause_faults(plant: Plant) -> list[Message]:
    """What is wrong with the causes and parameters of a user's own classes, each thing once."""
    members = filter(own, plant.members)
    return list(dict.fromkeys(fault for member in members for fault in _faults(member)))


def _faults(member: Effect) -> Iterator[Message]:
    kind = type(member).__name__
    bare = [key for key, value in vars(type(member)).items() if isinstance(value, Field)]
    if bare:
        what = f"{kind} is no dataclass, so its {listed(bare)} cannot be set"
        yield Message(what, expected="@dataclass(frozen=True, kw_only=True) above the class")
        return
    causes = member.causes
    if not _list_of(causes, Cause):
        expected = "a tuple of Cause, with a comma behind a single one"
        yield Message(f"{kind}: causes is a {type(causes).__name__}", expected=expected)
        return
    for cause in causes:
        yield from _cause_faults(member, cause, f"{kind}, cause {cause.name}")


def _parameter_faults(name: str, known: Parameter) -> Iterator[Message]:
    """What is wrong with the typical value: scans and solvers count in it."""
    typical, between = known.typical, f"[{known.lower:g}, {known.upper:g}]"
    if not (isinstance(typical, Real) and isfinite(typical)):
        yield Message(f"{name}: typical is {typical!r}", expected=f"a number within {between}")
    elif not known.lower <= typical <= known.upper:
        yield Message(f"{name}: typical is {typical:g}, outside {between}")
    elif typical == known.null:
        what = f"{name}: typical is {typical:g}, which is its null"
        yield Message(what, expected="a size worth trying")


def _cause_faults(member: Effect, cause: Cause, where: str) -> Iterator[Message]:
    for key, each in (("drivers", str), ("forms", str), ("sizes", Real)):
        if not _list_of(getattr(cause, key), each):
            what = f"{where}: its {key} are {getattr(cause, key)!r}"
            kind = "texts" if each is str else "numbers"
            yield Message(what, expected=f"a tuple of {kind}, with a comma behind a single one")
            return
    forms = (*cause.forms, *cause.shapes)
    for key, known in member.parameters().items():
        if key in (cause.strength, *forms, cause.held, cause.needs):
            yield from _parameter_faults(f"{type(member).__name__}.{key}", known)
    yield from _field_faults(member, where, "strength", cause.strength, STRENGTH)
    for key in forms:
        by = FORM if key == cause.strength else EITHER
        yield from _field_faults(member, where, "form", key, by)
    if cause.held is not None:
        yield from _field_faults(member, where, "held field", cause.held, EITHER)
    if cause.needs is not None:
        yield from _field_faults(member, where, "needed field", cause.needs, STRENGTH)
    yield from _choice_faults(where, "balance", cause.balance, Balance)
    yield from _choice_faults(where, "kind", cause.kind, Kind)


def _field_faults(member: Effect, where: str, role: str, key: str, by: str) -> Iterator[Message]:
    """What is wrong with a field that a cause names; it is to be made by ``by``."""
    known = member.parameters()
    makers = {name: FORM if each.null is None else STRENGTH for name, each in known.items()}
    fitting = [name for name, maker in makers.items() if by in (maker, EITHER)]
    if key in fitting:
        return
    if key in makers:
        said = f", made by {makers[key]}"
    else:
        said = ", a plain field" if hasattr(member, key) else ", and there is no such field"
    there = f": {listed(fitting)}" if fitting else ""
    expected = f"a field made by {by}{there}"
    yield Message(f"{where}: its {role} is '{key}'{said}", "", expected, nearest(key, fitting))


def _choice_faults(where: str, role: str, value: object, choice: type[Enum]) -> Iterator[Message]:
    if isinstance(value, choice):
        return
    known = [str(each) for each in choice]
    near = {each.value: str(each) for each in choice}.get(str(value).lower(), "")
    yield Message(f"{where}: its {role} is {value!r}", "", f"one of {listed(known)}", near)


def _list_of(values: Any, kind: type) -> bool:
    """True for a tuple or list of such values alone."""
    whole = isinstance(values, Sequence) and not isinstance(values, str)
    return whole and all(isinstance(value, kind) for value in values)
