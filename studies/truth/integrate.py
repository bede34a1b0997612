"""Integrator of the truth: mass and energy of each chamber explicit, velocity and bristle implicit.

Per step of 20 microseconds, for all columns at once:

    valve       spool in volt, implicit Euler, computed for a whole millisecond beforehand
    mechanics   M (v1 - v0)/dt = S (p_a - p_b) + F_e - F_f(z1, v1) - c(y0, |v0|) v1
                z1 = (z0 + dt v1) / (1 + dt alpha sigma_0 |v0| / g),  linear in v1, so no iteration
    chambers    dU = (c_p sum mdot T + Q) dt - p S dy,  dm = sum mdot dt,  p = (kappa-1) U / V
    walls       C_w dT_w = (h (T_amb - T_w) - Q) dt
    supply      V_t dp_s = kappa R T_s (G_r (p_set - p_s) - sum mdot_in) dt

Laws of `laws` add to F_e and c, to the leak of chamber a and to the flow into b.

Source: physics.md 1.1-1.4, 2.4, 6 (supply_droop, wall_temperature), 8.1.
"""

from types import SimpleNamespace

import numpy as np

from studies.truth import drive as d
from studies.truth import laws
from studies.truth.bench import SUBSTEPS, Bench, bench
from studies.truth.restriction import CELLS, ROW_OFFSET, tables

_INTERCEPT, _SLOPE = tables()


def advance(b: Bench, state: d.State, command_v: np.ndarray) -> d.State:
    """State one sample later, the command of shape (n_columns,) held constant."""
    c, w = b.constant, b.buffer
    play = d.COMMAND_RANGE_V * b.drive.play_share
    left = np.clip(state.left_v, command_v - play, command_v + play)
    inputs = np.concatenate([state.valve, left[None]])
    _open_lands(b, (c.spool_response * inputs).sum(axis=1))
    s = _unpack(b, state)
    stops = bool(np.any(np.abs(state.position_m - d.STROKE_M / 2) > d.STROKE_M / 2 - 5e-3))
    for j in range(b.substeps):
        _flows(b, s, w.area[j])
        _mechanics(b, s, stops)
        _chambers(b, s)
        w.history[j] = s.pressure
    read = c.read_keep * state.read_pa + (c.read_weight * w.history).sum(axis=0)
    return d.State(
        s.pressure,
        s.temperature,
        s.wall,
        s.position,
        s.velocity,
        s.bristle,
        s.supply,
        (c.valve_response * inputs).sum(axis=1),
        left,
        read,
    )


def _unpack(b: Bench, state: d.State) -> SimpleNamespace:
    """Mutable working copy, with mass and internal energy instead of pressure and temperature."""
    volume = b.constant.volume_0 + b.constant.signed_area * state.position_m
    energy = state.pressure_pa * volume / (d.KAPPA - 1)
    # A drive without a tank has an ideal supply, whatever the state says (window replays).
    supply = np.where(b.drive.tank_per_m3 > 0, state.supply_pa, b.drive.supply_pressure_pa)
    return SimpleNamespace(
        pressure=state.pressure_pa.copy(),
        temperature=state.temperature_k.copy(),
        wall=state.wall_k.copy(),
        position=state.position_m.copy(),
        volume=volume,
        energy=energy,
        velocity=state.velocity_m_s.copy(),
        bristle=state.bristle_m.copy(),
        supply=supply,
        mass=energy / (d.CV_J_KG_K * state.temperature_k),
    )


def _open_lands(b: Bench, spool_v: np.ndarray) -> None:
    """Areas of the four controlled lands for every substep, from spool volts (substeps, n).

    s = (u - u_c - w)/(10 - u_c - w) or (u_c - w - u)/(u_c - w);  A = A_max f (1 - (1 - s)^e),
    where an underlap opens every land from its own side of the edge on.
    """
    p = b.drive
    past = spool_v - p.valve_offset_v - p.dead_zone_centre_v
    half, lap = p.dead_zone_half_width_v, p.underlap_v
    up, down = np.maximum(past - half, 0.0), np.maximum(-past - half, 0.0)
    down = np.where(down < d.COMMAND_RANGE_V * p.stuck_band_share, 0.0, down)
    net = up - down
    upper = (net + lap) / (d.COMMAND_RANGE_V - p.dead_zone_centre_v - half + lap)
    lower = (lap - net) / (p.dead_zone_centre_v - half + lap)
    opening = np.clip(np.stack([upper, lower], axis=1), 0.0, 1.0)
    area = d.FULL_AREA_M2 * p.flow_area * (1 - (1 - opening) ** p.area_exponent)
    b.buffer.area[:, 0] = d.SUPPLY_AREA_SHARE * (1 - p.supply_restriction) * area
    exhaust = d.EXHAUST_AREA_SHARE * (1 - p.exhaust_restriction)
    b.buffer.area[:, 2] = exhaust * area[:, ::-1]


def _flows(b: Bench, s: SimpleNamespace, area: np.ndarray) -> None:
    """Mass flow and enthalpy flow over c_p into the chambers, rows as in `restriction`."""
    w = b.buffer
    if b.constant.slides_open:
        area[4, 0] = b.drive.chamber_a_leak_m2 + b.drive.sliding_leak_m2_s_m * np.abs(s.velocity)
    w.outside_pa[5] = s.pressure[::-1]
    w.outside_k[5] = s.temperature[::-1]
    if b.constant.droops:
        w.outside_pa[:2] = s.supply
    np.subtract(w.outside_pa, s.pressure, out=w.difference)
    np.maximum(w.outside_pa, s.pressure, out=w.up)
    np.minimum(w.outside_pa, s.pressure, out=w.ratio)
    np.divide(w.ratio, w.up, out=w.ratio)
    np.multiply(w.ratio, CELLS, out=w.cell)
    np.add(w.cell, ROW_OFFSET, out=w.index, casting="unsafe")
    np.take(_SLOPE, w.index, out=w.slope, mode="clip")
    np.take(_INTERCEPT, w.index, out=w.psi, mode="clip")
    np.multiply(w.slope, w.ratio, out=w.slope)
    np.add(w.psi, w.slope, out=w.psi)
    np.multiply(w.psi, area, out=w.psi)
    np.multiply(w.psi, w.up, out=w.psi)
    np.greater(w.difference, 0.0, out=w.inward)
    if b.constant.asymmetric:
        w.psi[0:3:2] *= 1 + b.drive.discharge_asymmetry * np.where(w.inward[0:3:2], 1.0, -1.0)
    np.copyto(w.up_k, s.temperature)
    np.copyto(w.up_k, w.outside_k, where=w.inward)
    np.sqrt(w.up_k, out=w.slope)
    np.divide(w.psi, w.slope, out=w.psi)
    np.copysign(w.psi, w.difference, out=w.flow)
    np.multiply(w.flow, w.up_k, out=w.enthalpy)


def _mechanics(b: Bench, s: SimpleNamespace, stops: bool) -> None:
    """Velocity and bristle implicit, then position."""
    c, p, dt = b.constant, b.drive, b.step_s
    v, z = s.velocity, s.bristle
    coulomb, excess, viscous = np.where(v >= 0.0, c.forward, c.backward)
    speed = np.abs(v)
    g = coulomb + excess * np.exp(-np.square(v / d.STRIBECK_VELOCITY_M_S))
    g *= 1 + p.friction_wave * np.cos(c.wave_number * s.position + p.friction_phase_rad)
    rate = d.BRISTLE_STIFFNESS_N_M / g
    bent = np.copysign(z, z * v) * rate  # negative while the bristle still springs back
    share = np.minimum(np.maximum((bent - p.presliding_share) * c.presliding_gain, 0.0), 1.0)
    slip = 1 + (0.5 * dt) * (1 - np.cos(np.pi * share)) * speed * rate
    stiff = c.stiff / slip
    force = (s.pressure[0] - s.pressure[1]) * d.PISTON_AREA_M2 + p.constant_force_n
    force -= p.spring_n_m * (s.position - d.STROKE_M / 2)
    if stops:
        force += _stop_force(s.position, v)
    drag = viscous
    if c.lawful:
        force += laws.force_n(p, s.position)
        drag = viscous + laws.drag_n_s_m(p, s.position, speed)
    s.velocity = (c.inertia * v + force - (stiff - c.damp) * z) / (c.inertia + stiff * dt + drag)
    s.bristle = (z + dt * s.velocity) / slip
    s.position = s.position + dt * s.velocity


def _stop_force(position, velocity):
    k, c = d.STOP_STIFFNESS_N_M, d.STOP_DAMPING_N_S_M
    low = np.where(position < 0, np.maximum(-k * position - c * velocity, 0), 0)
    over = position - d.STROKE_M
    return low - np.where(over > 0, np.maximum(k * over + c * velocity, 0), 0)


def _chambers(b: Bench, s: SimpleNamespace) -> None:
    """Energy and mass balances; the piston work uses the new velocity, like the force."""
    c, p, w, dt = b.constant, b.drive, b.buffer, b.step_s
    surface = c.surface_0 + c.surface_1 * s.volume
    heat = np.sqrt(s.pressure * s.temperature)
    heat *= surface
    heat *= c.heat
    heat *= s.wall - s.temperature
    power = np.add.reduce(w.enthalpy, axis=0)
    power *= d.CP_J_KG_K
    power += heat
    power -= s.pressure * (c.signed_area * s.velocity)
    s.energy += dt * power
    s.mass += dt * np.add.reduce(w.flow, axis=0)
    if c.purged:
        s.energy[1] += dt * d.CP_J_KG_K * p.supply_temperature_k * p.purge_kg_s
        s.mass[1] += dt * p.purge_kg_s
    s.volume = c.volume_0 + c.signed_area * s.position
    if c.walls:
        s.wall += c.wall_gain * (p.wall_loss_w_k * (p.ambient_temperature_k - s.wall) - heat)
    if c.droops:
        drawn = np.add.reduce(w.flow[:2], axis=(0, 1))
        refill = (p.supply_pressure_pa - s.supply) / p.supply_resistance_pa_s_kg
        s.supply = s.supply + c.tank_gain * (refill - drawn)
    s.pressure = s.energy / s.volume
    s.pressure *= d.KAPPA - 1
    s.temperature = s.energy / s.mass
    s.temperature *= 1 / d.CV_J_KG_K


def open_loop(
    drive: d.Drive, command_v: np.ndarray, initial: d.State, substeps: int = SUBSTEPS
) -> dict[str, np.ndarray]:
    """Noise-free response to commands of shape (n_samples, n_columns) or (n_samples,).

    Entry k of every array is at time k ms, before command k acts. `pressure_a_pa` and
    `pressure_b_pa` are what the sensors read (lag and offset), `true_*` what is in the chambers.
    """
    prepared = bench(drive, substeps)
    n = d.columns(prepared.drive)
    command = np.asarray(command_v, float)
    command = np.broadcast_to(command.reshape(len(command), -1), (len(command), n))
    states, state = [], initial
    for row in command:
        states.append(observed(prepared.drive, state))
        state = advance(prepared, state, row)
    return {name: np.stack([s[name] for s in states]) for name in states[0]}


def observed(drive: d.Drive, state: d.State) -> dict[str, np.ndarray]:
    """Noise-free readings and the chamber truth of one instant."""
    return dict(
        position_m=state.position_m * (1 + drive.position_scale),
        velocity_m_s=state.velocity_m_s,
        pressure_a_pa=state.read_pa[0] + drive.pressure_a_offset_pa,
        pressure_b_pa=state.read_pa[1],
        supply_pa=state.supply_pa,
        true_pressure_a_pa=state.pressure_pa[0],
        true_pressure_b_pa=state.pressure_pa[1],
        temperature_a_k=state.temperature_k[0],
        temperature_b_k=state.temperature_k[1],
    )
