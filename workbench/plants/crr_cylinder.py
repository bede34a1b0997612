"""The small cylinder and proportional valve of the Compact Rescue Robot, for rig, arm and leg.

Values are those of physics.md 2.1, where the papers print only the valve's offset and transition
and the friction; all else there is *chosen*.  Errata that matter here:

* E000-1: viscous friction is 0.5 lbf s/in = 87.56 N s/m; the printed 4.4 kg/s is rejected.
* E000-2: the Stribeck velocity is 0.1 in/s = 2.54e-3 m/s.
* E000-3, E001-4: the factor of the printed pressure equation is kappa, its temperature that of the
  gas that flows; E001-8: the gas mass is a state.
* E000-4: flow direction follows the pressures.  E000-5: the rod side has its own area and sign.
* E000-7: R is the specific constant of air.  E000-8: the steepness is 1580 s/m.
* E001-5: on a joint the force carries no -m a; the linkage integrates the motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from workbench.effect import Effect
from workbench.effects import (
    BristleFriction,
    ChamberLeak,
    ClockDrift,
    CommandDelay,
    ConstantForce,
    DeadZone,
    EndCushion,
    LineDelay,
    PacketPause,
    PistonLeak,
    ProportionalValve,
    RodEnd,
    SensorDelay,
    SpringForce,
    StuckBand,
    ThermalFriction,
    ValveHysteresis,
    ValveLag,
    ValveOffset,
    WallHeat,
)
from workbench.effects.sensors import sensor_flaws
from workbench.parts import Atmosphere, Chamber, Supply
from workbench.plant import Signal

SUPPLY_PA = 6.5e5
ATMOSPHERE_PA = 1.013e5
ROOM_K = 293.15
BORE_M, ROD_M = 26.99e-3, 7.94e-3
CAP_AREA_M2 = pi / 4 * BORE_M**2
ROD_AREA_M2 = pi / 4 * ROD_M**2
REST_PA = (SUPPLY_PA + ATMOSPHERE_PA) / 2  # input pressure at the valve's centre
OFFSET_V = 5.25
NOMINAL_CENTRE_V = 5.0
FULL_V = 10.0 - OFFSET_V + NOMINAL_CENTRE_V  # behind the offset, where 10 V arrives
CHARGING, DISCHARGING = 0.62, 0.55  # discharge coefficients
MEAN_COEFFICIENT = (CHARGING + DISCHARGING) / 2
COULOMB_N = 13.3
STEEPNESS_S_M = 1580.0
NETWORK_S = 1e-3  # each way


def surroundings() -> tuple[Supply, Atmosphere]:
    """Shop air and the room."""
    return (
        Supply(name="supply", pressure_pa=SUPPLY_PA, temperature_k=ROOM_K),
        Atmosphere(name="atmosphere", pressure_pa=ATMOSPHERE_PA),
    )


def network(outputs: tuple[str, ...], signals: tuple[str, ...]) -> tuple[Effect, ...]:
    """What it does to outputs, and to all signals on their way."""
    return (
        SensorDelay(name="sensor_delay", signals=outputs, delay_s=NETWORK_S),
        PacketPause(name="packet_pause", signals=signals),
        ClockDrift(name="clock_drift", signals=signals),
    )


@dataclass(frozen=True)
class CrrCylinder:
    """One cylinder with its valve; ``suffix`` tells those of a leg apart.

    Attributes
    ----------
    stroke_m
        Of the piston.
    start_m
        Position of the rod at the start.
    """

    stroke_m: float
    start_m: float
    suffix: str = ""

    @property
    def rod(self) -> str:
        return f"rod{self.suffix}"

    @property
    def chambers(self) -> tuple[str, str]:
        return f"cap{self.suffix}", f"rod_side{self.suffix}"

    @property
    def pressures(self) -> tuple[str, str]:
        cap, rod_side = self.chambers
        return f"{cap}.pressure_pa", f"{rod_side}.pressure_pa"

    @property
    def valve(self) -> str:
        return f"valve{self.suffix}"

    @property
    def command(self) -> Signal:
        return Signal(f"{self.valve}.command_v", nominal=OFFSET_V, lower=0.0, upper=10.0)

    def parts(self) -> tuple[Chamber, Chamber]:
        """Both chambers, at the pressure that the centred valve holds."""
        common = dict(
            body=self.rod,
            stroke_m=self.stroke_m,
            dead_volume_m3=6e-6,
            initial_pressure_pa=REST_PA,
            initial_temperature_k=ROOM_K,
            initial_position_m=self.start_m,
        )
        cap, rod_side = self.chambers
        return (
            Chamber(name=cap, side=+1, area_m2=CAP_AREA_M2, **common),
            Chamber(name=rod_side, side=-1, area_m2=CAP_AREA_M2 - ROD_AREA_M2, **common),
        )

    def effects(self) -> tuple[Effect, ...]:
        """Valve, friction, and what the cylinder may lack."""
        cap, rod_side = self.chambers
        at = self._named
        return (
            *self._valve_effects(),
            WallHeat(name=at("wall_heat"), chambers=self.chambers),
            self._friction(),
            ThermalFriction(
                name=at("friction_thermal"),
                body=self.rod,
                rubbing_force_n=COULOMB_N,
                steepness_s_m=STEEPNESS_S_M,
            ),
            RodEnd(name=at("rod_end"), body=self.rod, area_m2=ROD_AREA_M2),
            *(ChamberLeak(name=f"chamber_leak@{c}", chamber=c) for c in self.chambers),
            PistonLeak(name=at("piston_leak"), first=cap, second=rod_side),
            ConstantForce(name=at("constant_force"), body=self.rod),
            SpringForce(name=at("spring_force"), body=self.rod, rest_m=self.stroke_m / 2),
            EndCushion(name=at("end_cushion"), body=self.rod, stroke_m=self.stroke_m),
            *sensor_flaws(dict.fromkeys(self.pressures, REST_PA)),
        )

    def _named(self, effect: str) -> str:
        """Name of an effect, with its place where there are several cylinders."""
        return f"{effect}@{self.rod}" if self.suffix else effect

    def _on_valve(self, effect: str) -> str:
        """The same for what sits at the valve."""
        return f"{effect}@{self.valve}" if self.suffix else effect

    def _valve_effects(self) -> tuple[Effect, ...]:
        command, play = {"signal": self.command.name}, {"span": 10.0, "initial": OFFSET_V}
        first, second = self.chambers
        at = self._on_valve
        return (
            CommandDelay(name=at("command_delay"), delay_s=NETWORK_S, **command),
            LineDelay(name=at("line_delay"), chambers=self.chambers, **command),
            ValveHysteresis(name=at("valve_hysteresis"), **play, **command),
            ValveLag(name=at("valve_lag"), initial_v=OFFSET_V, **command),
            ValveOffset(name=at("valve_offset"), offset_v=OFFSET_V - NOMINAL_CENTRE_V, **command),
            DeadZone(name=at("valve_dead_zone"), full_v=FULL_V, **command),
            StuckBand(name=at("valve_stuck_band"), neutral=NOMINAL_CENTRE_V, span=10.0, **command),
            ProportionalValve(
                name=self.valve,
                first=first,
                second=second,
                underlap_v=0.75,
                area_shape_share=1.0,
                discharge_coefficient=MEAN_COEFFICIENT,
                discharge_asymmetry=CHARGING / MEAN_COEFFICIENT - 1.0,
            ),
        )

    def _friction(self) -> BristleFriction:
        return BristleFriction(
            name=self._named("friction"),
            body=self.rod,
            chambers=self.chambers,
            stribeck_exponent=5,
            coulomb_force_n=COULOMB_N,
            stiction_excess_n=6.7,
            viscous_n_s_m=87.56,
            stribeck_velocity_m_s=2.54e-3,
            steepness_s_m=STEEPNESS_S_M,
        )
