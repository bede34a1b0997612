"""What there is, as text: plants, effects and studies."""

from __future__ import annotations

import inspect
from collections.abc import Sequence

from studies.text import columns, number, shown
from workbench.candidate import TOGETHER
from workbench.causes import all_causes, why_not
from workbench.errors import InputError, Message, listed, nearest
from workbench.plant import Plant
from workbench.plant_files import plant_named
from workbench.plants import PLANTS
from workbench.rig import Rig, default_rig, parameter_names
from workbench.rig_laws import is_law, law_terms
from workbench.units import display_scale, display_unit, public_name


def plants_text() -> str:
    """One line per plant: name, commands and outputs, and what it is."""
    rows = []
    for name, build in PLANTS.items():
        plant = build()
        given = [*(s.name for s in plant.commands), *(s.name for s in plant.measured_inputs)]
        module = inspect.getmodule(build)
        what = (inspect.getdoc(module) or "").split("\n\n")[0].replace("\n", " ")
        rows.append((name, _names(given), _names(plant.measured), what))
    return columns(("plant", "inputs", "outputs", "what it is"), rows)


def effects_text() -> str:
    """One line per cause of the catalogue: name, balance, and the plants that have a place."""
    built = {name: build() for name, build in PLANTS.items()}
    rows = []
    for name, cause in sorted(all_causes().items()):
        owners = [
            p
            for p, plant in built.items()
            if any(c.cause.name == name for c in plant.candidates.values())
        ]
        rows.append((name, cause.balance.value, ", ".join(owners) or "-", cause.shown_by))
    return columns(("effect", "balance", "plants", "shown by"), rows)


def effects_of_plant_text(name: str) -> str:
    """One line per cause that a plant has a place for, with what is known of it.

    Raises
    ------
    InputError
        If there is no such plant.
    """
    plant = plant_named(name)
    rows = []
    for full, candidate in sorted(plant.candidates.items()):
        known, cause = plant.parameters[candidate.strength], candidate.cause
        unit = shown(0.0, candidate.strength).partition(" ")[2] or "-"
        null, typical, now = (
            shown(value, candidate.strength).partition(" ")[0]
            for value in (known.null or 0.0, known.typical, plant.values[candidate.strength])
        )
        present = "absent" if plant.values[candidate.strength] == known.null else now
        row = (full, null, typical, unit, present, cause.balance.value, cause.kind.value)
        rows.append((*row, cause.source))
    head = ("effect", "null", "typical", "unit", "value", "balance", "kind", "source")
    return columns(head, rows)


def parameters_text(name: str) -> str:
    """One line per parameter of a plant that is not absent: value, unit, standard deviation."""
    return rig_parameters_text(default_rig(name))


def rig_parameters_text(rig: Rig) -> str:
    """One line per parameter of a rig that is not absent: value, unit, standard deviation."""
    plant, rows = rig.plant, []
    for full, value in plant.values.items():
        if value == plant.parameters[full].null:
            continue
        deviation = 0.0 if full in rig.fixed else rig.standard_deviation(full)
        unit = display_unit(full)
        size = number(deviation / display_scale(full).factor) if deviation > 0.0 else "-"
        rows.append((public_name(full), shown(value, full, 6).removesuffix(f" {unit}"), size, unit))
    return columns(("parameter", "value", "standard deviation", "unit"), rows)


def candidate_name(plant: Plant, effect: str, at: str | None) -> str:
    """The full name of an effect or empirical term at its place: ``chamber_leak@chamber_a``.

    Two effects with a plus between them, ``a + b@place``, are a pair.

    Raises
    ------
    InputError
        If the plant has no such effect, or not at this place, with the nearest one; or if it has
        several places and none is named.
    """
    if TOGETHER in effect and not at:
        return TOGETHER.join(candidate_name(plant, each, None) for each in effect.split(TOGETHER))
    name = f"{effect}@{at}" if at else effect
    there = [*plant.candidates, *law_terms(plant)]
    if name in there:
        return name
    places = [full for full in there if full.partition("@")[0] == effect]
    if len(places) == 1 and at is None:
        return places[0]
    if places == [effect]:
        raise InputError(Message("has one place only", effect, "no --at"))
    if places:
        parts = [full.partition("@")[2] for full in places]
        what = "there is no such place" if at else "needs its place"
        expected, near = f"--at with one of {listed(parts)}", nearest(at, parts) if at else ""
        raise InputError(Message(what, name, expected, near))
    known = f"one that `workbench effects {plant.name}` lists"
    near = nearest(name, there)
    if is_law(name):
        known = f"one of {listed(law_terms(plant))}"
    raise InputError(Message(why_not(plant, name), name, known, near))


def full_names(plant: Plant, names: Sequence[str]) -> tuple[str, ...]:
    """Full names of parameters by what a rig file may call them.

    Raises
    ------
    InputError
        With every unknown name and the nearest known one.
    """
    known = parameter_names(plant)
    wrong = [
        Message(f"{plant.name} has no such parameter", name, nearest=nearest(name, known))
        for name in names
        if name not in known
    ]
    if wrong:
        raise InputError(*wrong)
    return tuple(full for name in names for full in known[name])


def studies_text() -> str:
    """One line per study: its name, what it asks, its source, and the papers' rows in it."""
    from studies.registry import STUDIES

    rows = [
        (study.name, study.question, study.source, ", ".join(study.rows) or "-")
        for study in STUDIES.values()
    ]
    return columns(("study", "what it asks", "source", "rows"), rows)


def _names(full: list[str] | tuple[str, ...]) -> str:
    return ", ".join(map(public_name, full)) or "-"
