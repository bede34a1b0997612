"""The soft joint of paper 004 as a gain and one time constant: tau dp/dt = K A a(u) f.

The time constant and the area map are fitted to the first-principles model of
:mod:`workbench.plants.soft_joint`, physics.md 2.6.  The linear map of the paper is the valve with
``SharpOpening()``, no overlap and 0.075 s, see :func:`linear_map`.
"""

from __future__ import annotations

from dataclasses import replace

from workbench.effects import (
    CommandDelay,
    ParametricValve,
    PwmLag,
    ValveHysteresis,
)
from workbench.effects.sensors import sensor_flaws
from workbench.parts import Atmosphere, Supply
from workbench.plant import Plant, Signal
from workbench.plants.soft_joint import (
    ATMOSPHERE_PA,
    COMMAND,
    NEUTRAL,
    OVERLAP,
    PRESSURE,
    SUPPLY_PA,
)
from workbench.spool import SharpOpening
from workbench.vessel import LumpedPressure

AREA_MAP_S, LINEAR_MAP_S = 0.05, 0.075


def soft_joint_parametric() -> Plant:
    """The bellows with the area map; what it may lack stands at null."""
    return Plant(
        name="soft_joint_parametric",
        parts=(
            Supply(name="supply", pressure_pa=SUPPLY_PA),
            Atmosphere(name="atmosphere", pressure_pa=ATMOSPHERE_PA),
            LumpedPressure(name="bellows", initial_pressure_pa=ATMOSPHERE_PA),
        ),
        effects=(
            CommandDelay(name="command_delay", signal=COMMAND),
            ValveHysteresis(name="valve_hysteresis", signal=COMMAND, span=1.0, initial=NEUTRAL),
            PwmLag(name="valve_lag", signal=COMMAND, initial_v=NEUTRAL),
            ParametricValve(
                name="valve",
                chamber="bellows",
                overlap_share=OVERLAP,
                time_constant_s=AREA_MAP_S,
            ),
            *sensor_flaws({PRESSURE: ATMOSPHERE_PA}),
        ),
        commands=(Signal(COMMAND, nominal=NEUTRAL, lower=0.0, upper=1.0),),
        optional_inputs=(Signal("supply.pressure_pa", nominal=SUPPLY_PA),),
        measured=(PRESSURE,),
    )


def linear_map(plant: Plant) -> Plant:
    """The same plant with a = 2 c - 1 and the time constant that belongs to it."""
    valve = next(e for e in plant.effects if isinstance(e, ParametricValve))
    linear = replace(valve, opening=SharpOpening(), overlap_share=0.0, time_constant_s=LINEAR_MAP_S)
    return replace(plant, effects=tuple(linear if e is valve else e for e in plant.effects))
