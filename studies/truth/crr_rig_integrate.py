"""Integrator of the `crr_rig`'s truth: mass and energy explicit, velocity implicit in friction.

Per step of 20 microseconds, for all columns at once:

    valve       spool in volt, implicit Euler, computed for a whole millisecond beforehand
    mechanics   M (v1 - v0)/dt = P_c A_c - P_r A_r - P_E A_rod + F_e - (g s/v + c_v + q |v|)(v0) v1
                the secant of the dry friction at v0 keeps its slope of 3e4 N s/m stable
    chambers    dU = (c_p sum mdot T + Q) dt - p dV,   dm = sum mdot dt,   p = (kappa-1) U / V
    walls       C_w dT_w = (h (T_amb - T_w) - Q) dt
    supply      V_t dP_s = kappa R T_s (G_r (P_set - P_s) - sum s mdot) dt

Commands and readings need one sample each on their way between computer and rig.

Source: physics.md 1.1 to 1.4, 2.1, 6 (supply_droop, wall_temperature), 8.1.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from studies.truth import crr_rig as c
from studies.truth.batch import spread
from studies.truth.crr_rig_flow import nozzle, openings
from studies.truth.instruments import sensor_weights, spool_response

SAMPLE_TIME_S = 1e-3
SUBSTEPS = 50
LEAST_SPEED_M_S = 1e-9  # the secant of the dry friction at rest is taken here


@dataclass(frozen=True)
class Bench:
    """A batch with what does not change from step to step."""

    rig: c.CrrRig
    step_s: float
    substeps: int
    constant: SimpleNamespace


def bench(rig: c.CrrRig, substeps: int = SUBSTEPS) -> Bench:
    """Prepare a batch (fields of shape (n_columns,)) for `advance`."""
    step_s = SAMPLE_TIME_S / substeps
    rig = spread(rig, len(np.atleast_1d(rig.moving_mass_kg)))
    spool, valve = spool_response(rig, step_s, substeps)
    keep, weight = sensor_weights(rig.pressure_lag_s, step_s, substeps)
    dead = np.stack([rig.cap_dead_volume_m3, rig.rod_dead_volume_m3])
    flow = c.KAPPA * c.GAS_CONSTANT_J_KG_K * rig.supply_temperature_k
    constant = SimpleNamespace(
        spool_response=spool,
        valve_response=valve,
        read_keep=keep,
        read_weight=weight,
        volume_0=dead + c.AREAS_M2 * np.array([[0.0], [c.STROKE_M]]),
        volume_1=c.AREAS_M2 * c.SIDES,
        surface_0=2 * c.AREAS_M2 + np.pi * c.BORE_M * np.array([[0.0], [c.STROKE_M]]),
        surface_1=np.pi * c.BORE_M * c.SIDES,
        heat=rig.heat_transfer_w_m2_k / np.sqrt(c.HEAT_PRESSURE_PA * c.HEAT_TEMPERATURE_K),
        tank_gain=step_s * flow * rig.tank_per_m3,
        leaks=np.stack([rig.cap_leak_m2, rig.piston_leak_m2]),
        wave_number=2 * np.pi / rig.friction_wavelength_m,
        load=rig.constant_force_n - rig.ambient_pressure_pa * c.ROD_AREA_M2,
        droops=bool(np.any(rig.tank_per_m3 > 0)),
        leaky=bool(np.any(rig.cap_leak_m2 + rig.piston_leak_m2 > 0)),
        warm=bool(np.any(rig.heat_transfer_w_m2_k > 0)),
    )
    return Bench(rig, step_s, substeps, constant)


def advance(b: Bench, state: c.State, command_v: np.ndarray) -> c.State:
    """State one sample later; the command of shape (n_columns,) leaves the computer now."""
    k = b.constant
    inputs = np.concatenate([state.valve, state.sent_v[None]])
    share, hole = openings(b.rig, (k.spool_response * inputs).sum(axis=1))
    s = _unpack(b, state)
    history = np.empty((b.substeps, *s.pressure.shape))
    stops = bool(np.any(np.abs(s.position - c.STROKE_M / 2) > c.STROKE_M / 2 - 5e-3))
    for j in range(b.substeps):
        flow, warmth, drawn = _flows(b, s, share[j], hole[j])
        _mechanics(b, s, stops)
        _chambers(b, s, flow, warmth)
        if k.droops:
            refill = (b.rig.supply_pressure_pa - s.supply) / b.rig.supply_resistance_pa_s_kg
            s.supply = s.supply + k.tank_gain * (refill - drawn)
        history[j] = s.pressure
    return c.State(
        s.pressure,
        s.energy / (c.CV_J_KG_K * s.mass),
        s.wall,
        s.position,
        s.velocity,
        s.supply,
        (k.valve_response * inputs).sum(axis=1),
        k.read_keep * state.read_pa + (k.read_weight * history).sum(axis=0),
        np.asarray(command_v, float),
        _shown(b.rig, state),
    )


def _shown(rig: c.CrrRig, state: c.State) -> np.ndarray:
    """What the sensors send now."""
    cap = state.read_pa[0] + rig.cap_pressure_offset_pa
    return np.stack([state.position_m, cap, state.read_pa[1]])


def _unpack(b: Bench, state: c.State) -> SimpleNamespace:
    """Mutable working copy, with mass and internal energy."""
    volume = b.constant.volume_0 + b.constant.volume_1 * state.position_m
    energy = state.pressure_pa * volume / (c.KAPPA - 1)
    # A rig without a tank has an ideal supply, whatever the state says (window replays).
    supply = np.where(b.rig.tank_per_m3 > 0, state.supply_pa, b.rig.supply_pressure_pa)
    return SimpleNamespace(
        pressure=state.pressure_pa,
        temperature=state.temperature_k,
        wall=state.wall_k,
        position=state.position_m,
        velocity=state.velocity_m_s,
        supply=supply,
        volume=volume,
        energy=energy,
        mass=energy / (c.CV_J_KG_K * state.temperature_k),
    )


def _stream(outside_pa, outside_k, inside_pa, inside_k, area) -> tuple[np.ndarray, np.ndarray]:
    """Mass flow inwards and its product with the temperature of the gas that flows."""
    inward = outside_pa >= inside_pa
    up = np.maximum(outside_pa, inside_pa)
    up_k = np.where(inward, outside_k, inside_k)
    ratio = np.minimum(outside_pa, inside_pa) / up
    flow = np.where(inward, area, -area) * nozzle(ratio) * up / np.sqrt(up_k)
    return flow, flow * up_k


def _flows(b: Bench, s: SimpleNamespace, share, hole):
    """Mass flow and mass flow times temperature into each chamber; flow drawn from the supply."""
    rig, k, p, t = b.rig, b.constant, s.pressure, s.temperature
    inlet = rig.ambient_pressure_pa + share * (s.supply - rig.ambient_pressure_pa)
    flow, warmth = _stream(inlet, rig.supply_temperature_k, p, t, hole)
    drawn = (share * flow).sum(axis=0) if k.droops else 0.0
    if k.leaky:  # from outside into the cap side, and from the rod side into it
        outside_pa = np.stack([rig.ambient_pressure_pa, p[1]])
        outside_k = np.stack([rig.ambient_temperature_k, t[1]])
        lost, lost_warmth = _stream(outside_pa, outside_k, p[0], t[0], k.leaks)
        flow[0] += lost[0] + lost[1]
        warmth[0] += lost_warmth[0] + lost_warmth[1]
        flow[1] -= lost[1]
        warmth[1] -= lost_warmth[1]
    return flow, warmth, drawn


def _mechanics(b: Bench, s: SimpleNamespace, stops: bool) -> None:
    """Velocity by the secant of the friction at the old one, then position."""
    rig, dt = b.rig, b.step_s
    v = s.velocity
    speed = np.maximum(np.abs(v), LEAST_SPEED_M_S)
    relative = np.minimum(speed / c.STRIBECK_VELOCITY_M_S, 2.0)  # nothing is left above
    squared = relative * relative
    dry = rig.coulomb_n + rig.stiction_excess_n * np.exp(-squared * squared * relative)
    along = b.constant.wave_number * s.position + rig.friction_phase_rad
    dry = dry * (1 + rig.friction_wave * np.cos(along))
    steep = c.STEEPNESS_S_M * speed
    other = steep / np.sqrt(1 + steep**2)
    begun = np.tanh(steep)
    begun = begun + rig.smoothing_share * (other - begun)
    drag = dry * begun / speed + rig.viscous_n_s_m + rig.quadratic_drag_n_s2_m2 * speed
    force = s.pressure[0] * c.CAP_AREA_M2 - s.pressure[1] * c.AREAS_M2[1] + b.constant.load
    if stops:
        force = force + _stop_force(s.position, v)
    inertia = rig.moving_mass_kg / dt
    s.velocity = (inertia * v + force) / (inertia + drag)
    s.position = s.position + dt * s.velocity


def _stop_force(position, velocity):
    k, d = c.STOP_STIFFNESS_N_M, c.STOP_DAMPING_N_S_M
    low = np.where(position < 0, np.maximum(-k * position - d * velocity, 0), 0)
    over = position - c.STROKE_M
    return low - np.where(over > 0, np.maximum(k * over + d * velocity, 0), 0)


def _chambers(b: Bench, s: SimpleNamespace, flow, warmth) -> None:
    """Energy and mass balances; the piston work uses the new velocity, like the force."""
    rig, k, dt = b.rig, b.constant, b.step_s
    power = c.CP_J_KG_K * warmth - s.pressure * (k.volume_1 * s.velocity)
    if k.warm:
        surface = k.surface_0 + k.surface_1 * s.position
        heat = k.heat * surface * np.sqrt(s.pressure * s.temperature) * (s.wall - s.temperature)
        power = power + heat
        loss = rig.wall_loss_w_k * (rig.ambient_temperature_k - s.wall)
        s.wall = s.wall + dt * rig.wall_k_per_j * (loss - heat)
    s.energy = s.energy + dt * power
    s.mass = s.mass + dt * flow
    s.volume = k.volume_0 + k.volume_1 * s.position
    s.pressure = (c.KAPPA - 1) * s.energy / s.volume
    s.temperature = s.energy / (c.CV_J_KG_K * s.mass)


def observed(state: c.State) -> dict[str, np.ndarray]:
    """Noise-free readings as they arrive, and the truth of this instant."""
    return dict(
        position_m=state.shown[0],
        cap_pressure_pa=state.shown[1],
        rod_pressure_pa=state.shown[2],
        supply_pa=state.supply_pa,
        true_position_m=state.position_m,
        velocity_m_s=state.velocity_m_s,
        true_cap_pressure_pa=state.pressure_pa[0],
        true_rod_pressure_pa=state.pressure_pa[1],
        cap_temperature_k=state.temperature_k[0],
        rod_temperature_k=state.temperature_k[1],
    )


def open_loop(
    rig: c.CrrRig, command_v: np.ndarray, initial: c.State, substeps: int = SUBSTEPS
) -> dict[str, np.ndarray]:
    """Noise-free response to commands of shape (n_samples, n_columns) or (n_samples,).

    Entry k of every array is at time k ms, when command k leaves the computer.
    """
    prepared = bench(rig, substeps)
    n = len(prepared.rig.moving_mass_kg)
    command = np.asarray(command_v, float)
    command = np.broadcast_to(command.reshape(len(command), -1), (len(command), n))
    rows, state = [], initial
    for row in command:
        rows.append(observed(state))
        state = advance(prepared, state, row)
    return {name: np.stack([r[name] for r in rows]) for name in rows[0]}
