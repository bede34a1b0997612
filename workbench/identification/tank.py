"""A tank behind a valve: which plants are one, and what every recording of one must show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.effects import DeadZone, FivePortValve
from workbench.errors import InputError, Message
from workbench.identification.result import unfit
from workbench.parts import Body
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig

SUPPLY = "supply.pressure_pa"
AMBIENT = "atmosphere.pressure_pa"
STEADY_SUPPLY = 0.1  # of its mean: the law of flow takes it as recorded, but without its own lag
SAME_END = 0.05  # of supply minus ambient


@dataclass(frozen=True)
class TankOnValve:
    """The plant of a recording, with its dead zone, and the names of valve and dead zone."""

    plant: Plant
    valve: str
    zone: str

    def ends_pa(self, recording: Recording) -> tuple[float, float]:
        """Supply, as recorded or else the rig's, and ambient."""
        own = self.plant.values
        supply = recording[SUPPLY].mean() if SUPPLY in recording.channels else own[SUPPLY]
        return float(supply), own[AMBIENT]

    def span_pa(self, recording: Recording) -> float:
        """Supply minus ambient."""
        supply, ambient = self.ends_pa(recording)
        return supply - ambient


def tank_on_valve(rig: Rig, recording: Recording) -> TankOnValve:
    """The rig's tank with what a recording carries, lean but for the dead zone.

    Raises
    ------
    InputError
        If the plant is no tank behind a valve with a dead zone.
    """
    zones = [e.name for e in rig.plant.effects if isinstance(e, DeadZone)]
    valves = [e.name for e in rig.plant.effects if isinstance(e, FivePortValve)]
    if not (zones and valves) or any(isinstance(part, Body) for part in rig.plant.parts):
        what = "is no tank behind a valve with a dead zone"
        raise InputError(Message(what, rig.plant.name, "a rig of servo_reservoir"))
    plant = rig.fit_for(recording).lean(keep=zones)
    return TankOnValve(plant, valves[0], zones[0])


def steady_supply(recording: Recording) -> None:
    """Refuse a recording whose supply gives way, where that is recorded.

    Raises
    ------
    InputError
        With how far it moves.
    """
    if SUPPLY not in recording.channels:
        return
    low, mean, high = (float(f(recording[SUPPLY])) for f in (np.min, np.mean, np.max))
    if high - low > STEADY_SUPPLY * mean:
        what = f"the supply is not constant: supply.pressure moves by {(high - low) / 1e5:.2g} bar"
        expected = f"it within {STEADY_SUPPLY / 2:.0%} of its mean, from a buffer before the valve"
        raise unfit(recording, what, expected)


def rests_at(tank: TankOnValve, recording: Recording, level_pa: float, charged: bool) -> None:
    """Refuse a recording whose tank comes to rest elsewhere than at the supply or at ambient.

    Raises
    ------
    InputError
        With both pressures.
    """
    supply, ambient = tank.ends_pa(recording)
    end, word = (supply, "supply") if charged else (ambient, "ambient")
    if abs(level_pa - end) > SAME_END * (supply - ambient):
        what = (
            f"the tank comes to rest at {level_pa / 1e5:.3g} bar, its {word} is {end / 1e5:.3g} bar"
        )
        expected = f"the same: {word} pressure as it was, in rig or recording, and all absolute"
        raise unfit(recording, what, expected)
