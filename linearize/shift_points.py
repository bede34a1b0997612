"""Where the modes of a gear shift are linearised, and whether its supply moves the piston at all.

Paper 003 names no operating points: they are chosen, 5 bar in a chamber that is charged and 3 bar
in one that vents, for the 9 bar of its plant.  Under a lower supply both lie as high between the
air and the supply as they do there, so that each valve passes what its mode is named after; under
a higher one they stay.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from linearize.equilibrium import NoOperatingPointError
from linearize.reduction import DesignModel
from linearize.shifting import (
    DETENT,
    HEAT,
    INSIDE_M,
    POSITION,
    PRESSURES,
    VELOCITY,
    shift_model,
)
from workbench.plant import Plant
from workbench.plants.gearbox import SUPPLY_PA

SLIDING_M_S = 0.1  # dry friction is all there: tanh(100)


@dataclass(frozen=True, kw_only=True)
class ShiftPoints:
    """Where the modes of a shift are linearised, besides the place.

    charging_pa      pressure of a chamber whose valve joins it to the supply
    venting_pa       pressure of one whose valve joins it to the air
    velocity_m_s     speed of the main piston
    """

    charging_pa: float = 5e5
    venting_pa: float = 3e5
    velocity_m_s: float = 0.0

    @property
    def by_valve(self) -> tuple[tuple[str, float], tuple[str, float]]:
        """Label and pressure of a released valve, and of an energised one."""
        return ("vents", self.venting_pa), ("charges", self.charging_pa)


def shift_points(model: DesignModel) -> ShiftPoints:
    """The points at the supply of a model's own plant."""
    usual, (air_pa, supply_pa) = ShiftPoints(), _ends_pa(model)
    if supply_pa >= SUPPLY_PA:
        return usual
    share = (supply_pa - air_pa) / (SUPPLY_PA - air_pa)
    return ShiftPoints(
        charging_pa=air_pa + share * (usual.charging_pa - air_pa),
        venting_pa=air_pa + share * (usual.venting_pa - air_pa),
    )


def require_moved(plant: Plant) -> None:
    """Refuse a supply below that of the paper's plant that does not move the piston.

    The modes leave dry friction out, and would tell of motion that there is not.

    Raises
    ------
    NoOperatingPointError
        If the whole supply does not push the piston on while it slides, either way from Neutral.
    """
    model = shift_model(plant, (DETENT, HEAT))
    air_pa, supply_pa = _ends_pa(model)
    if supply_pa < SUPPLY_PA and min(_pushes(model, air_pa, supply_pa)) <= 0.0:
        what = "one chamber at the supply and one at the air do not overcome dry friction"
        raise NoOperatingPointError(f"{plant.name}: {what}")


def _ends_pa(model: DesignModel) -> tuple[float, float]:
    """Pressure of the air and of the supply."""
    read = model.quantities("atmosphere.pressure_pa", "supply.pressure_pa")
    air_pa, supply_pa = read(model.initial, np.zeros(len(model.commands))).full().ravel()
    return float(air_pa), float(supply_pa)


def _pushes(model: DesignModel, air_pa: float, supply_pa: float) -> Iterator[float]:
    """Acceleration along its way of a piston that slides, both ways on both sides of Neutral."""
    row, still = model.states.index(VELOCITY), np.zeros(len(model.commands))
    for way, side in product((-1.0, 1.0), repeat=2):
        pushed = (supply_pa, air_pa) if way > 0.0 else (air_pa, supply_pa)
        at = dict(zip(PRESSURES, pushed, strict=True))
        at |= {POSITION: side * INSIDE_M, VELOCITY: way * SLIDING_M_S}
        x = np.array([at[name] for name in model.states])
        yield way * float(model.f(x, still)[0][row])
