"""Empirical laws in a rig: their terms in the plant, and the range in which they were seen.

A term stands in ``[effects] add`` beside the effects, ``"law[v|v|]@slide"``, with its coefficient
in ``[values]``.  The table ``[seen]`` holds the range of each quantity in the recordings that the
law was fitted to: outside of it nobody knows what it is worth.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import inf
from typing import Any

from workbench.effect import Effect
from workbench.effects.empirical import FORCES, EmpiricalForce, ScaledDrag, ScaledForce
from workbench.effects.empirical_fillings import (
    ConstantFlow,
    ConstantRate,
    EmpiricalFilling,
    PressureFlow,
    ScaledFlow,
    ScaledRate,
    SpeedFlow,
)
from workbench.effects.law_features import (
    COMMANDED_FLOWS,
    DRAGS,
    GAUGE_FLOWS,
    MOVED_FLOWS,
    PLAIN_FORCES,
    PRESSED_FORCES,
    Feature,
)
from workbench.effects.law_features import written as written_as
from workbench.gas_volume import GasVolume
from workbench.linkage import JointRod
from workbench.parts import Atmosphere, Body, HeldRod, PressureFace, Supply
from workbench.plant import Plant
from workbench.rig_text import RigText, quoted
from workbench.simulation import arriving_at_rest
from workbench.units import UnitError, public_name, quantity, written
from workbench.vessel import LumpedPressure

PREFIX = "law["
Ranges = Mapping[str, tuple[float, float]]
Groups = Sequence[tuple[tuple[Feature, ...], Mapping[str, Any]]]  # features, what they need


def is_law(name: str) -> bool:
    """True for the name of an empirical term, with or without its place."""
    return name.startswith(PREFIX)


def laws_of(plant: Plant) -> tuple[EmpiricalForce | EmpiricalFilling, ...]:
    """The empirical terms that stand in a plant."""
    return tuple(e for e in plant.effects if isinstance(e, EmpiricalForce | EmpiricalFilling))


def law_terms(plant: Plant) -> dict[str, Effect]:
    """Every empirical term that a plant has a place for, absent, by its name with place."""
    return {term.name: term for term in _terms(plant)}


def _terms(plant: Plant) -> Iterator[Effect]:
    for part in plant.parts:
        if isinstance(part, Body | HeldRod | JointRod):
            yield from _forces(plant, part.name)
        elif isinstance(part, GasVolume):
            yield from _flows(plant, part)
        elif isinstance(part, LumpedPressure):
            yield from _rates(plant, part)


def _forces(plant: Plant, body: str) -> Iterator[Effect]:
    yield from (kind(name=_named(kind, body), body=body) for kind in FORCES)
    pushing = tuple(
        part.name
        for part in plant.parts
        if isinstance(part, GasVolume | PressureFace) and getattr(part, "body", None) == body
    )
    # Two against each other, or one against the atmosphere; of more, no one says which.
    across = pushing if len(pushing) > 1 else (*pushing, *_outside(plant))
    known = len(across) == 2 and bool(pushing)
    for feature in (*PLAIN_FORCES, *(PRESSED_FORCES if known else ())):
        at = {"chambers": across} if feature in PRESSED_FORCES else {}
        kind = ScaledDrag if feature in DRAGS else ScaledForce
        yield kind(name=_written(feature, body), body=body, feature=feature, **at)


def _flows(plant: Plant, part: GasVolume) -> Iterator[Effect]:
    """Of several supplies the first; of several commands none, no one says which is whose."""
    at = {"chamber": part.name}
    yield ConstantFlow(name=_named(ConstantFlow, part.name), **at)
    supplies = [part.name for part in plant.parts if isinstance(part, Supply)]
    if supplies:
        name = _named(PressureFlow, part.name)
        yield PressureFlow(name=name, **at, supply=supplies[0])
    body = getattr(part, "body", None)
    if body:
        yield SpeedFlow(name=_named(SpeedFlow, part.name), **at, body=body)
    moved = [(MOVED_FLOWS, {"body": body})] if body else []
    yield from _fillings(ScaledFlow, plant, part.name, moved)


def _rates(plant: Plant, part: LumpedPressure) -> Iterator[Effect]:
    """As those into a volume of gas, of a pressure that knows no gas and closes with no body."""
    yield ConstantRate(name=_named(ConstantRate, part.name), chamber=part.name)
    yield from _fillings(ScaledRate, plant, part.name)


def _fillings(
    kind: type[ScaledFlow] | type[ScaledRate], plant: Plant, chamber: str, moved: Groups = ()
) -> Iterator[Effect]:
    """What fills a chamber by its pressure above ambient, by a body's speed, and by the command."""
    for outside in _outside(plant):
        for features, more in ((GAUGE_FLOWS, {}), *moved, *_commanded(plant)):
            for feature in features:
                name = _written(feature, chamber)
                yield kind(name=name, feature=feature, chamber=chamber, outside=outside, **more)


def _commanded(plant: Plant) -> Groups:
    """What goes by the command; nothing where there are several."""
    return [(COMMANDED_FLOWS, _command(plant))] if len(plant.commands) == 1 else []


def _outside(plant: Plant) -> list[str]:
    """The first atmosphere, as a list; none where the plant has none."""
    return [part.name for part in plant.parts if isinstance(part, Atmosphere)][:1]


def _command(plant: Plant) -> dict[str, Any]:
    """The only command as a share of its range to either side of where it rests."""
    (signal,) = plant.commands
    sides = [abs(end - signal.nominal) for end in (signal.lower, signal.upper)]
    span = max((side for side in sides if 0.0 < side < inf), default=1.0)
    return {"command": signal.name, "rest": arriving_at_rest(plant)[signal.name], "span": span}


def _written(feature: Feature, place: str) -> str:
    return f"{PREFIX}{written_as(feature)}]@{place}"


def _named(kind: type[Effect], place: str) -> str:
    return f"{kind.causes[0].name}@{place}"


def with_laws(plant: Plant, names: Iterable[str]) -> Plant:
    """The plant with these empirical terms, absent where they are new; other names are left."""
    there, known = {effect.name for effect in plant.effects}, law_terms(plant)
    wanted = [known[name] for name in names if name in known and name not in there]
    return plant.with_effects(*wanted) if wanted else plant


def quantities(plant: Plant) -> dict[str, str]:
    """Full names of what may have a range, by public name: outputs, inputs and states."""
    signals = (*plant.commands, *plant.measured_inputs, *plant.optional_inputs)
    inputs = (signal.name for signal in signals)
    names = (*plant.measured, *plant.optional_outputs, *inputs, *plant.state_list)
    return {public_name(name): name for name in names}


def read_seen(text: RigText, plant: Plant) -> dict[str, tuple[float, float]]:
    """The ranges of a rig file in SI by full name; complaints go to ``text``."""
    known, found = quantities(plant), {}
    section = text.flat("seen")
    if section and not laws_of(plant):
        text.wrong(("seen",), "is the range of an empirical law, and [effects] adds none")
    for key, typed in section.items():
        if key not in known:
            text.unknown(("seen", key), plant.name, known)
        elif ends := _ends(text, key, known[key], typed):
            found[known[key]] = ends
    return found


def _ends(text: RigText, key: str, full: str, typed: Any) -> tuple[float, float] | None:
    place = ("seen", key)
    if not (isinstance(typed, list) and len(typed) == 2):
        text.wrong(place, f"{typed!r} is no range", expected="a list of two, the lower end first")
        return None
    try:
        low, high = (quantity(end, full) for end in typed)
    except UnitError as error:
        text.wrong(place, str(error))
        return None
    if low > high:
        text.wrong(place, f"begins above its end, {typed[0]} to {typed[1]}")
        return None
    return low, high


def seen_lines(seen: Ranges) -> list[str]:
    """The table ``[seen]`` as a rig file holds it; nothing where there is no range."""
    if not seen:
        return []
    lines = ["", "# where the empirical terms were seen: beyond, nobody knows what they are worth"]
    rows = (
        f"{quoted(public_name(name))} = "
        f"[{quoted(written(low, name))}, {quoted(written(high, name))}]"
        for name, (low, high) in seen.items()
    )
    return [*lines, "[seen]", *rows]
