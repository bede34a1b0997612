"""The rodless servo-pneumatic linear drive of paper 002: 5/3 valve, two chambers, one slide.

Full level: pressures and gas masses as states, ISO 6358-1:2013 flow, elasto-plastic friction.
Values are from the paper's list of constants and Tables 3 to 6, except where marked *chosen*
(physics.md 2.4).  Errata that matter here:

* E002-8: Table 6 prints dead volumes of 3.125e-3 and 5.530e-3 m3; total minus stroke volume gives
  3.105e-5 and 5.525e-5 m3.
* E002-12: the gas constant is 288 J/kg K; only that reproduces C_d = 0.5513.
* E002-6, E002-13: friction coefficients are magnitudes; the bristle damping is in N s/m.
* E002-7: the printed polytropic temperature has no rest state; the full balance is used.
* Chosen: area law and fractions of the valve, b, a, m, closed-centre leak, end stops.
"""

from __future__ import annotations

from workbench.effect import Effect
from workbench.effects import (
    BristleFriction,
    ChamberLeak,
    CommandDelay,
    ConstantForce,
    DeadZone,
    EndCushion,
    EndStops,
    FivePortValve,
    LineDelay,
    PistonLeak,
    SpringForce,
    StuckBand,
    SupplyDroop,
    ThermalFriction,
    ValveHysteresis,
    ValveLag,
    ValveOffset,
    WallHeat,
)
from workbench.effects.sensors import sensor_flaws
from workbench.parts import Atmosphere, Body, Chamber, Supply
from workbench.plant import Plant, Signal

GAS_CONSTANT_J_KG_K = 288.0
STROKE_M = 0.290
AREA_M2 = 4.9087e-4
SUPPLY_PA = 7.0e5
ATMOSPHERE_PA = 1.0e5
ROOM_K = 293.15
REST_PA = 5.65e5  # P_0 of the paper
RANGE_V = 10.0
CENTRE_V = 4.95  # (zms + zmd) / 2
HALF_WIDTH_V = 0.42  # (zmd - zms) / 2
BRISTLE_STIFFNESS_N_M = 1.12e6
BRISTLE_DAMPING_N_S_M = 50.0
RUBBING_N = 27.3  # Coulomb friction, both directions
FLOW_AREA_M2 = 2.8274e-5
LEAK_AREA_M2 = 8e-8
START_M = STROKE_M / 2

COMMAND = "valve.command_v"
OUTPUTS = ("slide.position_m", "chamber_a.pressure_pa", "chamber_b.pressure_pa")


def _friction() -> BristleFriction:
    """Table 5: 50.97, 28.35 N, 46.01 N s/m for v > 0 and 46.15, 26.22, 42.18 for v < 0."""
    coulomb_n, excess_n = (28.35 + 26.22) / 2, (22.62 + 19.93) / 2
    viscous_n_s_m = (46.01 + 42.18) / 2
    asymmetry = (46.01 - 42.18) / 2 / viscous_n_s_m
    return BristleFriction(
        name="friction",
        body="slide",
        chambers=("chamber_a", "chamber_b"),
        coulomb_force_n=coulomb_n,
        stiction_excess_n=excess_n,
        viscous_n_s_m=viscous_n_s_m,
        presliding_share=1.0,
        asymmetry=asymmetry,
        coulomb_weight=(28.35 - 26.22) / 2 / coulomb_n / asymmetry,
        excess_weight=(22.62 - 19.93) / 2 / excess_n / asymmetry,
        stribeck_velocity_m_s=0.024,
        breakaway_deflection_m=(coulomb_n + excess_n) / BRISTLE_STIFFNESS_N_M,
        bristle_time_s=BRISTLE_DAMPING_N_S_M / BRISTLE_STIFFNESS_N_M,
    )


def servo_valve(*chambers: str) -> tuple[Effect, ...]:
    """The valve on one or two chambers, after what happens to a command before it opens."""
    return (
        CommandDelay(name="command_delay", signal=COMMAND),
        LineDelay(name="line_delay", signal=COMMAND, chambers=chambers),
        ValveHysteresis(name="valve_hysteresis", signal=COMMAND, span=RANGE_V, initial=CENTRE_V),
        ValveLag(name="valve_lag", signal=COMMAND, initial_v=CENTRE_V),
        ValveOffset(name="valve_offset", signal=COMMAND),
        DeadZone(
            name="valve_dead_zone",
            signal=COMMAND,
            centre_v=CENTRE_V,
            neutral_v=CENTRE_V,
            half_width_v=HALF_WIDTH_V,
        ),
        StuckBand(name="valve_stuck_band", signal=COMMAND, neutral=CENTRE_V, span=RANGE_V),
        FivePortValve(
            name="valve",
            first=chambers[0],
            second=chambers[1] if len(chambers) > 1 else None,
            gas_constant_j_kg_k=GAS_CONSTANT_J_KG_K,
            flow_area_m2=FLOW_AREA_M2,
            centre_v=CENTRE_V,
            leak_area_m2=LEAK_AREA_M2,
        ),
    )


def servo_drive() -> Plant:
    """The drive as identified in the paper; what it may lack stands at null."""
    chamber = dict(
        body="slide",
        area_m2=AREA_M2,
        stroke_m=STROKE_M,
        gas_constant_j_kg_k=GAS_CONSTANT_J_KG_K,
        initial_pressure_pa=REST_PA,
        initial_temperature_k=ROOM_K,
        initial_position_m=START_M,
    )
    a, b = "chamber_a", "chamber_b"
    return Plant(
        name="servo_drive",
        parts=(
            Supply(name="supply", pressure_pa=SUPPLY_PA, temperature_k=ROOM_K),
            Atmosphere(name="atmosphere", pressure_pa=ATMOSPHERE_PA),
            Body(name="slide", mass_kg=2.22, initial_position_m=START_M),
            Chamber(name=a, side=+1, dead_volume_m3=3.105e-5, **chamber),
            Chamber(name=b, side=-1, dead_volume_m3=5.525e-5, **chamber),
        ),
        effects=(
            *servo_valve(a, b),
            WallHeat(name="wall_heat", chambers=(a, b), coefficient_w_m2_k=22.563),
            _friction(),
            ThermalFriction(name="friction_thermal", body="slide", rubbing_force_n=RUBBING_N),
            EndStops(name="stops", body="slide", stiffness_n_m=2e6, upper_m=STROKE_M),
            ChamberLeak(name="chamber_leak@chamber_a", chamber=a),
            ChamberLeak(name="chamber_leak@chamber_b", chamber=b),
            PistonLeak(name="piston_leak", first=a, second=b),
            SupplyDroop(name="supply_droop"),
            ConstantForce(name="constant_force", body="slide"),
            SpringForce(name="spring_force", body="slide", rest_m=STROKE_M / 2),
            EndCushion(name="end_cushion", body="slide", stroke_m=STROKE_M),
            *sensor_flaws(dict(zip(OUTPUTS, (START_M, REST_PA, REST_PA), strict=True))),
        ),
        commands=(Signal(COMMAND, nominal=CENTRE_V, lower=0.0, upper=RANGE_V),),
        optional_inputs=(Signal("supply.pressure_pa", nominal=SUPPLY_PA),),
        measured=OUTPUTS,
        optional_outputs=("slide.velocity_m_s",),
    )
