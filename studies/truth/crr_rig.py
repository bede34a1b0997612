"""The truth of the `crr_rig`: every number that the truth simulator can change, and its state.

A field at its null value (0) means that the effect is absent.  The same class holds one rig
(floats) or a batch of rigs (arrays of shape (n_columns,)).

Source: physics.md section 2.1 (papers 000 and 001, with the errata of section 3).
"""

from dataclasses import dataclass

import numpy as np

from studies.truth.drive import KAPPA  # of air, as for every plant

GAS_CONSTANT_J_KG_K = 287.0
CV_J_KG_K = GAS_CONSTANT_J_KG_K / (KAPPA - 1.0)
CP_J_KG_K = KAPPA * CV_J_KG_K
COMMAND_RANGE_V, SPAN_V = 10.0, 4.75
HOLE_RADIUS_M = 1e-3
CHARGING, DISCHARGING = 0.62, 0.55
BORE_M, ROD_M, STROKE_M = 26.99e-3, 7.94e-3, 0.1524
CAP_AREA_M2, ROD_AREA_M2 = np.pi / 4 * BORE_M**2, np.pi / 4 * ROD_M**2
AREAS_M2 = np.array([[CAP_AREA_M2], [CAP_AREA_M2 - ROD_AREA_M2]])
SIDES = np.array([[1.0], [-1.0]])
STRIBECK_VELOCITY_M_S, STEEPNESS_S_M = 2.54e-3, 1580.0
STOP_STIFFNESS_N_M, STOP_DAMPING_N_S_M = 2e6, 2e3
HEAT_PRESSURE_PA, HEAT_TEMPERATURE_K = 5.65e5, 293.15
REST_PA = 3.7565e5  # the input pressure at the valve's centre


@dataclass(frozen=True)
class CrrRig:
    """One rig, or a batch of them.

    `constant_force_n` pushes the rod out. `cap_pressure_offset_pa` is added by the sensor.
    `tank_per_m3` is the reciprocal of the tank volume; 0 is an ideal supply.
    `hole_exponent` bends the area law: opening height over hole diameter is raised to it.
    `smoothing_share` of the dry friction starts as k v / sqrt(1 + (k v)^2), the rest as tanh k v.
    """

    moving_mass_kg: float = 1.0
    cap_dead_volume_m3: float = 6e-6
    rod_dead_volume_m3: float = 6e-6
    flow_area: float = 1.0
    discharge_asymmetry: float = 0.0
    clearance_m: float = 1e-4
    hole_exponent: float = 1.0
    underlap_v: float = 0.75
    centre_v: float = 5.25
    dead_zone_half_width_v: float = 0.0
    valve_period_s: float = 0.0
    valve_damping: float = 1.0
    valve_lag_s: float = 0.0
    cap_leak_m2: float = 0.0
    piston_leak_m2: float = 0.0
    supply_pressure_pa: float = 6.5e5
    supply_temperature_k: float = 293.15
    ambient_pressure_pa: float = 1.013e5
    ambient_temperature_k: float = 293.15
    tank_per_m3: float = 0.0
    supply_resistance_pa_s_kg: float = 5e7
    heat_transfer_w_m2_k: float = 0.0
    wall_k_per_j: float = 0.0
    wall_loss_w_k: float = 0.5
    coulomb_n: float = 13.3
    stiction_excess_n: float = 6.7
    viscous_n_s_m: float = 87.56
    smoothing_share: float = 0.0
    friction_wave: float = 0.0
    friction_wavelength_m: float = 0.05
    friction_phase_rad: float = 0.0
    quadratic_drag_n_s2_m2: float = 0.0
    constant_force_n: float = 0.0
    pressure_lag_s: float = 0.0
    cap_pressure_offset_pa: float = 0.0


@dataclass(frozen=True)
class State:
    """What the integrator carries, outermost axis first, columns last.

    Chamber arrays have shape (2, n): cap, then rod side. `valve` has shape (3, n), see
    `instruments`. `read_pa` is what lagged pressure sensors hold. `sent_v` is the command on its
    way to the valve, `shown` of shape (3, n) the position and pressures on their way back.
    """

    pressure_pa: np.ndarray
    temperature_k: np.ndarray
    wall_k: np.ndarray
    position_m: np.ndarray
    velocity_m_s: np.ndarray
    supply_pa: np.ndarray
    valve: np.ndarray
    read_pa: np.ndarray
    sent_v: np.ndarray
    shown: np.ndarray


def at_rest(rig: CrrRig, position_m, pressure_pa=REST_PA) -> State:
    """State of a batch standing still with the valve centred and nothing on its way."""
    n = len(np.atleast_1d(rig.moving_mass_kg))

    def each(value, rows=None) -> np.ndarray:
        shape = (n,) if rows is None else (rows, n)
        return np.broadcast_to(np.asarray(value, float), shape).copy()

    pressure = each(pressure_pa, 2)
    position, centre = each(position_m), each(rig.centre_v)
    return State(
        pressure_pa=pressure,
        temperature_k=each(rig.ambient_temperature_k, 2),
        wall_k=each(rig.ambient_temperature_k, 2),
        position_m=position,
        velocity_m_s=np.zeros(n),
        supply_pa=each(rig.supply_pressure_pa),
        valve=np.stack([centre, centre, np.zeros(n)]),
        read_pa=pressure.copy(),
        sent_v=centre.copy(),
        shown=np.stack([position, pressure[0] + rig.cap_pressure_offset_pa, pressure[1]]),
    )
