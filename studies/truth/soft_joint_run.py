"""Integrator of the true bellows: classical Runge-Kutta in steps of 0.5 ms.

The spool is linear and its command constant over a sample, so its travel is known in closed form at
every half-step.  What is left,

    (V + kappa p C) dp/dt = kappa R sum(mdot T) - kappa p V' + (kappa - 1) Q
    dT/dt = T (1/p dp/dt + 1/V dV/dt - 1/m dm/dt),   m = p V / (R T)
    C_w dT_w/dt = h_w (T_amb - T_w) - Q,             Q = h A (T_w - T)
    V = V_0 (1 + motion) + V_g (1 - exp(-p_gauge / p_k)) + C_1 z,   tau dz/dt = p_gauge - z
    V_t dp_s/dt = kappa R T_s (G_r (p_set - p_s) - mdot_in)

has its fastest eigenvalue near 650 1/s (the straight zone of the flow at equal pressures), and the
sensor's lag 1000 1/s: half a step.  Halving the step changes the pressure by less than a
hundredth of the sensor noise (test).

Source: physics.md 1.1, 1.2, 2.6 and 6 (valve_dynamics, valve_stiction, supply_droop,
volume_expansion, bellows_creep).
"""

from dataclasses import dataclass

import numpy as np

from studies.truth import soft_joint as s
from studies.truth.hole import scale, stream

SAMPLE_TIME_S = 1.0 / 400
SUBSTEPS = 5
FLOW_SCALE = scale(s.GAS_CONSTANT_J_KG_K)


@dataclass(frozen=True)
class Bench:
    """A batch of bellows with the response of its spools at every half-step of a sample.

    `response`, shape (2 substeps + 1, 2, 2, n): how far command and rate are off, from how far they
    were off at the start of the sample.
    """

    joint: s.SoftJoint
    substeps: int
    response: np.ndarray


def bench(joint: s.SoftJoint, substeps: int = SUBSTEPS) -> Bench:
    """Prepare a batch (fields of shape (n_columns,)) for `advance`."""
    t = np.linspace(0.0, SAMPLE_TIME_S, 2 * substeps + 1)[:, None]
    ideal = joint.valve_period_s <= 0.0
    omega = 2 * np.pi / np.where(ideal, 1.0, joint.valve_period_s)
    decay = joint.valve_damping * omega
    damped = omega * np.sqrt(1.0 - joint.valve_damping**2)
    fade, cos, sin = np.exp(-decay * t), np.cos(damped * t), np.sin(damped * t)
    rows = [
        [cos + decay / damped * sin, sin / damped],
        [-(omega**2) / damped * sin, cos - decay / damped * sin],
    ]
    response = np.moveaxis(np.array(rows), 2, 0) * fade[:, None, None]
    return Bench(joint, substeps, np.where(ideal, 0.0, response))


def advance(b: Bench, state: s.State, command: np.ndarray) -> s.State:
    """State one sample later, the command of shape (n_columns,) held constant."""
    off = state.spool - np.stack([command, np.zeros_like(command)])
    travel = command + (b.response[:, 0] * off).sum(axis=1)
    areas = _areas(b.joint, travel)
    spool = (b.response[-1] * off).sum(axis=1)
    spool[0] += command
    gas, time_s, h = state.gas, state.time_s, SAMPLE_TIME_S / b.substeps
    for j in range(b.substeps):
        first = _rates(b.joint, gas, areas[2 * j], time_s)
        middle = areas[2 * j + 1]
        second = _rates(b.joint, gas + 0.5 * h * first, middle, time_s + 0.5 * h)
        third = _rates(b.joint, gas + 0.5 * h * second, middle, time_s + 0.5 * h)
        time_s = time_s + h
        fourth = _rates(b.joint, gas + h * third, areas[2 * j + 2], time_s)
        gas = gas + h / 6.0 * (first + 2.0 * (second + third) + fourth)
    return s.State(gas, spool, time_s)


def _areas(p: s.SoftJoint, command: np.ndarray) -> np.ndarray:
    """Effective areas of fill, vent and leak, shape (n_half_steps, 3, n).

    s = eps/range smax(travel/eps),  smax(x) = (sqrt(x^2 + 1) + x)/2,  A = C A_max (1 - (1 - s)^e)
    """
    past = command - s.NEUTRAL
    range_ = 1.0 - s.NEUTRAL - p.overlap_share

    def opened(travel):
        relative = travel / p.corner_share
        smooth = 0.5 * p.corner_share * (np.sqrt(relative**2 + 1.0) + relative)
        closed = np.maximum(1.0 - smooth / range_, 0.0)
        return s.DISCHARGE * p.flow_area_m2 * (1.0 - closed**p.area_exponent)

    out = -past - p.overlap_share
    loose = np.clip((out - p.stuck_band_share) / s.SLIP_SHARE, 0.0, 1.0)
    vent = np.where(p.stuck_band_share > 0.0, loose, 1.0) * (1.0 - p.exhaust_restriction)
    leak = np.broadcast_to(p.chamber_leak_m2, past.shape)
    areas = np.stack([opened(past - p.overlap_share), vent * opened(out), leak], axis=1)
    return FLOW_SCALE * areas


def _rates(p: s.SoftJoint, gas: np.ndarray, area: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Rates of the gas's state."""
    own, temperature, wall, followed, supply, read = gas
    # Without a tank the supply is ideal, whatever the state says (window replays).
    supply = np.where(p.tank_per_m3 > 0.0, supply, p.supply_pressure_pa)
    felt = p.ambient_temperature_k + p.thermal_share * (temperature - p.ambient_temperature_k)
    outside = np.stack([supply, p.ambient_pressure_pa, p.ambient_pressure_pa])
    outside_k = np.stack([p.supply_temperature_k, *[p.ambient_temperature_k] * 2])
    flow, brought_k = stream(outside, outside_k, own, felt)
    flow *= area
    gauge = own - p.ambient_pressure_pa
    compliance = p.stiffening_m3 / p.stiffening_pa * np.exp(-gauge / p.stiffening_pa)
    angle = 2 * np.pi * p.motion_hz * time_s
    swing = p.volume_m3 * p.motion_share
    volume = p.volume_m3 + swing * np.sin(angle)
    volume += p.stiffening_m3 - compliance * p.stiffening_pa + p.creep_m3_pa * followed
    following = (gauge - followed) / p.creep_time_s
    growing = p.creep_m3_pa * following + swing * 2 * np.pi * p.motion_hz * np.cos(angle)
    heat = p.heat_transfer_w_m2_k * s.SURFACE_M2 * (wall - temperature)
    enthalpy = s.KAPPA * s.GAS_CONSTANT_J_KG_K * (flow * brought_k).sum(axis=0)
    power = enthalpy - s.KAPPA * own * growing + (s.KAPPA - 1.0) * p.thermal_share * heat
    rising = power / (volume + s.KAPPA * own * compliance)
    inverse_mass = s.GAS_CONSTANT_J_KG_K * temperature / (own * volume)
    relative = rising / own + (growing + compliance * rising) / volume
    warming = temperature * (relative - flow.sum(axis=0) * inverse_mass)
    wall_rate = (p.wall_loss_w_k * (p.ambient_temperature_k - wall) - heat) / p.wall_j_per_k
    refill = (p.supply_pressure_pa - supply) / p.supply_resistance_pa_s_kg - flow[0]
    tank = s.KAPPA * s.GAS_CONSTANT_J_KG_K * p.supply_temperature_k * p.tank_per_m3 * refill
    lag = np.where(p.pressure_lag_s > 0.0, (own - read) / np.maximum(p.pressure_lag_s, 1e-6), 0.0)
    return np.stack([rising, warming, wall_rate, following, tank, lag])


def open_loop(
    joint: s.SoftJoint, command: np.ndarray, initial: s.State, substeps: int = SUBSTEPS
) -> tuple[dict[str, np.ndarray], list[s.State]]:
    """Noise-free readings under commands of shape (n_samples, n_columns), and all states.

    Entry k is at sample k, before command k acts.  `pressure_pa` is what the sensor reads (lag and
    offset); `true_pressure_pa` and `temperature_k` are the gas's.
    """
    prepared = bench(joint, substeps)
    states, state = [], initial
    for row in command:
        states.append(state)
        state = advance(prepared, state, row)
    gas = np.stack([each.gas for each in states])
    lagging = np.where(joint.pressure_lag_s > 0.0, gas[:, s.READ], gas[:, s.PRESSURE])
    readings = dict(
        pressure_pa=lagging + joint.pressure_offset_pa,
        supply_pa=gas[:, s.SUPPLY],
        true_pressure_pa=gas[:, s.PRESSURE],
        temperature_k=gas[:, s.TEMPERATURE],
    )
    return readings, states
