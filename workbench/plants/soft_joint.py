"""One bellows of the soft joint of paper 004 from first principles: a spool valve and a volume.

The joint is bolted in place, so the volume is constant but for what the wall gives way.  The gas
has one temperature in the flow terms (level 3 of physics.md 1.2).  Errata that matter here:

* E004-1: Eq. 1 prints R T with R = 8.31 J/(mol K) and flows in kg/s; the molar mass is missing.
  With Z R T/M the fill takes 90..530 ms, as printed 3..18 s: the likely reason why the paper finds
  its first-principles model too slow.
* E004-2: the flow has an infinite slope at equal pressures; there it is linear here.
* E004-6: smax needs a length scale, and never shuts: both paths leak 0.06 mm2 at the centre.
* *Chosen*: volume, supply, temperature, the edges of the spool and their rounding, and the line
  from PWM to current, i = 2 (pwm - 0.5) A, so that the command (i + 1)/2 is the PWM itself.

Source: physics.md 2.6.  The mass of gas is no state: m R T = p V does not hold at this level, where
one temperature stands for an adiabatic balance; energy is conserved.
"""

from __future__ import annotations

from workbench.effects import (
    BellowsCreep,
    ChamberLeak,
    CommandDelay,
    LineDelay,
    PwmLag,
    SupplyDroop,
    ThreePortValve,
    ValveHysteresis,
)
from workbench.effects.sensors import sensor_flaws
from workbench.gas_volume import ConstantTemperatureLevel
from workbench.parts import Atmosphere, Supply
from workbench.plant import Plant, Signal
from workbench.vessel import Bellows

COMPRESSIBILITY, MOLAR_J_MOL_K, MOLAR_MASS_KG_MOL = 0.99, 8.31, 0.029
GAS_CONSTANT_J_KG_K = COMPRESSIBILITY * MOLAR_J_MOL_K / MOLAR_MASS_KG_MOL
SUPPLY_PA = 5.5e5
ATMOSPHERE_PA = 1.013e5
ROOM_K = 293.15
NEUTRAL = 0.5
OVERLAP = 0.02  # c_f = 0.52, c_v = 0.48

COMMAND, PRESSURE = "valve.pwm", "bellows.pressure_pa"


def soft_joint() -> Plant:
    """The bellows with its valve; what it may lack stands at null."""
    return Plant(
        name="soft_joint",
        parts=(
            Supply(name="supply", pressure_pa=SUPPLY_PA, temperature_k=ROOM_K),
            Atmosphere(name="atmosphere", pressure_pa=ATMOSPHERE_PA, temperature_k=ROOM_K),
            Bellows(
                name="bellows",
                volume_m3=0.5e-3,
                gas_constant_j_kg_k=GAS_CONSTANT_J_KG_K,
                level=ConstantTemperatureLevel(ROOM_K),
                initial_pressure_pa=ATMOSPHERE_PA,
            ),
        ),
        effects=(
            CommandDelay(name="command_delay", signal=COMMAND),
            LineDelay(name="line_delay", signal=COMMAND, chambers=("bellows",)),
            ValveHysteresis(name="valve_hysteresis", signal=COMMAND, span=1.0, initial=NEUTRAL),
            PwmLag(name="valve_lag", signal=COMMAND, initial_v=NEUTRAL),
            ThreePortValve(name="valve", chamber="bellows", overlap_share=OVERLAP),
            BellowsCreep(name="bellows_creep", chamber="bellows"),
            ChamberLeak(name="chamber_leak", chamber="bellows"),
            SupplyDroop(name="supply_droop"),
            *sensor_flaws({PRESSURE: ATMOSPHERE_PA}),
        ),
        commands=(Signal(COMMAND, nominal=NEUTRAL, lower=0.0, upper=1.0),),
        optional_inputs=(Signal("supply.pressure_pa", nominal=SUPPLY_PA),),
        measured=(PRESSURE,),
    )
