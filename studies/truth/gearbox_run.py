"""Integrator of the true gearbox: second order in steps of 20 microseconds, one evaluation a step.

    bodies   leap-frog: speeds live half a step beside the places; dry, viscous and contact forces
             are taken in the middle of the step by their slope (of all bodies at once), since
             friction at rest is faster than the step (1e5 1/s)
    gas      mass and energy by Adams and Bashforth for flow and heat; the work of the pistons with
             the pressure halfway, by what has flowed and by the isentrope:
             p + ((kappa - 1) dU - kappa p dV) / (2 V)
    valves   `gearbox_valves`

Halving the step changes a shift by less than a tenth of the sensor noise (test).
Source: physics.md 1.1 to 1.4, 2.5.
"""

from dataclasses import dataclass

import numpy as np

from studies.truth import gearbox as g
from studies.truth.gearbox_valves import advance_valves, seat_areas
from studies.truth.hole import scale, stream
from studies.truth.instruments import sensor_weights

SAMPLE_TIME_S = 1e-3
SUBSTEPS = 50
FLOW_SCALE = scale(g.GAS_CONSTANT_J_KG_K)
IMPLICIT = 0.5  # where in the step forces by speed are taken
_INSIDE = [0, 0, 1, 1, 2]  # chamber of each flow: inlet 1, exhaust 1, inlet 2, exhaust 2, port
_FIRST = [0, 2, 4]


@dataclass(frozen=True)
class Bench:
    """A batch with what does not change from step to step."""

    gearbox: g.Gearbox
    substeps: int
    outside_pa: np.ndarray
    outside_k: np.ndarray
    read_keep: np.ndarray
    read_weight: np.ndarray

    @property
    def step_s(self) -> float:
        """Length of a step."""
        return SAMPLE_TIME_S / self.substeps


def bench(p: g.Gearbox, substeps: int = SUBSTEPS) -> Bench:
    """Prepare a batch (fields of shape (n_columns,)) for `advance`."""
    supply, room = p.supply_pressure_pa, p.ambient_pressure_pa
    keep, weight = sensor_weights(p.pressure_lag_s, SAMPLE_TIME_S / substeps, substeps)
    return Bench(
        gearbox=p,
        substeps=substeps,
        outside_pa=np.stack([supply, room, supply, room, room]),
        outside_k=np.stack(
            [p.supply_temperature_k, p.ambient_temperature_k] * 2 + [p.ambient_temperature_k]
        ),
        read_keep=keep,
        read_weight=weight,
    )


def advance(b: Bench, state: g.State, on: np.ndarray) -> g.State:
    """State one sample later; `on`, shape (substeps, 2, n), is 1 where a valve is energised."""
    p, h = b.gearbox, b.step_s
    lifts, valve = advance_valves(p, state, on, h)
    areas = FLOW_SCALE * seat_areas(p, lifts)
    gas, body, slip, before = state.gas, state.body, state.slip, state.gas_rate
    volume = g.volumes(p, body[0], body[1])
    history = np.empty((b.substeps, 2, len(slip)))
    for k in range(b.substeps):
        pressure = (g.KAPPA - 1.0) * gas[1] / volume
        rate = _gas_rates(b, gas, pressure, body[0], areas[k])
        body, slip = _moved(p, pressure, body, slip, h)
        added = h * (1.5 * rate - 0.5 * before)
        gas = gas + added
        grown = g.volumes(p, body[0], body[1])
        gained = grown - volume
        halfway = (
            pressure + 0.5 * ((g.KAPPA - 1.0) * added[1] - g.KAPPA * pressure * gained) / volume
        )
        gas[1] -= halfway * gained
        before, volume = rate, grown
        history[k] = (g.KAPPA - 1.0) * gas[1, :2] / volume[:2]
    read = b.read_keep * state.read_pa + (b.read_weight * history).sum(axis=0)
    return g.State(gas, body, valve, slip, read, before)


def _gas_rates(b: Bench, gas, pressure, main_m, area) -> np.ndarray:
    """Rates of mass, energy (without the work of the pistons) and wall temperature."""
    p = b.gearbox
    temperature = gas[1] / (g.CV_J_KG_K * gas[0])
    flow, brought = stream(b.outside_pa, b.outside_k, pressure[_INSIDE], temperature[_INSIDE])
    flow *= area
    surface = np.empty_like(pressure)
    surface[0] = 2 * g.PISTON_M2 + 4 * g.PISTON_M2 / 50e-3 * (main_m + g.STROKE_M)
    surface[1:] = 2 * g.RING_M2
    heat = p.heat_transfer_w_m2_k * surface * (gas[2] - temperature)
    rate = np.empty_like(gas)
    rate[0] = np.add.reduceat(flow, _FIRST, axis=0)
    rate[1] = g.CP_J_KG_K * np.add.reduceat(flow * brought, _FIRST, axis=0) + heat
    lost = p.wall_loss_w_k * (p.ambient_temperature_k - gas[2])
    rate[2] = p.wall_k_per_j * (lost - heat)
    return rate


def _moved(p: g.Gearbox, pressure, body, slip, h) -> tuple[np.ndarray, np.ndarray]:
    """Places and speeds one step later, and the slip of the gear."""
    x, x_f, tip, v, v_f, v_tip = body
    along = 1.0 + p.friction_wave * np.cos(
        2 * np.pi * x / p.friction_wavelength_m + p.friction_phase_rad
    )
    main, main_slope = _dry(p, v, p.coulomb_main_n * along, p.viscous_main_n_s_m)
    main += p.quadratic_drag_n_s2_m2 * v * np.abs(v)
    rubbing, ring_slope = _dry(p, v_f, p.coulomb_floating_n, p.viscous_floating_n_s_m)
    shank, shank_slope = _dry(p, v - v_f, p.coulomb_shank_n, 0.0)
    touch, touch_slope = _push(x - x_f, v - v_f, p.contact_n_m)
    high, high_slope = _push(np.abs(x) - g.STROKE_M, np.sign(x) * v, p.contact_n_m)
    below, below_slope = _push(-x_f, -v_f, p.contact_n_m)
    above, above_slope = _push(x_f - g.STROKE_M, v_f, p.contact_n_m)
    link = g.LINK_N_M * (x - tip) + g.LINK_N_S_M * (v - v_tip)
    push = pressure[0] * g.PISTON_M2 - pressure[1] * g.SHANK_M2 - pressure[2] * g.BACK_M2
    main_n = push - touch - shank - main - np.sign(x) * high - link
    ring_n = (pressure[2] - pressure[1]) * g.RING_M2 + touch + shank - rubbing + below - above
    shared = IMPLICIT * (shank_slope + touch_slope)
    linked = IMPLICIT * g.LINK_N_S_M
    drag_slope = 2 * p.quadratic_drag_n_s2_m2 * np.abs(v)
    own = p.main_kg / h + IMPLICIT * (main_slope + drag_slope + high_slope) + shared + linked
    ring = p.floating_kg / h + IMPLICIT * (ring_slope + below_slope + above_slope) + shared
    load, blocking = _load(p, tip, slip)
    tip_n = link - load / g.FINGER_M
    finger = p.finger_kg_m2 / g.FINGER_M**2 / h + linked
    gained = main_n + shared / ring * ring_n + linked / finger * tip_n
    gained /= own - shared**2 / ring - linked**2 / finger
    moved = np.empty_like(body)
    moved[3] = v + gained
    moved[4] = v_f + (ring_n + shared * gained) / ring
    moved[5] = v_tip + (tip_n + linked * gained) / finger
    moved[:3] = body[:3] + h * moved[3:]
    out = np.maximum(1.0 - np.abs(tip) / g.SYNCHRONISING_M, 0.0)
    slip = slip + h * ((1.0 - slip) * out / g.SLIPPING_AGAIN_S - blocking / p.synchronising_s)
    return moved, slip


def _dry(p: g.Gearbox, speed, coulomb_n, viscous_n_s_m) -> tuple[np.ndarray, np.ndarray]:
    """Dry and viscous friction, and its slope."""
    relative = g.SHARPNESS_S_M * speed
    smooth = np.tanh(relative)
    root = 1.0 / np.sqrt(1.0 + relative**2)
    share = smooth + p.algebraic_share * (relative * root - smooth)
    steep = 1.0 - smooth**2
    steep = g.SHARPNESS_S_M * (steep + p.algebraic_share * (root**3 - steep))
    return coulomb_n * share + viscous_n_s_m * speed, coulomb_n * steep + viscous_n_s_m


def _push(depth, rate, stiffness) -> tuple[np.ndarray, np.ndarray]:
    """Contact that never pulls, and its slope by speed."""
    force = stiffness * depth + g.CONTACT_N_S_M * rate
    acts = (depth > 0.0) & (force > 0.0)
    return np.where(acts, force, 0.0), np.where(acts, g.CONTACT_N_S_M, 0.0)


def _load(p: g.Gearbox, tip, slip) -> tuple[np.ndarray, np.ndarray]:
    """Torque of detent and synchroniser against positive turns; share of the blocking force."""
    slope = g.STEEPEST * np.sin(2 * np.pi / g.STROKE_M * tip)
    distance = np.abs(tip)
    entered = np.minimum(distance - g.SYNCHRONISING_M, g.SYNCHRONISED_M - distance) / g.EDGE_M
    within = np.minimum(np.maximum(entered, 0.0), 1.0)
    blocking = within * np.minimum(np.maximum(slip / g.SYNCHRONISED_SLIP, 0.0), 1.0)
    blocked = np.sign(tip) * p.synchroniser_n * blocking * g.LOAD_ARM_M
    return slope * p.detent_n * g.DETENT_ARM_M + blocked, blocking


def energised(p: g.Gearbox, command: np.ndarray, substeps: int) -> np.ndarray:
    """Commands as they reach the coils, shape (n_samples, substeps, 2, n), of 0 and 1.

    `command` has shape (n_samples, 2, n); that of valve 1 comes late, to the next step.
    """
    samples, columns = len(command), command.shape[2]
    late = np.round(p.delay_1_s / SAMPLE_TIME_S * substeps).astype(int)
    steps = np.arange(samples * substeps)[:, None]
    sent = np.maximum(steps - late, 0) // substeps
    first = command[sent, 0, np.arange(columns)]
    on = np.stack([first, np.repeat(command[:, 1], substeps, axis=0)], axis=1)
    return on.reshape(samples, substeps, 2, columns)


def open_loop(
    p: g.Gearbox,
    command: np.ndarray,
    initial: g.State,
    substeps: int = SUBSTEPS,
    keep: tuple[int, ...] = (),
) -> tuple[dict[str, np.ndarray], dict[int, g.State]]:
    """Noise-free readings under commands of shape (n_samples, 2, n), and the states at `keep`.

    Entry k is at k ms, before command k acts.  `pressure_1_pa` and `pressure_2_pa` are what the
    sensors read (lag), `body` the places and speeds of the state.
    """
    prepared, states, state = bench(p, substeps), {}, initial
    rows = []
    for k, on in enumerate(energised(p, command, substeps)):
        rows.append((state.body, state.read_pa))
        if k in keep:
            states[k] = state
        state = advance(prepared, state, on)
    body, read = (np.stack(each) for each in zip(*rows, strict=True))
    readings = dict(
        position_m=body[:, 0], pressure_1_pa=read[:, 0], pressure_2_pa=read[:, 1], body=body
    )
    return readings, states
