"""The catalogue of effects.  A new effect is one file here and one line below."""

from workbench.effects.bristle_friction import BristleFriction
from workbench.effects.five_port_valve import FivePortValve
from workbench.effects.forces import (
    ConstantForce,
    EndCushion,
    EndStops,
    RodEnd,
    SpringForce,
    Weight,
)
from workbench.effects.joints import JointFriction, LinkGravity
from workbench.effects.leaks import ChamberLeak, PistonLeak
from workbench.effects.proportional_valve import ProportionalValve
from workbench.effects.sensor_offset import (
    AngleSensorOffset,
    PositionSensorOffset,
    PressureSensorOffset,
)
from workbench.effects.stribeck_friction import StribeckFriction
from workbench.effects.supply_droop import SupplyDroop
from workbench.effects.timing import ClockDrift, PacketPause, SensorDelay
from workbench.effects.valve_command import CommandDelay, DeadZone, ValveLag, ValveOffset
from workbench.effects.wall_heat import WallHeat

CATALOGUE = (
    AngleSensorOffset,
    BristleFriction,
    ChamberLeak,
    ClockDrift,
    CommandDelay,
    ConstantForce,
    DeadZone,
    EndCushion,
    EndStops,
    FivePortValve,
    JointFriction,
    LinkGravity,
    PacketPause,
    PistonLeak,
    PositionSensorOffset,
    PressureSensorOffset,
    ProportionalValve,
    RodEnd,
    SensorDelay,
    SpringForce,
    StribeckFriction,
    SupplyDroop,
    ValveLag,
    ValveOffset,
    WallHeat,
    Weight,
)
