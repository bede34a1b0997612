"""Constants and buffers of a batch of true drives: all that does not change from step to step."""

from dataclasses import dataclass, fields
from types import SimpleNamespace

import numpy as np

from studies.truth import drive as d

SAMPLE_TIME_S = 1e-3
SUBSTEPS = 50


@dataclass(frozen=True)
class Bench:
    """Constants and buffers of one batch, computed once, so that the inner loop only multiplies."""

    drive: d.Drive
    step_s: float
    substeps: int
    constant: SimpleNamespace
    buffer: SimpleNamespace


def bench(drive: d.Drive, substeps: int = SUBSTEPS) -> Bench:
    """Prepare a batch (fields of shape (n_columns,)) for `advance`."""
    step_s = SAMPLE_TIME_S / substeps
    n = d.columns(drive)
    drive = d.Drive(
        **{
            f.name: np.broadcast_to(getattr(drive, f.name), (n,)).astype(float)
            for f in fields(d.Drive)
        }
    )
    constant = SimpleNamespace(
        **_chamber_constants(drive, step_s),
        **_mechanics_constants(drive, step_s),
        **_valve_response(drive, step_s, substeps),
        **_sensor_weights(drive, step_s, substeps),
    )
    return Bench(drive, step_s, substeps, constant, _buffers(drive, substeps))


def _chamber_constants(p: d.Drive, step_s: float) -> dict:
    area = d.PISTON_AREA_M2
    dead = np.stack([p.dead_volume_a_m3, p.dead_volume_b_m3])
    perimeter = np.pi * d.BORE_M / area
    return dict(
        signed_area=np.array([[area], [-area]]),
        volume_0=dead + np.array([[0.0], [area * d.STROKE_M]]),
        surface_0=2 * area - perimeter * dead,
        surface_1=perimeter,
        heat=p.heat_transfer_w_m2_k / np.sqrt(d.HEAT_PRESSURE_PA * d.HEAT_TEMPERATURE_K),
        wall_gain=step_s * p.wall_k_per_j,
        droops=bool(np.any(p.tank_per_m3 > 0)),
        walls=bool(np.any(p.wall_k_per_j > 0)),
        tank_gain=step_s * d.KAPPA * d.GAS_CONSTANT_J_KG_K * p.supply_temperature_k * p.tank_per_m3,
    )


def _mechanics_constants(p: d.Drive, step_s: float) -> dict:
    def by_direction(sign):
        coulomb = p.coulomb_n * (1 + sign * p.coulomb_asymmetry)
        excess = p.stiction_excess_n * (1 + sign * p.stiction_asymmetry)
        viscous = p.viscous_n_s_m * (1 + sign * p.viscous_asymmetry)
        return np.stack([np.maximum(coulomb, 0.01), np.maximum(excess, 0.0), viscous])

    return dict(
        forward=by_direction(1.0),
        backward=by_direction(-1.0),
        inertia=p.moving_mass_kg / step_s,
        wave_number=2 * np.pi / p.friction_wavelength_m,
        stiff=d.BRISTLE_STIFFNESS_N_M + d.BRISTLE_DAMPING_N_S_M / step_s,
        damp=d.BRISTLE_DAMPING_N_S_M / step_s,
        presliding_gain=1 / (1 - p.presliding_share),
    )


def _valve_response(p: d.Drive, step_s: float, substeps: int) -> dict:
    """Spool at each substep and state after the last, as sums over (state, command).

    The valve is linear and the command constant over a sample, so unit responses suffice.
    """
    period = p.valve_period_s / (2 * np.pi * step_s)
    lag = 1 - np.exp(-step_s / np.maximum(p.valve_lag_s, 1e-12))
    n = len(lag)
    state = np.zeros((3, 4, n))
    state[[0, 1, 2], [0, 1, 2]] = 1.0
    command = np.zeros((4, n))
    command[3] = 1.0
    spool = np.empty((substeps, 4, n))
    for j in range(substeps):
        lagged = state[0] + lag * (command - state[0])
        move = (period**2 * state[2] + lagged - state[1]) / (
            period**2 + 2 * p.valve_damping * period + 1
        )
        state = np.stack([lagged, state[1] + move, move])
        spool[j] = state[1]
    return dict(spool_response=spool, valve_response=state)


def _sensor_weights(p: d.Drive, step_s: float, substeps: int) -> dict:
    """First-order lag of the pressure readings, as weights over the substeps of one sample."""
    keep = np.exp(-step_s / np.maximum(p.pressure_lag_s, 1e-12))
    powers = keep ** np.arange(substeps - 1, -1, -1)[:, None]
    return dict(read_keep=keep**substeps, read_weight=((1 - keep) * powers)[:, None, :])


def _buffers(p: d.Drive, substeps: int) -> SimpleNamespace:
    n = len(p.moving_mass_kg)
    six = (6, 2, n)
    outside_pa = np.empty(six)
    outside_k = np.empty(six)
    outside_pa[:2], outside_pa[2:] = p.supply_pressure_pa, p.ambient_pressure_pa
    outside_k[:2], outside_k[2:] = p.supply_temperature_k, p.ambient_temperature_k
    area = np.zeros((substeps, *six))
    area[:, [1, 3]] = p.spool_leak_m2
    area[:, 4, 0] = p.chamber_a_leak_m2
    area[:, 5] = p.piston_leak_m2
    names = ("difference", "up", "ratio", "cell", "psi", "slope", "flow", "up_k", "enthalpy")
    return SimpleNamespace(
        outside_pa=outside_pa,
        outside_k=outside_k,
        area=area,
        index=np.empty(six, np.intp),
        inward=np.empty(six, bool),
        history=np.empty((substeps, 2, n)),
        **{name: np.empty(six) for name in names},
    )
