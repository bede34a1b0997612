"""DESIGN.toml: what a controller was designed on and with, so that it can be built again.

The file holds the plant's name, the values it had, the effects it lacked and the empirical terms it
had, the numbers of the specification, and, for people, the gains of each mode.  Modes and gains
follow from the rest, so reading designs anew: a file cannot say one thing and do another.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from controllers import CONTROLLERS
from controllers.gain_text import gains
from controllers.spec import Range, farthest, replaced
from linearize.modes import HybridModel
from linearize.standard import (
    AXIS_MODES,
    JOINT_MODES,
    SHIFT_MODES,
    SLIDE_MODES,
    VESSEL_MODES,
    axis_modes,
    leg_joint_modes,
    shift_modes,
    slide_modes,
    vessel_modes,
)
from workbench.contracts import Controller
from workbench.errors import InputError, Message, UnknownNameError, listed, nearest
from workbench.plant import Plant
from workbench.plant_files import as_it_came, plant_named, plant_text
from workbench.rig_laws import law_terms, laws_of, with_laws
from workbench.rig_text import RigText, quoted, read_text
from workbench.units import public_name, si_unit
from workbench.whole_file import whole_file

PLANTS = {
    slide_modes: SLIDE_MODES,
    axis_modes: AXIS_MODES,
    leg_joint_modes: JOINT_MODES,
    shift_modes: SHIFT_MODES,
    vessel_modes: VESSEL_MODES,
}
"""The plants for which there are such modes."""


@dataclass(frozen=True)
class Design:
    """A controller with all that made it.

    method       key of :data:`controllers.CONTROLLERS`
    plant        the plant its modes were taken from
    spec         the specification, a dataclass of numbers
    hybrid       those modes
    """

    method: str
    plant: Plant
    spec: Any
    hybrid: HybridModel
    controller: Controller


def design(method: str, plant: Plant, numbers: Mapping[str, Any] | None = None) -> Design:
    """A design by the method's name; ``numbers`` replace those of its specification.

    Raises
    ------
    UnknownNameError
        If there is no such method, or it is not for this plant.
    InputError
        If a number is unknown or makes no sense.
    """
    if method not in CONTROLLERS:
        what = f"no controller {method}; there is {listed(CONTROLLERS)}"
        raise UnknownNameError(Message(what, nearest=nearest(method, CONTROLLERS)))
    found = CONTROLLERS[method]
    spec = replaced(found.spec(), numbers or {}, method)
    try:
        hybrid = found.modes(plant)
    except UnknownNameError as error:
        raise UnknownNameError(f"{error}; {_offered(plant)}") from error
    try:
        return Design(method, plant, spec, hybrid, found.design(hybrid, spec))
    except np.linalg.LinAlgError as error:
        raise _blamed(spec, method, error) from error


def _blamed(spec: Any, method: str, error: Exception) -> Exception:
    """The error by the number that is farthest from its usual value; itself where all are usual."""
    name = farthest(spec)
    if not name:
        return error
    value, usual = getattr(spec, name), getattr(type(spec)(), name)
    what = f"is {value:g}, farthest of all numbers from usual, and the design fails: {error}"
    return InputError(Message(what, f"{method}.{name}", f"a number nearer to the usual {usual:g}"))


def methods_of(plant: Plant) -> list[str]:
    """The controllers that are for a plant."""
    return [name for name, each in CONTROLLERS.items() if plant.name in PLANTS[each.modes]]


def _offered(plant: Plant) -> str:
    """The controllers that there are for a plant, or the plants for which there is one."""
    if methods := methods_of(plant):
        return f"controllers for {plant.name}: {listed(methods)}"
    plants = dict.fromkeys(name for each in PLANTS.values() for name in each)
    return f"no controller is for {plant.name}, only for {listed(plants)}"


def write_design(found: Design, path: Path) -> None:
    """Write a design, and the folder it is to lie in."""
    text = "\n".join(_lines(found, path.parent)) + "\n"
    with whole_file(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8")


def read_design(path: Path) -> Design:
    """The design of a file, built anew; as :func:`parse_design`."""
    return parse_design(read_text(path)[0], path)


def parse_design(text: str, path: Path) -> Design:
    """The design that the text of a file holds, built anew; ``path`` is where it lies.

    Raises
    ------
    InputError
        With all that is wrong in the file, by line: it is no TOML, a key is missing, unknown or of
        the wrong type, a name does not exist, or a number makes no sense.
    """
    file = RigText(text, str(path), "a design file")
    file.keys_among((), file.tree, ("controller", "plant", "spec"))
    method = _needed(file, ("controller",), str, "", "the name of a controller")
    plant = _plant(file, path.parent)
    numbers = _needed(file, ("spec",), dict, {}, "a table of the controller's numbers")
    file.finish()
    with _placed(file, ("controller",), method, plant.values):
        return design(method, plant, numbers)


def _needed(file: RigText, place: tuple[str, ...], kind: type, default: Any, expected: str) -> Any:
    """What stands at a place; noted where nothing does, or something of another type."""
    table = file.table(*place[:-1])
    if place[-1] not in table:
        file.wrong(place, "is missing", expected=expected)
    return file.typed(place, kind, default, expected)


def _plant(file: RigText, folder: Path) -> Plant | None:
    """The plant of a file, none where it has no such plant; complaints go to the file."""
    place = _needed(file, ("plant",), dict, {}, "a table with the plant's name and values")
    if not isinstance(file.tree.get("plant"), dict):
        return None
    file.keys_among(("plant",), place, ("name", "removed", "laws", "values"))
    name = _needed(file, ("plant", "name"), str, "", "the name of a plant")
    _needed(file, ("plant", "removed"), list, [], "a list of names")
    removed, laws = (file.names(("plant", key)) for key in ("removed", "laws"))
    values = _needed(file, ("plant", "values"), dict, {}, "a table of values in SI")
    file.finish()
    with _placed(file, ("plant", "name")):
        plant = with_laws(plant_named(name, folder), laws)
    terms = dict.fromkeys((*law_terms(plant), *(term.name for term in laws_of(plant))))
    effects = [effect.name for effect in plant.effects]
    for key, names, known in (("removed", removed, effects), ("laws", laws, terms)):
        for each in names:
            if each not in known:
                file.unknown(("plant", key), plant.name, known, item=each)
    file.finish()
    return _with_values(file, plant.without(*removed), values)


def _with_values(file: RigText, plant: Plant, values: Mapping[str, Any]) -> Plant:
    for name, value in values.items():
        place = ("plant", "values", name)
        if name not in plant.values:
            file.unknown(place, plant.name, plant.values)
            continue
        bounds = Range(plant.parameters[name].lower, plant.parameters[name].upper, above=False)
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not bounds.holds(value):
            expected = f"a number {bounds}, in {si_unit(name) or 'units of 1'}"
            file.wrong(place, f"is {value!r}", expected=expected)
    file.finish()
    return plant.with_values(values)


@contextmanager
def _placed(
    file: RigText, usual: tuple[str, ...], method: str = "", values: Iterable[str] = ()
) -> Iterator[None]:
    """Complaints of what is built from a file with their lines: of a number, else the usual one.

    A number is one of the method's, or a value of the plant by its public name.
    """
    full = {public_name(name): name for name in values}

    def place(message: Message) -> tuple[str, ...]:
        if message.name in full:
            return ("plant", "values", full[message.name])
        above, _, rest = message.name.partition(".")
        return ("spec", *rest.split(".")) if method and above == method else usual

    try:
        yield
    except InputError as error:
        raise file.placed(error, place) from error


def _lines(found: Design, folder: Path) -> Iterator[str]:
    plant = found.plant
    laws = [term.name for term in laws_of(plant)]
    original = with_laws(as_it_came(plant), laws)
    had, has = ({e.name for e in p.effects} for p in (original, plant))
    extra = sorted(has - had)
    if extra:
        raise ValueError(f"{plant.name} has effects of its own: {', '.join(extra)}")
    before = original.values
    yield f'controller = "{found.method}"'
    yield "\n[plant]"
    yield f'name = "{plant_text(plant, folder)}"'
    yield f"removed = [{', '.join(repr(name) for name in sorted(had - has))}]"
    if laws:
        yield f"laws = [{', '.join(map(repr, laws))}]"
    yield "\n[plant.values]"
    for name, value in plant.values.items():
        if value != before[name]:
            yield f'"{name}" = {float(value)!r}'
    yield from _table("spec", found.spec)
    yield "\n# gains by mode, for reading only"
    for name, gain in gains(found.controller):
        yield f"# {name}: {gain}"


def _table(name: str, spec: Any) -> Iterator[str]:
    """A specification as a table, its own specifications as tables below it."""
    yield f"\n[{name}]"
    inside = []
    for f in fields(spec):
        value = getattr(spec, f.name)
        if is_dataclass(value) or isinstance(value, Mapping):
            inside.append((f"{name}.{f.name}", value))
        else:
            yield f"{f.name} = {value!r}"
    for key, value in inside:
        if is_dataclass(value):
            yield from _table(key, value)
        else:
            yield f"\n[{key}]"
            yield from (f"{quoted(mode)} = {quoted(kind.value)}" for mode, kind in value.items())
