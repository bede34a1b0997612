"""A user's own cuts: a TOML file with intervals of signals and levels of switched commands.

    [cuts]
    "slide.position" = [
        { label = "near a", upper = "100 mm", point = "50 mm" },
        { label = "beyond", lower = "100 mm", point = "200 mm" },
    ]
    "slide.velocity" = [
        { label = "slide -", upper = "-1 mm/s", point = "-0.1 m/s" },
        { label = "stick", lower = "-1 mm/s", upper = "1 mm/s", point = "0 m/s",
          holds = ["slide.position", "slide.velocity"] },
        { label = "slide +", lower = "1 mm/s", point = "0.1 m/s" },
    ]

An end that is not given is open.  ``level`` in place of ends and point is one value of a switch.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import inf, isfinite
from pathlib import Path
from typing import Any

from linearize.cuts import Interval, Level, Region, Wording, checked
from linearize.modes import HybridModel, hybrid_modes
from linearize.reduction import design_model
from studies.text import shown
from workbench.errors import InputError, Message, listed, nearest
from workbench.plant import Plant
from workbench.rig_text import RigText, read_text
from workbench.units import UnitError, public_name, quantity

KEYS = ("label", "lower", "upper", "point", "holds", "level")
VALUES = ("lower", "upper", "point", "level")
OPEN = {"lower": -inf, "upper": inf}


def modes_by_cuts(plant: Plant, path: Path) -> HybridModel:
    """The modes of a plant by the cuts of a file.

    Raises
    ------
    InputError
        With all that is wrong, each with its line, by the names and units of the file: unknown
        signals and keys, units that do not fit, empty intervals, gaps, overlaps, points outside.
    """
    model = design_model(plant)
    known = {public_name(name): name for name in (*model.states, *model.commands)}
    text = RigText(read_text(path)[0], str(path))
    found = text.tree.get("cuts")
    if not isinstance(found, Mapping) or not found:
        raise InputError(Message("has no [cuts]", str(path), "a signal with its intervals"))
    entries = {name: each if isinstance(each, list) else [each] for name, each in found.items()}
    try:
        cuts = _cuts(plant, known, entries)
        checked(model, cuts, _as_typed(known, entries))
        return hybrid_modes(plant, cuts, model=model)
    except InputError as error:
        raise text.placed(error, lambda message: ("cuts", message.name)) from error


Entries = Mapping[str, list[Any]]
"""What the file has, by the signal's name in it."""


def _cuts(plant: Plant, known: Mapping[str, str], entries: Entries) -> dict[str, list[Region]]:
    """The regions by the full name of their signal.

    Raises
    ------
    InputError
        With all that cannot be read.
    """
    cuts: dict[str, list[Region]] = {}
    wrong: list[Message] = []
    for signal, regions in entries.items():
        if signal not in known:
            what = f"{plant.name} has no such signal to cut"
            wrong.append(Message(what, signal, listed(known), nearest(signal, known)))
            continue
        cuts[known[signal]] = []
        for entry in regions:
            try:
                cuts[known[signal]].append(_region(known, signal, entry))
            except InputError as error:
                wrong += error.messages
    if wrong:
        raise InputError(*wrong)
    return cuts


def _as_typed(known: Mapping[str, str], entries: Entries) -> Wording:
    """Signals by the names of the file, and values as they stand in it."""
    typed = {
        (known[signal], _value(known[signal], signal, key, entry[key])): str(entry[key])
        for signal, regions in entries.items()
        for entry in regions
        for key in VALUES
        if key in entry
    }

    def value(name: str, at: float) -> str:
        return typed.get((name, at)) or (shown(at, name) if isfinite(at) else f"{at:g}")

    return Wording(public_name, value)


def _region(known: Mapping[str, str], signal: str, entry: Any) -> Region:
    """One interval or level.

    Raises
    ------
    InputError
        If a key is unknown or missing, or a value does not fit.
    """
    if wrong := [*_wrong_keys(known, signal, entry)]:
        raise InputError(*wrong)
    label = str(entry["label"])
    value = {key: _value(known[signal], signal, key, entry[key]) for key in entry if key in VALUES}
    if "level" in entry:
        return Level(label, value["level"])
    holds = tuple(known.get(name, name) for name in entry.get("holds", ()))
    ends = {key: value.get(key, end) for key, end in OPEN.items()}
    return Interval(label, **ends, point=value["point"], holds=holds)


def _wrong_keys(known: Mapping[str, str], signal: str, entry: Any) -> Iterator[Message]:
    if not isinstance(entry, Mapping):
        yield Message(f"{entry!r} is no region", signal, '{ label = "...", point = "..." }')
        return
    for key in entry:
        if key not in KEYS:
            yield Message(f"a region has no '{key}'", signal, listed(KEYS), nearest(key, KEYS))
    for key in ("label", "level" if "level" in entry else "point"):
        if key not in entry:
            yield Message(f"a region lacks its {key}", signal)
    if isinstance(entry.get("label"), list | Mapping):
        yield Message(f"label: is {entry['label']!r}", signal, "a text")
    holds = entry.get("holds", [])
    if not (isinstance(holds, list) and all(isinstance(name, str) for name in holds)):
        expected = f'a list of states, as ["{next(iter(known))}"]'
        yield Message(f"holds: is {holds!r}", signal, expected)


def _value(name: str, signal: str, key: str, text: Any) -> float:
    try:
        return quantity(text, name)
    except UnitError as error:
        raise InputError(Message(f"{key}: {error}", signal)) from None
