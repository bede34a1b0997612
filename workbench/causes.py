"""Every cause there is, whether an effect or a part carries it."""

from __future__ import annotations

from workbench.effect import Cause
from workbench.effects import CATALOGUE
from workbench.floating_piston import ControlChamber
from workbench.parts import PARTS
from workbench.plant import Plant
from workbench.vessel import Bellows


def all_causes() -> dict[str, Cause]:
    """Causes by public name: those of the catalogue, and those that sit on parts (a mass)."""
    kinds = (*CATALOGUE, *PARTS, ControlChamber, Bellows)
    return {cause.name: cause for kind in kinds for cause in kind.causes}


def why_not(plant: Plant, name: str) -> str:
    """Why a plant has no such candidate, ``effect`` or ``effect@place``."""
    if name.partition("@")[0] in all_causes():
        return f"{plant.name} has no place for this effect"
    return "there is no such effect"
