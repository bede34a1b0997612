"""The truth of the `gearbox`: every number that its simulator can change, and its state.

A field at its null value means that the effect is absent.  The same class holds one actuator
(floats) or a batch of them (arrays of shape (n_columns,)).

Source: physics.md section 2.5 (paper 003, with the errata E003-1, -6, -7 and -11 of section 3).
"""

from dataclasses import dataclass

import numpy as np

KAPPA = 1.4
GAS_CONSTANT_J_KG_K = 287.0
CV_J_KG_K = GAS_CONSTANT_J_KG_K / (KAPPA - 1.0)
CP_J_KG_K = KAPPA * CV_J_KG_K
STROKE_M = 12e-3  # from Neutral to either end
PISTON_M2 = np.pi / 4 * 50e-3**2
SHANK_M2 = np.pi / 4 * 30e-3**2
RING_M2 = np.pi / 4 * (65e-3**2 - 30e-3**2)
BACK_M2 = PISTON_M2 - SHANK_M2
FINGER_M, LOAD_ARM_M, DETENT_ARM_M = 50e-3, 60e-3, 50e-3
STEEPEST, SHARPNESS_S_M = 0.6, 1000.0  # tan alpha of the track; f / 2 of the dry friction
LINK_N_M, LINK_N_S_M = 5e6, 1.5e3
CONTACT_N_S_M = 4e3
SYNCHRONISING_M, SYNCHRONISED_M, EDGE_M = 5e-3, 7e-3, 0.3e-3
SYNCHRONISED_SLIP, SLIPPING_AGAIN_S = 0.03, 0.1
TURNS, POLE_M2, RESIDUAL_GAP_M, LIFT_M = 1100.0, 1e-4, 0.2e-3, 1.9e-3
CLAMP_V, QUENCHED_A = 45.0, 0.01
ARMATURE_KG, ARMATURE_N_S_M, ARMATURE_STOP = 5e-3, 1.0, (2e5, 8.0)
INLET_M, EXHAUST_M = 3.2e-3, 4.0e-3


@dataclass(frozen=True)
class Gearbox:
    """One actuator, or a batch of them.

    `delay_1_s` is that of the command of valve 1; `exhaust_restriction_2` closes a share of the
    exhaust of valve 2.  `saturation_per_a` is the reciprocal of the current at which the magnetic
    force is half of what a straight core would give.  `algebraic_share` of the dry friction follows
    v / sqrt(v^2 + 1 / k^2) instead of tanh(k v).  `wall_k_per_j` is the reciprocal of the heat
    capacity of each chamber's wall; 0 is a wall at room temperature.
    """

    main_kg: float = 1.0
    floating_kg: float = 0.35
    finger_kg_m2: float = 1.5e-3
    dead_volume_1_m3: float = 15e-6
    dead_volume_2_m3: float = 40e-6
    dead_volume_c_m3: float = 30e-6
    port_area_m2: float = 12e-6
    discharge_1: float = 0.72
    discharge_2: float = 0.72
    exhaust_restriction_2: float = 0.0
    coil_1_ohm: float = 30.0
    coil_2_ohm: float = 30.0
    supply_voltage_v: float = 24.0
    core_per_h: float = 2e6
    spring_n_m: float = 700.0
    preload_n: float = 2.0
    saturation_per_a: float = 0.0
    delay_1_s: float = 0.0
    supply_pressure_pa: float = 9.0e5
    supply_temperature_k: float = 293.15
    ambient_pressure_pa: float = 1.013e5
    ambient_temperature_k: float = 293.15
    heat_transfer_w_m2_k: float = 40.0
    wall_k_per_j: float = 0.0
    wall_loss_w_k: float = 0.3
    coulomb_main_n: float = 45.0
    coulomb_floating_n: float = 30.0
    coulomb_shank_n: float = 10.0
    viscous_main_n_s_m: float = 60.0
    viscous_floating_n_s_m: float = 40.0
    friction_wave: float = 0.0
    friction_wavelength_m: float = 0.01
    friction_phase_rad: float = 0.0
    algebraic_share: float = 0.0
    quadratic_drag_n_s2_m2: float = 0.0
    contact_n_m: float = 2e7
    detent_n: float = 300.0
    synchroniser_n: float = 0.0
    synchronising_s: float = 0.1
    pressure_lag_s: float = 0.0


@dataclass(frozen=True)
class State:
    """What the integrator carries, columns last.

    `gas`, shape (3, 3, n): mass, internal energy, wall temperature of chambers 1, 2 and control.
    `body`, shape (6, n): place of main piston, floating piston and finger tip, then their speeds
    half a step earlier.  `valve`, shape (3, 2, n): current, lift, speed of lift of both valves.
    `slip`, shape (n,): relative speed of the gear over its value when out.  `read_pa`, shape
    (2, n): what lagging pressure sensors hold.  `gas_rate`: rates of `gas` in the last step.
    """

    gas: np.ndarray
    body: np.ndarray
    valve: np.ndarray
    slip: np.ndarray
    read_pa: np.ndarray
    gas_rate: np.ndarray


def volumes(p: Gearbox, main_m: np.ndarray, floating_m: np.ndarray) -> np.ndarray:
    """Gas volumes of chambers 1, 2 and control, shape (3, n)."""
    return np.stack(
        [
            p.dead_volume_1_m3 + PISTON_M2 * (main_m + STROKE_M),
            p.dead_volume_2_m3 + SHANK_M2 * (STROKE_M - main_m) + RING_M2 * (STROKE_M - floating_m),
            p.dead_volume_c_m3 + RING_M2 * floating_m - BACK_M2 * main_m,
        ]
    )


def at_rest(p: Gearbox, main_m: float = 0.0) -> State:
    """State of a batch at rest and vented, with the main piston at a place and the valves shut."""
    n = len(p.main_kg)
    floating_m = max(main_m, 0.0)
    volume = volumes(p, np.full(n, main_m), np.full(n, floating_m))
    room = np.broadcast_to(p.ambient_temperature_k, (3, n))
    mass = p.ambient_pressure_pa * volume / (GAS_CONSTANT_J_KG_K * room)
    gas = np.stack([mass, CV_J_KG_K * mass * room, room])
    body = np.repeat([[main_m], [floating_m], [main_m], [0.0], [0.0], [0.0]], n, axis=1)
    valve = np.zeros((3, 2, n))
    valve[1] = -p.preload_n / (ARMATURE_STOP[0] + p.spring_n_m)
    return State(
        gas=gas,
        body=body,
        valve=valve,
        slip=np.ones(n),
        read_pa=np.broadcast_to(p.ambient_pressure_pa, (2, n)).copy(),
        gas_rate=np.zeros((3, 3, n)),
    )
