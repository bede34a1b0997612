"""The gas of one chamber by itself: piston held, ports plugged, with the plant's own heat law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workbench.effects import ChamberLeak, ConstantWallHeat
from workbench.errors import InputError, Message
from workbench.parts import Atmosphere, Chamber, Supply
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.vessel import Vessel

STILL_M = 2e-4  # a piston that stays within is held
BEFORE = 5  # samples at the start, before the push


def pressed_chamber(plant: Plant, recording: Recording) -> Chamber | Vessel:
    """The gas volume whose recorded pressure moves most.

    Raises
    ------
    InputError
        If the plant has no chamber whose pressure is recorded.
    """
    moved = {
        part: float(np.ptp(recording[f"{part.name}.pressure_pa"]))
        for part in plant.parts
        if isinstance(part, Chamber | Vessel) and f"{part.name}.pressure_pa" in recording.channels
    }
    if not moved:
        what = "has no chamber whose pressure is recorded"
        raise InputError(Message(what, plant.name, "a drive, a tank or a closed chamber"))
    return max(moved, key=lambda part: moved[part])


def position_channel(chamber: Chamber) -> str:
    """The channel that says where the piston of a chamber is."""
    return f"{chamber.body}.position_m"


def geometry(plant: Plant, chamber: Chamber | Vessel, position_m: float) -> tuple[float, float]:
    """Volume and surface of the wall with the piston in a place, as the plant has them."""
    names = [f"{chamber.name}.volume_m3", f"{chamber.name}.surface_m2"]
    x = plant.initial.copy()
    if isinstance(chamber, Chamber):
        x[list(plant.state_list).index(position_channel(chamber))] = position_m
    volume, surface = plant.model.quantities(*names)(x, *plant.nominal).full().ravel()
    return float(volume), float(surface)


def kept_share(
    plant: Plant, chamber: Chamber | Vessel, recording: Recording, volume_m3: float, end_pa: float
) -> float:
    """The gas at the end, in this volume, over that before the push; 1 of a vessel."""
    if isinstance(chamber, Vessel):
        return 1.0
    begun_m3, _ = geometry(plant, chamber, float(recording[position_channel(chamber)][0]))
    before_pa = float(np.mean(recording[f"{chamber.name}.pressure_pa"][:BEFORE]))
    return end_pa * volume_m3 / (before_pa * begun_m3)


def held_position_m(chamber: Chamber | Vessel, recording: Recording) -> float:
    """Where the piston rests at the end: the mean of the last tenth; NaN of a vessel."""
    if isinstance(chamber, Vessel):
        return float("nan")
    position = recording[position_channel(chamber)]
    return float(np.nanmean(position[-max(len(position) // 10, 1) :]))


def plugged(plant: Plant, chamber: Chamber | Vessel, volume: float, surface: float) -> Plant:
    """The chamber as a rigid vessel with the plant's own heat law and a leak; no valve, no body.

    Raises
    ------
    InputError
        If the plant has no law of heat for this chamber.
    """
    heats = [e for e in plant.effects if isinstance(e, ConstantWallHeat)]
    heats = [e for e in heats if chamber.name in e.chambers]
    if not heats:
        what = f"has no wall_heat at {chamber.name}"
        raise InputError(Message(what, plant.name, "a plant that exchanges heat with its wall"))
    vessel = Vessel(
        name=chamber.name,
        volume_m3=volume,
        surface_m2=surface,
        gas_constant_j_kg_k=chamber.gas_constant_j_kg_k,
        level=chamber.level,
        initial_temperature_k=chamber.initial_temperature_k,
    )
    return Plant(
        name=f"{plant.name}, {chamber.name} plugged",
        parts=(*_of(plant, Supply | Atmosphere), vessel),
        effects=(
            replace(heats[0], chambers=(chamber.name,)),
            ChamberLeak(name="chamber_leak", chamber=chamber.name),
        ),
        measured=(f"{chamber.name}.pressure_pa",),
    )


def _of(plant: Plant, kind: type) -> Sequence:
    return [part for part in plant.parts if isinstance(part, kind)]
