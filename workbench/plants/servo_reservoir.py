"""The identification rig of paper 002: one port of the servo drive's valve and a tank.

Charging from 5 to 10 V and discharging from 5 to 0 V, the other ports blocked; the tank exchanges
heat with its wall.  Valve and gas are those of :mod:`workbench.plants.servo_drive`.

* E002-10: the tank holds 0.344 litres, not cubic metres; its surface of 0.0342 m2 fits that.

Source: physics.md 2.4 (``servo_reservoir``): volume 0.344e-3 m3, 17.275 W/(m2 K), 3.419e-2 m2.
"""

from __future__ import annotations

from workbench.effects import ChamberLeak, HeatedWall, SupplyDroop
from workbench.effects.sensors import sensor_flaws
from workbench.parts import Atmosphere, Supply
from workbench.plant import Plant, Signal
from workbench.plants.servo_drive import (
    ATMOSPHERE_PA,
    CENTRE_V,
    COMMAND,
    GAS_CONSTANT_J_KG_K,
    RANGE_V,
    ROOM_K,
    SUPPLY_PA,
    servo_valve,
)
from workbench.vessel import Vessel

PRESSURE = "reservoir.pressure_pa"


def servo_reservoir() -> Plant:
    """The tank at ambient pressure; what the rig may lack stands at null."""
    return Plant(
        name="servo_reservoir",
        parts=(
            Supply(name="supply", pressure_pa=SUPPLY_PA, temperature_k=ROOM_K),
            Atmosphere(name="atmosphere", pressure_pa=ATMOSPHERE_PA),
            Vessel(
                name="reservoir",
                volume_m3=0.344e-3,
                surface_m2=3.419e-2,
                gas_constant_j_kg_k=GAS_CONSTANT_J_KG_K,
                initial_pressure_pa=ATMOSPHERE_PA,
                initial_temperature_k=ROOM_K,
            ),
        ),
        effects=(
            *servo_valve("reservoir"),
            HeatedWall(name="wall_heat", chambers=("reservoir",), coefficient_w_m2_k=17.275),
            ChamberLeak(name="chamber_leak", chamber="reservoir"),
            SupplyDroop(name="supply_droop"),
            *sensor_flaws({PRESSURE: ATMOSPHERE_PA}),
        ),
        commands=(Signal(COMMAND, nominal=CENTRE_V, lower=0.0, upper=RANGE_V),),
        optional_inputs=(Signal("supply.pressure_pa", nominal=SUPPLY_PA),),
        measured=(PRESSURE,),
    )
