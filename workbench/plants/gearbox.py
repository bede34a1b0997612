"""The electro-pneumatic gearbox actuator of paper 003: a double-acting cylinder that shifts gears.

Two 3/2 solenoid valves feed chambers 1 and 2.  The main piston moves a shift finger between Low
(-12 mm), Neutral (0) and High (+12 mm) and a detent holds it there.  The floating piston, a ring
on the shank of the main one, is pushed by chamber 2 against a shoulder at Neutral: with both
valves energised the main piston is held in Neutral from both sides.  Between the pistons lies the
control chamber, which breathes through a port.  18 states.

    m_M dv/dt   = p1 A1 - p2 A2 - pc A_c - F_cp - friction - F_MF + stops - F_c
    m_F dv_F/dt = (pc - p2) A_F + F_cp - friction + F_MF + stops
    V1 = V10 + A1 (x + s),  V2 = V20 + A2 (s - x) + A_F (s - x_F),  Vc = Vc0 + A_F x_F - A_c x

Commands: Neutral to High (1, 0), High to Neutral (1, 1), Neutral to Low (0, 1), Low to Neutral
(1, 1), and (0, 0) to let the detent hold.

Source: paper 003, nonlinear model.  It prints no parameter: the layout and every number here is
*chosen* so that each of its statements comes out (physics.md 2.5).  Errata that matter here:

* E003-1: the heat enters the pressure with kappa - 1, which Eq. 7 lacks.
* E003-6, E003-7: contact and stops never pull; contact and friction between the pistons have
  opposite signs on the two.
* E003-11: what flows brings the temperature of where it comes from.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

from workbench.effect import Effect, Part
from workbench.effects import (
    ChamberLeak,
    CommandDelay,
    ConstantForce,
    ConstantWallHeat,
    Detent,
    EndCushion,
    EndStops,
    LeverLink,
    LineDelay,
    PistonContact,
    PistonLeak,
    SolenoidValve,
    SpringForce,
    StribeckFriction,
    SupplyDroop,
    Synchroniser,
    ThermalFriction,
)
from workbench.effects.sensors import sensor_flaws
from workbench.floating_piston import ControlChamber, FloatingPiston, SharedChamber
from workbench.lever import Lever, LeverLoad
from workbench.parts import Atmosphere, Body, Chamber, Supply
from workbench.plant import Plant, Signal

SUPPLY_PA = 9.0e5
ATMOSPHERE_PA = 1.013e5
ROOM_K = 293.15
STROKE_M = 12e-3  # from Neutral to either end
PISTON_M2 = pi / 4 * 50e-3**2  # A1
SHANK_M2 = pi / 4 * 30e-3**2  # A2
RING_M2 = pi / 4 * (65e-3**2 - 30e-3**2)  # A_F
FINGER_M = 50e-3
STEP_ERROR_M = 6e-8  # a sensor with 20 um of noise sees nothing of it
STEEPNESS_S_M = 2000.0 / 2  # tanh(f v / 2) of paper 003 Eq. 10
STOPS = dict(stiffness_n_m=2e7, damping_n_s_m=4e3)

MAIN, FLOATING, FINGER = "main_piston", "floating_piston", "finger"
COMMANDS = ("valve_1.command", "valve_2.command")
OUTPUTS = ("chamber_1.pressure_pa", "chamber_2.pressure_pa", "main_piston.position_m")
LEAKS = (("piston_leak@main_piston", "chamber_1"), ("piston_leak@floating_piston", "chamber_2"))


def gearbox(start_m: float = 0.0) -> Plant:
    """The actuator at rest, vented, with the main piston at ``start_m``."""
    return Plant(
        name="gearbox",
        parts=_parts(start_m),
        effects=(*_valves(), *_mechanics(), *_gas(), *_sensors(start_m)),
        commands=tuple(Signal(name, 0.0, 0.0, 1.0, levels=(0.0, 1.0)) for name in COMMANDS),
        optional_inputs=(
            Signal("supply.pressure_pa", nominal=SUPPLY_PA),
            Signal("load.force_n", nominal=0.0),
        ),
        measured=OUTPUTS,
        optional_outputs=("main_piston.velocity_m_s",),
    )


def _parts(start_m: float) -> tuple[Part, ...]:
    floating_m = max(start_m, 0.0)
    gas = dict(
        body=MAIN,
        initial_pressure_pa=ATMOSPHERE_PA,
        initial_temperature_k=ROOM_K,
        initial_position_m=start_m,
    )
    shared = dict(
        second_body=FLOATING,
        second_area_m2=RING_M2,
        second_stroke_m=STROKE_M,
        initial_second_position_m=floating_m,
        **gas,
    )
    whole = dict(stroke_m=2 * STROKE_M, lower_m=-STROKE_M)
    below = dict(stroke_m=STROKE_M, lower_m=-STROKE_M)
    solved = dict(travel_m=STROKE_M, step_error_m=STEP_ERROR_M)
    main = dict(mass_kg=1.0, initial_position_m=start_m, **solved)
    floating = dict(mass_kg=0.35, initial_position_m=floating_m, **solved)
    finger = dict(inertia_kg_m2=1.5e-3, arm_m=FINGER_M, initial_angle_rad=start_m / FINGER_M)
    first = dict(area_m2=PISTON_M2, dead_volume_m3=15e-6, **whole)
    second = dict(area_m2=SHANK_M2, dead_volume_m3=40e-6, second_side=-1, **whole)
    control = dict(area_m2=PISTON_M2 - SHANK_M2, dead_volume_m3=30e-6, second_side=+1, **below)
    return (
        Supply(name="supply", pressure_pa=SUPPLY_PA, temperature_k=ROOM_K),
        Atmosphere(name="atmosphere", pressure_pa=ATMOSPHERE_PA, temperature_k=ROOM_K),
        Body(name=MAIN, **main),
        FloatingPiston(name=FLOATING, pushed_by=MAIN, **floating),
        Lever(name=FINGER, tip_body=MAIN, **finger),
        LeverLoad(name="load", lever=FINGER, arm_m=60e-3),
        Chamber(name="chamber_1", side=+1, **first, **gas),
        SharedChamber(name="chamber_2", side=-1, **second, **shared),
        ControlChamber(name="control_chamber", side=-1, acting_share=1.0, **control, **shared),
    )


def _valves() -> tuple[Effect, ...]:
    names = ("valve_1", "valve_2")
    return (
        *(CommandDelay(name=f"command_delay@{n}", signal=f"{n}.command") for n in names),
        *(
            LineDelay(name=f"line_delay@{n}", signal=f"{n}.command", chambers=(f"chamber_{n[-1]}",))
            for n in names
        ),
        *(SolenoidValve(name=n, chamber=f"chamber_{n[-1]}") for n in names),
        SupplyDroop(name="supply_droop"),
    )


def _mechanics() -> tuple[Effect, ...]:
    dry = dict(steepness_s_m=STEEPNESS_S_M)
    main = dict(body=MAIN, chambers=("chamber_1", "control_chamber"), **dry)
    ring = dict(body=FLOATING, chambers=("chamber_2", "control_chamber"), **dry)
    shank = dict(body=MAIN, against=FLOATING, chambers=("chamber_2", "control_chamber"), **dry)
    return (
        EndStops(name=f"stops@{MAIN}", body=MAIN, lower_m=-STROKE_M, upper_m=STROKE_M, **STOPS),
        EndStops(name=f"stops@{FLOATING}", body=FLOATING, upper_m=STROKE_M, **STOPS),
        PistonContact(name="piston_contact", body=MAIN, other=FLOATING, **STOPS),
        StribeckFriction(name=f"friction@{MAIN}", coulomb_force_n=45.0, viscous_n_s_m=60.0, **main),
        StribeckFriction(
            name=f"friction@{FLOATING}", coulomb_force_n=30.0, viscous_n_s_m=40.0, **ring
        ),
        StribeckFriction(name="friction@shank", coulomb_force_n=10.0, **shank),
        ThermalFriction(name="friction_thermal", body=MAIN, rubbing_force_n=45.0, **dry),
        LeverLink(name="finger_joint", body=MAIN, lever=FINGER),
        Detent(name="detent", lever=FINGER, force_n=300.0, arm_m=50e-3, pitch_m=STROKE_M),
        Synchroniser(name="synchroniser", lever=FINGER),
        ConstantForce(name="constant_force", body=MAIN),
        SpringForce(name="spring_force", body=MAIN, rest_m=0.0),
        EndCushion(
            name="end_cushion", body=MAIN, length_m=5e-3, stroke_m=2 * STROKE_M, lower_m=-STROKE_M
        ),
    )


def _gas() -> tuple[Effect, ...]:
    chambers = ("chamber_1", "chamber_2", "control_chamber")
    return (
        ConstantWallHeat(name="wall_heat", chambers=chambers, coefficient_w_m2_k=40.0),
        *(ChamberLeak(name=f"chamber_leak@{c}", chamber=c) for c in chambers),
        *(PistonLeak(name=n, first=c, second="control_chamber") for n, c in LEAKS),
    )


def _sensors(start_m: float) -> Iterator[Effect]:
    starts = (ATMOSPHERE_PA, ATMOSPHERE_PA, start_m)
    return sensor_flaws(dict(zip(OUTPUTS, starts, strict=True)))
