"""Modes of a volume behind one valve: {fill, vent} x {choked, subsonic}.

Source: physics.md 4.3 (soft joint; the parametric one is bilinear and has no flow regimes).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

import numpy as np

from linearize.axes import DRIVE
from linearize.cuts import Interval, Region
from linearize.equilibrium import NoOperatingPointError, OperatingPoint, operating_point
from linearize.modes import Box, HybridModel, hybrid_modes
from linearize.reduction import DesignModel, LeftOut, closed_command, design_model
from linearize.regimes import flow_regimes
from linearize.valve_sample import AMBIENT, SUPPLY
from workbench.plant import Plant
from workbench.plants.servo_reservoir import PRESSURE as TANK
from workbench.plants.soft_joint import COMMAND as PWM
from workbench.plants.soft_joint import NEUTRAL
from workbench.plants.soft_joint import PRESSURE as BELLOWS

BACKFLOW = LeftOut(
    "choked flow back into the supply", "no mode", "no vessel comes to twice the supply pressure"
)


@dataclass(frozen=True)
class Filling:
    """A vessel and its valve: names, the command that neither fills nor vents, and openings.

    ``shut`` is the half-width of the interval of the command in which the valve is shut, 0 where
    it never is; ``opening`` leads from the centre to the points of the others.
    """

    pressure: str
    command: str
    centre: float
    opening: float
    shut: float = 0.0

    def valve_cut(self) -> tuple[Interval, ...]:
        """The command that vents, the one that shuts where there is one, and that which fills."""
        low, high = self.centre - self.shut, self.centre + self.shut
        vent = Interval("vent", -inf, low, self.centre - self.opening)
        fill = Interval("fill", high, inf, self.centre + self.opening)
        shut = (Interval("shut", low, high, self.centre),) if self.shut else ()
        return vent, *shut, fill

    def point(self, model: DesignModel, box: Box) -> OperatingPoint:
        """The middle of a flow regime; between the ends where there is none; at rest when shut."""
        points = {name: region.point for name, region in box.items()}
        if self.shut and points[self.command] == self.centre:
            return operating_point(model, points, (self.pressure,), (self.pressure,))
        ends = model.quantities("supply.pressure_pa", "atmosphere.pressure_pa")
        middle = float(np.mean(ends(model.initial, model.plant.nominal[0]).full()))
        return operating_point(model, {self.pressure: middle} | points)


def bellows(plant: Plant) -> Filling:
    """The soft joint's, whose valve never shuts; the opening is *chosen*."""
    centre = NEUTRAL + float(plant.values["valve.offset_share"])
    return Filling(BELLOWS, PWM, centre, opening=0.2)


def reservoir(plant: Plant) -> Filling:
    """The tank's on the servo drive's valve, with the openings of the drive's modes."""
    return Filling(TANK, DRIVE.command, closed_command(plant), DRIVE.opening, DRIVE.middle)


def filling_modes(plant: Plant, filling: Filling) -> HybridModel:
    """Vent and fill, each with choked and with subsonic flow, and shut where the valve can be.

    The points lie in the middle of each regime: filling and venting end only where the pressure
    meets the supply's or the atmosphere's.

    Raises
    ------
    NoOperatingPointError
        If the supply is not above the atmosphere: there is nothing between to fill.
    """
    if plant.values.get(SUPPLY, inf) <= plant.values.get(AMBIENT, 0.0):
        raise NoOperatingPointError(f"{plant.name}: the supply is not above the atmosphere")
    model, modes = design_model(plant), []
    for valve in filling.valve_cut():
        cuts: dict[str, tuple[Region, ...]] = {filling.command: (valve,)}
        if valve.label != "shut":
            cuts |= _regimes(model, filling, {filling.command: valve.point})
        modes += hybrid_modes(plant, cuts, filling.point, model).modes
    regimes = any(filling.pressure in mode.box for mode in modes)
    return HybridModel(plant, model, tuple(modes), (BACKFLOW,) if regimes else ())


def _regimes(
    model: DesignModel, filling: Filling, sent: Mapping[str, float]
) -> dict[str, tuple[Region, ...]]:
    """The pressure by flow regimes; by none where the plant has no flow, only a time constant."""
    chamber = filling.pressure.rpartition(".")[0]
    if not any(path.balance == chamber for path in model.plant.model.paths):
        return {}
    regimes = flow_regimes(model, filling.pressure, sent)
    return {filling.pressure: regimes} if regimes else {}
