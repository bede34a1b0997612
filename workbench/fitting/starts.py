"""Where a simulation of a recording starts: states from what was recorded.

Positions and pressures are recorded, speeds are slopes.  The gas masses are not, and they matter: a
gas 15 K off wall temperature makes a closed chamber drift as fast as a leak does.  They follow from
the energy balance read backwards, sample by sample,

    kappa R T_in mdot = V dp/dt + kappa p dV/dt - (kappa - 1) Q,    T_in = T_s or the gas's own

with recorded p and V and the plant's own heat flow Q.  Errors fade with the wall's time constant.

Source: physics.md 1.2 level 1, solved for the mass flow.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from workbench.air import HEAT_CAPACITY_RATIO
from workbench.parts import Chamber
from workbench.plant import Plant
from workbench.recording import Recording

SMOOTHING_SAMPLES = 15  # of the parabola through recorded values that gives their slope
CHUNK = 500  # samples that are followed in one call
OBSERVED_MASS_SHARE = 0.01  # standard deviation of a gas mass that was followed


def guessed_states(plant: Plant, recording: Recording) -> np.ndarray:
    """States at every sample and their standard deviations from the recording, (2, n_x, n)."""
    n = len(recording)
    seen = dict(recording.channels)
    for name in list(seen):
        speed = name.replace("position_m", "velocity_m_s").replace("angle_rad", "rate_rad_s")
        if speed != name and speed not in seen:
            seen[speed] = slope(seen[name], recording.sample_time_s, recording.starts)
    rows = []
    for member in plant.members:
        guesses = member.guess(seen)
        for state in member.states():
            value, deviation = guesses.get(state.quantity, (float(state.initial), state.scale))
            values = np.broadcast_to(np.asarray(value, dtype=float), (n,))
            values = np.where(np.isfinite(values), values, float(state.initial))
            rows.append(np.stack([values, np.full(n, deviation)]))
    if not rows:
        return np.zeros((2, 0, n))
    states = np.stack(rows, axis=1)
    for part in plant.parts:
        if isinstance(part, Chamber) and f"{part.name}.pressure_pa" in seen:
            _follow_gas(plant, part, recording, states)
    return states


def slope(values: np.ndarray, sample_time_s: float, starts: tuple[int, ...]) -> np.ndarray:
    """Rate of a recorded channel by a moving parabola inside each piece, shape (n,)."""
    from scipy.signal import savgol_filter

    rate = np.zeros(len(values))
    for first, last in zip(starts, (*starts[1:], len(values)), strict=True):
        width = min(SMOOTHING_SAMPLES, (last - first - 1) // 2 * 2 + 1)
        if width >= 3:
            piece = np.nan_to_num(values[first:last])
            rate[first:last] = savgol_filter(piece, width, 2, deriv=1, delta=sample_time_s)
    return rate


def _follow_gas(plant: Plant, chamber: Chamber, recording: Recording, states: np.ndarray) -> None:
    """Write the followed mass of one chamber, and its deviation, into the guessed states."""
    model, dt = plant.model, recording.sample_time_s
    names = list(model.states)
    row = names.index(f"{chamber.name}.mass_kg")
    pressure = names.index(f"{chamber.name}.pressure_pa")
    rate = slope(states[0, pressure], dt, recording.starts)
    u, d = (
        np.array([recording[n] for n in group]).reshape(len(group), len(recording))
        for group in (model.commands, model.measured_inputs)
    )
    p = plant.nominal[2]
    flow = _flow_from_energy(plant, chamber, row)
    for first, last in zip(recording.starts, (*recording.starts[1:], len(recording)), strict=True):
        columns = (v[:, first:last] for v in (states[0], rate[None, :], u, d))
        masses = _folded(flow, states[0, row, first], [*columns], p, dt)
        states[0, row, first + 1 : last] = masses[:-1]
        states[1, row, first:last] = OBSERVED_MASS_SHARE * np.median(masses)


def _folded(
    flow: ca.Function, mass: float, columns: list[np.ndarray], p: np.ndarray, dt: float
) -> np.ndarray:
    """The followed mass after every sample, shape (n,), in chunks: long graphs build slowly."""
    n = columns[0].shape[1]
    chunk = flow.mapaccum(CHUNK)
    found = np.zeros(0)
    for first in range(0, n, CHUNK):
        part = [c[:, first : first + CHUNK] for c in columns]
        short = CHUNK - part[0].shape[1]
        part = [np.pad(c, ((0, 0), (0, short)), mode="edge") for c in part]
        found = np.append(found, chunk(mass, *part, p, dt).full().ravel())
        mass = found[-1]
    return found[:n]


def _flow_from_energy(plant: Plant, chamber: Chamber, row: int) -> ca.Function:
    """(mass, x, dp/dt, u, d, p, dt) -> mass one sample later, by the module's equation."""
    model, kappa = plant.model, HEAT_CAPACITY_RATIO
    x, u, d, p = model.symbols
    own, supply = model.conditions[chamber.name], model.conditions["supply"]
    heat_w = sum(
        value
        for (_, kind, balance), value in model.flows.items()
        if kind == "HeatFlow" and balance == chamber.name
    )
    mass, rate, dt = ca.SX.sym("mass"), ca.SX.sym("rate"), ca.SX.sym("dt")
    energy_w = own.volume_m3 * rate + kappa * own.pressure_pa * own.volume_rate_m3_s
    energy_w -= (kappa - 1.0) * heat_w
    source_k = ca.if_else(energy_w > 0, supply.temperature_k, own.temperature_k)
    later = x[row] + dt * energy_w / (kappa * chamber.gas_constant_j_kg_k * source_k)
    later = ca.substitute(later, x[row], mass)
    return ca.Function("gas", [mass, x, rate, u, d, p, dt], [later])
