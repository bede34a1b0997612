"""The rig file: which plant, what is known of it, and how its recordings are read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from pathlib import Path

from workbench.candidate import Candidate
from workbench.causes import why_not
from workbench.effect import Parameter
from workbench.errors import InputError, Message, listed
from workbench.geometry import require_room
from workbench.plant import Plant
from workbench.plant_files import plant_named
from workbench.recording import Recording
from workbench.recording_format import RecordingFormat, default_format, read_format
from workbench.rig_laws import Ranges, is_law, law_terms, read_seen, with_laws
from workbench.rig_names import parameter_names
from workbench.rig_text import RigText, read_text
from workbench.spelled_units import is_gauge
from workbench.units import (
    STANDARD_ATMOSPHERE_PA,
    UnitError,
    deviation,
    public_name,
    quantity,
    written,
)

AMBIENT = "atmosphere.pressure_pa"
ACCEPTED = "# accepted: "
KEYS = ("name", "plant", "effects", "values", "uncertainty", "fixed", "seen", "recording")


@dataclass(frozen=True, kw_only=True)
class Rig:
    """A plant as somebody has it, with what is known of it and how its recordings are read.

    Attributes
    ----------
    plant
        The plant with all values set; causes that it may lack stand in it at null.
    added, removed
        Public names of causes, with their place: added ones are free in a fit, but for what
        ``deviations`` say of them; removed ones are at null.
    deviations
        One standard deviation in SI by full parameter name, where it overrides the catalogue's.
    fixed
        Full names of parameters that are never fitted; see ``held``.
    reader
        How recordings are read.
    notes
        One line for each effect that was accepted.
    seen
        Range in SI, by full name, in which the empirical terms among the added were seen.
    """

    name: str
    plant: Plant
    added: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    deviations: Mapping[str, float] = field(default_factory=dict)
    fixed: frozenset[str] = frozenset()
    reader: RecordingFormat
    notes: tuple[str, ...] = ()
    seen: Ranges = field(default_factory=dict)
    path: Path | None = None

    def standard_deviation(self, parameter: str) -> float:
        """One standard deviation of a parameter by its full name, 0 where its value is known."""
        own = self.deviations.get(parameter)
        value = self.plant.values[parameter]
        return self.plant.parameters[parameter].standard_deviation(value) if own is None else own

    @property
    def ambient_pa(self) -> float:
        """The pressure that gauge pressures count from."""
        return self.plant.values.get(AMBIENT, STANDARD_ATMOSPHERE_PA)

    @property
    def held(self) -> frozenset[str]:
        """Full names of what no fit moves: what is fixed, and what recordings were read with.

        Gauge pressures were counted from the ambient pressure: a fit that moved it would leave them
        where they are, and the fitted rig would read the same file otherwise.
        """
        gauges = any(is_gauge(each.unit) for each in self.reader.channels.values())
        return self.fixed | {AMBIENT} if gauges else self.fixed

    def with_added(self, plant: Plant, names: Iterable[str]) -> Rig:
        """The rig with a plant in which more causes stand: added, and removed no longer."""
        added = (*self.added, *names)
        removed = tuple(name for name in self.removed if name not in added)
        return replace(self, plant=plant, added=added, removed=removed)

    def added_to(self, plant: Plant) -> tuple[Candidate, ...]:
        """The causes that the rig added, as far as this plant has a place for them."""
        return tuple(plant.candidates[name] for name in self.added if name in plant.candidates)

    def fit_for(self, recording: Recording) -> Plant:
        """The plant with the optional inputs and the outputs that this recording carries.

        Recordings that carry the same get the very same plant, so its model is made once.

        Raises
        ------
        InputError
            If the recording has none of the outputs, or lacks a command or measured input.
        """
        plant, carried = self.plant, recording.channels
        needed = (s.name for s in (*plant.commands, *plant.measured_inputs))
        missing = [public_name(name) for name in needed if name not in carried]
        if missing:
            what, besides = f"{plant.name} needs {listed(missing)}", f"besides {listed(carried)}"
            raise InputError(Message(what, recording.name, besides))
        given = tuple(s.name for s in plant.optional_inputs if s.name in carried)
        outputs = tuple(n for n in plant.measured + plant.optional_outputs if n in carried)
        if not outputs:
            known = listed(map(public_name, plant.measured + plant.optional_outputs))
            raise InputError(Message("carries no output", recording.name, f"one of {known}"))
        if (given, outputs) not in self._fitted:
            if given:
                plant = plant.with_measured_input(*given)
            if outputs != plant.measured:
                plant = plant.with_measured(*outputs)
            self._fitted[given, outputs] = plant
        return self._fitted[given, outputs]

    @cached_property
    def _fitted(self) -> dict[tuple[tuple[str, ...], tuple[str, ...]], Plant]:
        return {}


def default_rig(plant: Plant | str) -> Rig:
    """What a rig file with only a name and a plant gives."""
    plant = plant_named(plant) if isinstance(plant, str) else plant
    return Rig(name=plant.name, plant=plant, reader=default_format(plant))


def load_rig(path_or_text: Path | str) -> Rig:
    """The rig of a TOML file, or of its text.

    Raises
    ------
    InputError
        With everything that is wrong in the file, sorted by line.
    """
    content, path = read_text(path_or_text)
    text = RigText(content, str(path) if path else "rig")
    text.keys_among((), text.tree, KEYS)
    name = text.typed(("plant",), str, "", "the name of a plant")
    plant = with_laws(_plant(text, name, path), filter(is_law, text.names(("effects", "add"))))
    added, removed = _effects(text, plant)
    values = _values(text, plant, removed)
    nulls = {plant.candidates[n].strength for n in removed}
    absent = {full: plant.parameters[full].null for full in nulls}
    known = dict(
        name=text.typed(("name",), str, path.stem if path else name, "a text"),
        added=added,
        removed=removed,
        deviations=_deviations(text, plant, plant.values | values | absent),
        fixed=_fixed(text, plant),
        seen=read_seen(text, plant),
        reader=read_format(text, plant),
        notes=tuple(x[len(ACCEPTED) :] for x in content.splitlines() if x.startswith(ACCEPTED)),
        path=path,
    )
    text.finish()
    rig = Rig(plant=plant.with_values(values | absent), **known)
    require_room(text, rig)
    return rig


def _plant(text: RigText, name: str, path: Path | None) -> Plant:
    """The plant that a rig file names; its complaints get the file and the line."""
    try:
        return plant_named(name, path.parent if path else None)
    except InputError as error:
        line = text.line(("plant",))
        placed = (replace(each, file=text.file, line=line) for each in error.messages)
        raise InputError(*text.messages, *placed) from error


def _effects(text: RigText, plant: Plant) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Causes to add and to remove, with their places."""
    text.keys_among(("effects",), text.table("effects"), ("add", "remove"))
    taken: set[str] = set()
    found = []
    for key in ("add", "remove"):
        names: list[str] = []
        for item in text.names(("effects", key)):
            places = _candidates(plant, item)
            if not places:
                _no_such_cause(text, ("effects", key), plant, item)
            elif taken & set(places):
                text.wrong(("effects", key), "is named twice", item=item, expected="it once")
            taken.update(places)
            names += [place for place in places if place not in names]
        found.append(tuple(names))
    return found[0], found[1]


def _candidates(plant: Plant, name: str) -> list[str]:
    """The cause at its place, or at all its places where none is named."""
    if name in plant.candidates:
        return [name]
    return [full for full, c in plant.candidates.items() if c.cause.name == name]


def _no_such_cause(text: RigText, place: tuple[str, ...], plant: Plant, item: str) -> None:
    near = [*plant.candidates, *(c.cause.name for c in plant.candidates.values())]
    expected = f"one that `workbench effects {plant.name}` lists"
    if is_law(item):
        near, expected = [*law_terms(plant)], f"one of {listed(law_terms(plant))}"
    text.wrong(place, why_not(plant, item), item=item, expected=expected, known=near)


def _values(text: RigText, plant: Plant, removed: tuple[str, ...]) -> dict[str, float]:
    """Values in SI by full name; complaints go to ``text``."""
    names, values = parameter_names(plant), {}
    absent = {plant.candidates[name].strength: name for name in removed}
    section = text.flat("values")
    ambient_pa = plant.values.get(AMBIENT, STANDARD_ATMOSPHERE_PA)
    for key in sorted(section, key=lambda key: key != public_name(AMBIENT)):
        place = ("values", key)
        for full in _known(text, place, plant, names, values):
            try:
                values[full] = quantity(section[key], full, ambient_pa)
            except UnitError as error:
                text.wrong(place, str(error))
                continue
            known = plant.parameters[full]
            if not known.lower <= values[full] <= known.upper:
                text.wrong(place, f"{section[key]} is out of bounds", expected=_bounds(known, full))
            elif full in absent:
                text.wrong(place, f"has a value, but [effects] removes {absent[full]}")
            elif full == AMBIENT:
                ambient_pa = values[full]
    return values


def _bounds(known: Parameter, full: str) -> str:
    """From where to where a parameter may lie."""
    if known.upper == inf:
        return f"at least {written(known.lower, full)}"
    return f"{written(known.lower, full).split(' ')[0]} to {written(known.upper, full)}"


def _known(
    text: RigText,
    place: tuple[str, ...],
    plant: Plant,
    names: Mapping[str, tuple[str, ...]],
    taken: Mapping[str, object],
) -> tuple[str, ...]:
    """Full names of a parameter as typed; none, and a complaint, if unknown or named twice."""
    key = place[-1]
    if key not in names:
        text.unknown(place, plant.name, _same_member(key, names))
        return ()
    if any(full in taken for full in names[key]):
        text.wrong(place, f"is named twice ({listed(map(public_name, names[key]))})")
        return ()
    return names[key]


def _same_member(key: str, names: Mapping[str, tuple[str, ...]]) -> list[str]:
    """The names of the member that was meant, or all."""
    same = [name for name in names if name.rpartition(".")[0] == key.rpartition(".")[0]]
    return same or list(names)


def _deviations(text: RigText, plant: Plant, values: Mapping[str, float]) -> dict[str, float]:
    """Standard deviations in SI by full name; complaints go to ``text``."""
    names, found = parameter_names(plant), {}
    for key, typed in text.flat("uncertainty").items():
        place = ("uncertainty", key)
        for full in _known(text, place, plant, names, found):
            try:
                found[full] = deviation(typed, full, values[full])
            except UnitError as error:
                text.wrong(place, str(error))
    return found


def _fixed(text: RigText, plant: Plant) -> frozenset[str]:
    text.keys_among(("fixed",), text.table("fixed"), ("names",))
    names, found = parameter_names(plant), set()
    for item in text.names(("fixed", "names")):
        if item not in names:
            text.unknown(("fixed", "names"), plant.name, _same_member(item, names), item)
        elif found & set(names[item]):
            text.wrong(("fixed", "names"), "is named twice", item=item, expected="it once")
        found.update(names.get(item, ()))
    return frozenset(found)
