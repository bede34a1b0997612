"""Constants and buffers of a batch of true drives: all that does not change from step to step."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from studies.truth import drive as d
from studies.truth.batch import spread
from studies.truth.instruments import sensor_weights, spool_response

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
    drive = spread(drive, n)
    spool, valve = spool_response(drive, step_s, substeps)
    keep, weight = sensor_weights(drive.pressure_lag_s, step_s, substeps)
    constant = SimpleNamespace(
        **_chamber_constants(drive, step_s),
        **_mechanics_constants(drive, step_s),
        spool_response=spool,
        valve_response=valve,
        read_keep=keep,
        read_weight=weight,
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
        asymmetric=bool(np.any(p.discharge_asymmetry != 0)),
        droops=bool(np.any(p.tank_per_m3 > 0)),
        slides_open=bool(np.any(p.sliding_leak_m2_s_m)),
        purged=bool(np.any(p.purge_kg_s)),
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
        lawful=bool(
            np.any([p.quadratic_drag_n_s2_m2, p.sagging_cable_n, p.spot_drag_n_s_m, p.catch_n])
        ),
    )


def _buffers(p: d.Drive, substeps: int) -> SimpleNamespace:
    n = len(p.moving_mass_kg)
    six = (6, 2, n)
    outside_pa = np.empty(six)
    outside_k = np.empty(six)
    outside_pa[:2], outside_pa[2:] = p.supply_pressure_pa, p.ambient_pressure_pa
    outside_k[:2], outside_k[2:] = p.supply_temperature_k, p.ambient_temperature_k
    area = np.zeros((substeps, *six))
    area[:, [1, 3]] = p.spool_leak_m2
    area[:, 4] = np.stack([p.chamber_a_leak_m2, p.chamber_b_leak_m2])
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
