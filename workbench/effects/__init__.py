"""The catalogue of effects.  A new effect is one file here and one line below."""

from workbench.effects.bellows_creep import BellowsCreep
from workbench.effects.bristle_friction import BristleFriction
from workbench.effects.detent import Detent
from workbench.effects.five_port_valve import FivePortValve
from workbench.effects.forces import (
    ConstantForce,
    EndCushion,
    EndStops,
    RodEnd,
    SpringForce,
    Weight,
)
from workbench.effects.friction_thermal import ThermalFriction
from workbench.effects.joints import JointFriction, LinkGravity
from workbench.effects.leaks import ChamberLeak, HairlineLeak, PistonLeak
from workbench.effects.lever_link import LeverLink
from workbench.effects.line_delay import LineDelay
from workbench.effects.piston_contact import PistonContact
from workbench.effects.proportional_valve import ProportionalValve
from workbench.effects.sensor_offset import (
    AngleSensorOffset,
    PositionSensorOffset,
    PressureSensorOffset,
)
from workbench.effects.sensor_response import SensorLag, SensorScale
from workbench.effects.solenoid_valve import SolenoidValve
from workbench.effects.stribeck_friction import StribeckFriction
from workbench.effects.supply_droop import SupplyDroop
from workbench.effects.synchroniser import Synchroniser
from workbench.effects.three_port_valve import ParametricValve, ThreePortValve
from workbench.effects.timing import ClockDrift, PacketPause, SensorDelay
from workbench.effects.valve_command import (
    CommandDelay,
    DeadZone,
    PwmLag,
    StuckBand,
    ValveLag,
    ValveOffset,
)
from workbench.effects.valve_hysteresis import ValveHysteresis
from workbench.effects.wall_heat import ConstantWallHeat, HeatedWall, StillWall, WallHeat

CATALOGUE = (
    AngleSensorOffset,
    BellowsCreep,
    BristleFriction,
    ChamberLeak,
    ClockDrift,
    CommandDelay,
    ConstantForce,
    ConstantWallHeat,
    DeadZone,
    Detent,
    EndCushion,
    EndStops,
    FivePortValve,
    HairlineLeak,
    HeatedWall,
    JointFriction,
    LeverLink,
    LineDelay,
    LinkGravity,
    PacketPause,
    ParametricValve,
    PistonContact,
    PistonLeak,
    PositionSensorOffset,
    PressureSensorOffset,
    ProportionalValve,
    PwmLag,
    RodEnd,
    SensorDelay,
    SensorLag,
    SensorScale,
    SolenoidValve,
    SpringForce,
    StillWall,
    StribeckFriction,
    StuckBand,
    SupplyDroop,
    Synchroniser,
    ThermalFriction,
    ThreePortValve,
    ValveHysteresis,
    ValveLag,
    ValveOffset,
    WallHeat,
    Weight,
)
