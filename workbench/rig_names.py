"""What a rig file may call the parameters of a plant."""

from __future__ import annotations

from collections import defaultdict

from workbench.plant import Plant
from workbench.units import public_name


def parameter_names(plant: Plant) -> dict[str, tuple[str, ...]]:
    """Full names of parameters by what a rig file may call them.

    ``slide.mass``; for a cause that lives inside a member ``coulomb_friction.coulomb_force``; for
    all places of a cause at once ``chamber_leak.area``.
    """
    names: dict[str, tuple[str, ...]] = {public_name(full): (full,) for full in plant.values}
    aliases: dict[str, set[str]] = defaultdict(set)
    for candidate in plant.candidates.values():
        for full in filter(None, (candidate.strength, *candidate.forms, candidate.held)):
            field_name = public_name(full).rpartition(".")[2]
            aliases[f"{candidate.name}.{field_name}"].add(full)
            aliases[f"{candidate.cause.name}.{field_name}"].add(full)
    return {alias: tuple(sorted(full)) for alias, full in aliases.items()} | names
