"""The truth of the `soft_joint`: every number that its simulator can change, and its state.

A field at its null value means that the effect is absent.  The same class holds one bellows
(floats) or a batch of them (arrays of shape (n_columns,)).

Source: physics.md section 2.6 (paper 004, with the errata E004-1 to E004-6 of section 3).
"""

from dataclasses import dataclass

import numpy as np

KAPPA = 1.4
GAS_CONSTANT_J_KG_K = 0.99 * 8.31 / 0.029  # Z R / M
CV_J_KG_K = GAS_CONSTANT_J_KG_K / (KAPPA - 1.0)
DISCHARGE = 0.72
NEUTRAL = 0.5
SURFACE_M2 = 0.03
SLIP_SHARE = 2e-3  # travel of the command over which a spool that comes loose opens the vent


@dataclass(frozen=True)
class SoftJoint:
    """One bellows with its valve, or a batch of them.

    `valve_period_s` and `valve_damping` (below 1) are those of a second-order spool.
    `thermal_share` is how much of the gas's own temperature is felt: 0 is the one temperature of
    the paper (level 3 of physics.md 1.2), 1 the full balance with heat to a wall (level 1).
    `stiffening_m3` is the volume that the bellows gains at most, (1 - exp(-p_gauge/p_k)) of it at
    `stiffening_pa`.  `creep_m3_pa` of growth follows the pressure within `creep_time_s`.
    `tank_per_m3` is the reciprocal of the supply's tank; 0 is an ideal supply.
    `motion_share` of the volume comes and goes because someone swings the joint.
    """

    volume_m3: float = 0.5e-3
    flow_area_m2: float = 25e-6
    overlap_share: float = 0.02
    corner_share: float = 0.01
    area_exponent: float = 1.0
    valve_period_s: float = 0.0
    valve_damping: float = 0.8
    stuck_band_share: float = 0.0
    exhaust_restriction: float = 0.0
    chamber_leak_m2: float = 0.0
    supply_pressure_pa: float = 5.5e5
    supply_temperature_k: float = 293.15
    ambient_pressure_pa: float = 1.013e5
    ambient_temperature_k: float = 293.15
    tank_per_m3: float = 0.0
    supply_resistance_pa_s_kg: float = 5e7
    thermal_share: float = 0.0
    heat_transfer_w_m2_k: float = 10.0
    wall_j_per_k: float = 40.0
    wall_loss_w_k: float = 0.5
    stiffening_m3: float = 0.0
    stiffening_pa: float = 2e5
    creep_m3_pa: float = 0.0
    creep_time_s: float = 3.0
    motion_share: float = 0.0
    motion_hz: float = 1.2
    pressure_lag_s: float = 0.0
    pressure_offset_pa: float = 0.0


PRESSURE, TEMPERATURE, WALL, FOLLOWED, SUPPLY, READ = range(6)


@dataclass(frozen=True)
class State:
    """What the integrator carries, columns last.

    `gas`, shape (6, n): pressure, gas temperature, wall temperature, gauge pressure that the
    creeping wall has followed, supply pressure, what a lagging pressure sensor holds.
    `spool`, shape (2, n): its command from 0 to 1, and the rate of that.  `time_s`, shape (n,).
    """

    gas: np.ndarray
    spool: np.ndarray
    time_s: np.ndarray


def at_rest(joint: SoftJoint, pressure_pa=None) -> State:
    """State of a batch at rest with the valve in neutral; vented unless a pressure is given."""
    n = len(joint.volume_m3)
    own = joint.ambient_pressure_pa if pressure_pa is None else np.full(n, float(pressure_pa))
    room = joint.ambient_temperature_k
    gauge = own - joint.ambient_pressure_pa
    gas = np.stack([own, room, room, gauge, joint.supply_pressure_pa, own])
    return State(gas, np.stack([np.full(n, NEUTRAL), np.zeros(n)]), np.zeros(n))
