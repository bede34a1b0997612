"""Gas volumes with walls that warm up, joined by holes: the truth of dedicated recordings.

    dm/dt = sum mdot,   dU/dt = c_p sum(mdot T_up) + Q - p dV/dt,   p = (kappa-1) U/V, T = U/(c_v m)
    Q = lambda A sqrt(p T / (p_0 T_0)) (T_w - T),   C_w dT_w/dt = h (T_amb - T_w) - Q

by Runge-Kutta of order 4 with a fixed step; many runs side by side as columns.

Source: physics.md 1.1, 1.2, 2.4, 6 (wall_temperature).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from studies.truth.drive import CP_J_KG_K, CV_J_KG_K, HEAT_PRESSURE_PA, HEAT_TEMPERATURE_K, KAPPA

ROOM_K = 293.15
Volumes = Callable[[float], tuple[np.ndarray, np.ndarray, np.ndarray]]
Flows = Callable[[float, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Network:
    """Volumes and what flows between them, at every time; arrays have shape (n_volumes, n_columns).

    volumes    t -> volume, its growth and the surface of the wall
    flows      (t, p, T) -> mass flow into each volume, and the same times upstream temperature
    """

    volumes: Volumes
    flows: Flows
    heat_transfer_w_m2_k: float
    wall_j_k: float = 120.0
    wall_loss_w_k: float = 0.5


def passed(area_m2, law, above: tuple, below: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Mass flow from above to below, and the same times its temperature; an end is (p, T).

    `law` is psi times its constants, so that mdot = area law(p_d/p_u) p_u / sqrt(T_u).
    """
    (above_pa, above_k), (below_pa, below_k) = above, below
    up_pa, down_pa = np.maximum(above_pa, below_pa), np.minimum(above_pa, below_pa)
    up_k = np.where(above_pa >= below_pa, above_k, below_k)
    flow = np.sign(above_pa - below_pa) * area_m2 * law(down_pa / up_pa) * up_pa / np.sqrt(up_k)
    return flow, flow * up_k


def tabulated(law: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    """A flow function as a table over the pressure ratio, dense where it is steep: far cheaper."""
    ratio = np.concatenate([np.linspace(0.0, 0.98, 2000), np.linspace(0.98, 1.0, 2001)[1:]])
    value = law(ratio)
    return lambda r: np.interp(r, ratio, value)


def constant_volumes(volume_m3: np.ndarray, surface_m2: np.ndarray) -> Volumes:
    """Rigid volumes."""
    still = np.zeros_like(volume_m3)
    return lambda t: (volume_m3, still, surface_m2)


def run(
    network: Network,
    pressure_pa: np.ndarray,
    samples: int,
    sample_time_s: float,
    substeps: int = 1,
) -> np.ndarray:
    """Pressures at every sample, shape (samples, n_volumes, n_columns), from gas at room."""
    pressure_pa = np.asarray(pressure_pa, float)
    energy = pressure_pa * network.volumes(0.0)[0] / (KAPPA - 1)
    state = np.stack([energy / (CV_J_KG_K * ROOM_K), energy, np.full_like(energy, ROOM_K)])
    step_s = sample_time_s / substeps
    seen = np.empty((samples, *pressure_pa.shape))
    for k in range(samples):
        seen[k] = (KAPPA - 1) * state[1] / network.volumes(k * sample_time_s)[0]
        for j in range(substeps):
            state = _stepped(network, (k * substeps + j) * step_s, state, step_s)
    return seen


def _stepped(network: Network, t: float, state: np.ndarray, h: float) -> np.ndarray:
    k1 = _rates(network, t, state)
    k2 = _rates(network, t + h / 2, state + h / 2 * k1)
    k3 = _rates(network, t + h / 2, state + h / 2 * k2)
    k4 = _rates(network, t + h, state + h * k3)
    return state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def _rates(network: Network, t: float, state: np.ndarray) -> np.ndarray:
    mass, energy, wall_k = state
    volume, growth, surface = network.volumes(t)
    pressure, temperature = (KAPPA - 1) * energy / volume, energy / (CV_J_KG_K * mass)
    flow, carried = network.flows(t, pressure, temperature)
    load = np.sqrt(pressure * temperature / (HEAT_PRESSURE_PA * HEAT_TEMPERATURE_K))
    heat = network.heat_transfer_w_m2_k * surface * load * (wall_k - temperature)
    warming = (network.wall_loss_w_k * (ROOM_K - wall_k) - heat) / network.wall_j_k
    return np.stack([flow, CP_J_KG_K * carried + heat - pressure * growth, warming])


def lagged(values: np.ndarray, lag_s: float, sample_time_s: float) -> np.ndarray:
    """What a first-order sensor reads of samples along the first axis, from rest."""
    keep = np.exp(-sample_time_s / lag_s)
    read = np.empty_like(values)
    read[0] = values[0]
    for k in range(1, len(values)):
        read[k] = keep * read[k - 1] + (1 - keep) * values[k]
    return read
