"""The catalogue of effects.  A new effect is one file here and one line below."""

from workbench.effects.bellows_creep import BellowsCreep
from workbench.effects.bristle_friction import BristleFriction
from workbench.effects.five_port_valve import FivePortValve
from workbench.effects.forces import ConstantForce, EndCushion, EndStops, SpringForce, Weight
from workbench.effects.leaks import ChamberLeak, PistonLeak
from workbench.effects.line_delay import LineDelay
from workbench.effects.sensor_offset import (
    PositionSensorOffset,
    PressureSensorOffset,
)
from workbench.effects.sensor_response import SensorLag, SensorScale
from workbench.effects.stribeck_friction import StribeckFriction
from workbench.effects.supply_droop import SupplyDroop
from workbench.effects.three_port_valve import ParametricValve, ThreePortValve
from workbench.effects.valve_command import (
    CommandDelay,
    DeadZone,
    PwmLag,
    StuckBand,
    ValveLag,
    ValveOffset,
)
from workbench.effects.valve_hysteresis import ValveHysteresis
from workbench.effects.wall_heat import HeatedWall, WallHeat

CATALOGUE = (
    BellowsCreep,
    BristleFriction,
    ChamberLeak,
    CommandDelay,
    ConstantForce,
    DeadZone,
    EndCushion,
    EndStops,
    FivePortValve,
    HeatedWall,
    LineDelay,
    ParametricValve,
    PistonLeak,
    PositionSensorOffset,
    PressureSensorOffset,
    PwmLag,
    SensorLag,
    SensorScale,
    SpringForce,
    StribeckFriction,
    StuckBand,
    SupplyDroop,
    ThreePortValve,
    ValveHysteresis,
    ValveLag,
    ValveOffset,
    WallHeat,
    Weight,
)
