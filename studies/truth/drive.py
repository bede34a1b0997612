"""The truth of the `servo_drive`: every number that the truth simulator can change.

A field at its null value (0, or 0.9 for the presliding share) means that the effect is absent.
The same class holds one drive (floats) or a batch of drives (arrays of shape (n_columns,)).

Source: physics.md section 2.4 (paper 002, tables 5 and 6, with the errata of section 3).
"""

from dataclasses import dataclass

import numpy as np

KAPPA = 1.4
GAS_CONSTANT_J_KG_K = 288.0
CV_J_KG_K = GAS_CONSTANT_J_KG_K / (KAPPA - 1.0)
CP_J_KG_K = KAPPA * CV_J_KG_K
CHOKED = float(np.sqrt(KAPPA / GAS_CONSTANT_J_KG_K * (2 / (KAPPA + 1)) ** 6))  # exponent for 1.4
DISCHARGE = 0.5513
FULL_AREA_M2 = 2.8274e-5
SUPPLY_AREA_SHARE, EXHAUST_AREA_SHARE = 0.80, 0.65
COMMAND_RANGE_V = 10.0
BORE_M = 0.025
PISTON_AREA_M2 = np.pi * BORE_M**2 / 4
STROKE_M = 0.290
HEAT_PRESSURE_PA, HEAT_TEMPERATURE_K = 5.65e5, 293.15
BRISTLE_STIFFNESS_N_M = 1.12e6
BRISTLE_DAMPING_N_S_M = 50.0
STRIBECK_VELOCITY_M_S = 0.024
STOP_STIFFNESS_N_M, STOP_DAMPING_N_S_M = 2e6, 2e3


@dataclass(frozen=True)
class Drive:
    """One servo drive, or a batch of them.

    Friction by direction is mean and asymmetry: value = mean (1 + asymmetry sign v); the means
    and asymmetries reproduce the two columns of paper 002, table 5.
    `constant_force_n` pushes towards larger y. `pressure_a_offset_pa` is added by the sensor.
    `exhaust_restriction` multiplies both exhaust areas by one minus itself, `supply_restriction`
    the supply areas; `discharge_asymmetry` makes lands wider for flow into a chamber.
    `play_share` and `stuck_band_share` are shares of the command's range: the spool moves once the
    command is further away than the play, and stays shut below centre within the band.
    The spring pulls to mid-stroke. `position_scale` is the position sensor's error of gain.
    Laws that no catalogue has, from `quadratic_drag_n_s2_m2` on, are written down in `laws`.
    `tank_per_m3` is the reciprocal of the tank volume; 0 is an ideal supply.
    """

    moving_mass_kg: float = 2.22
    dead_volume_a_m3: float = 3.105e-5
    dead_volume_b_m3: float = 5.525e-5
    flow_area: float = 1.0
    area_exponent: float = 1.6
    exhaust_restriction: float = 0.0
    supply_restriction: float = 0.0
    discharge_asymmetry: float = 0.0
    dead_zone_centre_v: float = 4.95
    dead_zone_half_width_v: float = 0.42
    underlap_v: float = 0.0
    valve_offset_v: float = 0.0
    play_share: float = 0.0
    stuck_band_share: float = 0.0
    valve_period_s: float = 0.0
    valve_damping: float = 1.0
    valve_lag_s: float = 0.0
    spool_leak_m2: float = 8e-8
    chamber_a_leak_m2: float = 0.0
    chamber_b_leak_m2: float = 0.0
    piston_leak_m2: float = 0.0
    supply_pressure_pa: float = 7e5
    supply_temperature_k: float = 293.15
    ambient_pressure_pa: float = 1e5
    ambient_temperature_k: float = 293.15
    tank_per_m3: float = 0.0
    supply_resistance_pa_s_kg: float = 5e7
    heat_transfer_w_m2_k: float = 22.563
    wall_k_per_j: float = 0.0
    wall_loss_w_k: float = 0.5
    coulomb_n: float = 27.285
    coulomb_asymmetry: float = 0.039032
    stiction_excess_n: float = 21.275
    stiction_asymmetry: float = 0.063220
    viscous_n_s_m: float = 44.095
    viscous_asymmetry: float = 0.043429
    friction_wave: float = 0.0
    friction_wavelength_m: float = 0.05
    friction_phase_rad: float = 0.0
    presliding_share: float = 0.9
    constant_force_n: float = 0.0
    spring_n_m: float = 0.0
    pressure_lag_s: float = 0.0
    pressure_a_offset_pa: float = 0.0
    position_scale: float = 0.0
    quadratic_drag_n_s2_m2: float = 0.0
    sagging_cable_n: float = 0.0
    spot_drag_n_s_m: float = 0.0
    catch_n: float = 0.0
    spot_m: float = 0.145
    spot_width_m: float = 0.03
    sliding_leak_m2_s_m: float = 0.0
    purge_kg_s: float = 0.0


@dataclass(frozen=True)
class State:
    """What the integrator carries, outermost axis first, columns last.

    Chamber arrays have shape (2, n): a, then b. `valve` has shape (3, n): lagged command, spool
    in volt, spool increment of one step. `left_v` is where the play left the command, `read_pa`
    what lagged pressure sensors hold.
    """

    pressure_pa: np.ndarray
    temperature_k: np.ndarray
    wall_k: np.ndarray
    position_m: np.ndarray
    velocity_m_s: np.ndarray
    bristle_m: np.ndarray
    supply_pa: np.ndarray
    valve: np.ndarray
    left_v: np.ndarray
    read_pa: np.ndarray


def columns(drive: Drive) -> int:
    """Number of columns in a batch."""
    return len(np.atleast_1d(drive.moving_mass_kg))


def at_rest(drive: Drive, position_m, pressure_pa=5.65e5, command_v: float = 4.95) -> State:
    """State of a batch standing still with both chambers at one pressure and the valve settled."""
    n = columns(drive)
    pressure = np.broadcast_to(np.asarray(pressure_pa, float), (2, n)).copy()
    temperature = np.broadcast_to(drive.ambient_temperature_k, (2, n)).astype(float)
    volt = np.broadcast_to(np.asarray(command_v, float), (n,))
    return State(
        pressure_pa=pressure,
        temperature_k=temperature,
        wall_k=temperature.copy(),
        position_m=np.broadcast_to(np.asarray(position_m, float), (n,)).copy(),
        velocity_m_s=np.zeros(n),
        bristle_m=np.zeros(n),
        supply_pa=np.broadcast_to(drive.supply_pressure_pa, (n,)).astype(float),
        valve=np.stack([volt, volt, np.zeros(n)]),
        left_v=volt.astype(float),
        read_pa=pressure.copy(),
    )
