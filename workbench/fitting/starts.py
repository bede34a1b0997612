"""Where a simulation of a recording starts: states from what was recorded.

Positions and pressures are recorded, speeds are slopes.  The gas masses are not, and they matter: a
gas 15 K off wall temperature makes a closed chamber drift as fast as a leak does.  They follow from
the energy balance read backwards, sample by sample,

    kappa R T_in mdot = V dp/dt + kappa p dV/dt - (kappa - 1) Q,    T_in = T_s or the gas's own

with recorded p and V and the plant's own heat flow Q; without a supply T_s is that of the
atmosphere.  Errors fade with the wall's time constant.

Where a piston hits something or a valve opens within a sample, a slope over 15 samples is wrong by
a few tenths of a metre per second, and so is a mass that follows from it.  There the slope over
five is taken, and what both differ by is how well the state is known.  Coils and armatures of
solenoid valves follow from the commands alone: they are simulated from the start of each piece, at
the plant's own values.

Short holes in a channel, and what lies between the samples of a slow sensor, are bridged by
straight lines; what these may be off is how well the state and its rate are known there.  In long
ones, and next to them, nothing is known of any state: they keep their guess with the deviation of a
state that is not measured, and the masses are followed anew behind them, as at the start of a
piece.

Source: physics.md 1.2 level 1, solved for the mass flow.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise

import casadi as ca
import numpy as np

from workbench.air import HEAT_CAPACITY_RATIO
from workbench.called import result
from workbench.effects.solenoid_valve import SolenoidValve
from workbench.fitting.holes import SMOOTHING_SAMPLES, bridged, bridging_errors, long_holes
from workbench.gas_volume import GasVolume
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import simulate

SUDDEN_SAMPLES = 5  # the same where it changes suddenly
SUDDEN = 6.0  # times the usual difference of both: four standard deviations of noise alone
ROUNDED = 1e-6  # of their largest difference: what is less is rounding
CHUNK = 500  # samples that are followed in one call
OBSERVED_MASS_SHARE = 0.01  # standard deviation of a gas mass that was followed
RESUMED_MASS_SHARE = 0.05  # the same where it was lost from sight: 15 K, in full motion


def guessed_states(plant: Plant, recording: Recording, known: Collection[str] = ()) -> np.ndarray:
    """States at every sample and their standard deviations from the recording, (2, n_x, n).

    Gas and valves are not followed where their states are ``known`` already.
    """
    blind = long_holes(plant, recording)
    states = sensed_states(plant, recording, blind)
    if not states.size:
        return states
    _follow_valves(plant, recording, states, blind, known)
    weighed = [p for p in plant.parts if isinstance(p, GasVolume) and p.level.counts_mass]
    for part in weighed:
        wanted = f"{part.name}.mass_kg" not in known
        if wanted and f"{part.name}.pressure_pa" in recording.channels:
            _follow_gas(plant, part, recording, states, blind)
    return states


def sensed_states(plant: Plant, recording: Recording, blind: np.ndarray) -> np.ndarray:
    """The same with gas at the temperature of its wall: in no time, and 15 K off in full motion.

    ``blind`` tells the samples, (n,), at which nothing is known.
    """
    n, starts = len(recording), recording.starts
    calm = {name: bridged(values, starts) for name, values in recording.channels.items()}
    calm["time_s"] = recording.time_s
    seen, off = dict(calm), {}
    for name, values in recording.channels.items():
        off[name], rate_off = bridging_errors(values, starts)
        speed = name.replace("position_m", "velocity_m_s").replace("angle_rad", "velocity_rad_s")
        if speed != name and speed not in recording.channels:
            calm[speed], seen[speed] = _slopes(calm[name], recording)
            off[speed] = rate_off / recording.sample_time_s
    rows = []
    for member in plant.members:
        guesses, others = member.guess(seen), member.guess(calm)
        for quantity, (value, _) in guesses.items():
            seen.setdefault(f"{member.name}.{quantity}", np.broadcast_to(value, (n,)))
            other = np.broadcast_to(others[quantity][0], (n,))
            calm.setdefault(f"{member.name}.{quantity}", other)
        for state in member.states():
            value, deviation = guesses.get(state.quantity, (float(state.initial), state.scale))
            smooth = others.get(state.quantity, (value,))[0]
            deviation = np.maximum(deviation, _near(value - smooth))
            deviation = np.maximum(deviation, off.get(f"{member.name}.{state.quantity}", 0.0))
            values = np.broadcast_to(np.asarray(value, dtype=float), (n,))
            values = np.where(np.isfinite(values), values, float(state.initial))
            rows.append(np.stack([values, np.where(blind, state.scale, deviation)]))
    return np.stack(rows, axis=1) if rows else np.zeros((2, 0, n))


def _slopes(values: np.ndarray, recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Rate of a recorded channel, smooth; and with that of a few samples where it is another one.

    Where something hits or a valve opens within a sample, the long parabola is off by most of what
    it differs from the short one.  What noise does is less than a few times their usual difference.
    """
    dt, starts = recording.sample_time_s, recording.starts
    smooth, quick = slope(values, dt, starts), slope(values, dt, starts, SUDDEN_SAMPLES)
    apart = np.abs(quick - smooth)
    differing = apart[apart > ROUNDED * apart.max()]  # of a coarse sensor at rest they do not
    usual = np.median(differing) if differing.size else 0.0
    return smooth, np.where(apart > SUDDEN * usual, quick, smooth)


def _near(apart: np.ndarray | float) -> np.ndarray | float:
    """How far two guesses are apart at most within a few samples, shape of ``apart``."""
    from scipy.ndimage import maximum_filter1d

    return maximum_filter1d(np.abs(apart), SUDDEN_SAMPLES) if np.ndim(apart) else abs(apart)


def slope(
    values: np.ndarray,
    sample_time_s: float,
    starts: tuple[int, ...],
    samples: int = SMOOTHING_SAMPLES,
) -> np.ndarray:
    """Rate of a recorded channel by a moving parabola inside each piece, shape (n,).

    ``samples`` is the odd length of the parabola.
    """
    from scipy.signal import savgol_filter

    rate = np.zeros(len(values))
    for first, last in zip(starts, (*starts[1:], len(values)), strict=True):
        width = min(samples, (last - first - 1) // 2 * 2 + 1)
        if width >= 3:
            rate[first:last] = savgol_filter(
                np.nan_to_num(values[first:last]), width, 2, deriv=1, delta=sample_time_s
            )
    return rate


def _follow_gas(
    plant: Plant, chamber: GasVolume, recording: Recording, states: np.ndarray, blind: np.ndarray
) -> None:
    """Write the followed mass of one chamber, and its deviation, into the guessed states."""
    model, dt = plant.model, recording.sample_time_s
    names = list(model.states)
    row = names.index(f"{chamber.name}.mass_kg")
    pressure = names.index(f"{chamber.name}.pressure_pa")
    rates = _slopes(states[0, pressure], recording)
    u, d = (
        np.array([bridged(recording[n], recording.starts) for n in group]).reshape(
            len(group), len(recording)
        )
        for group in (model.commands, model.measured_inputs)
    )
    p = plant.nominal[2]
    flow = _flow_from_energy(plant, chamber, row)
    for first, last in _seen_pieces(recording, blind):
        smooth, masses = (
            _folded(
                flow,
                states[0, row, first],
                [v[:, first:last] for v in (states[0], rate[None, :], u, d)],
                p,
                dt,
            )
            for rate in rates
        )
        share = OBSERVED_MASS_SHARE if first == 0 else RESUMED_MASS_SHARE
        known_kg = share * np.maximum(masses, np.median(masses))
        known_kg = np.maximum(known_kg, _near(masses - smooth))
        states[1, row, first:last] = known_kg[0]
        states[0, row, first + 1 : last] = masses[:-1]
        states[1, row, first + 1 : last] = known_kg[:-1]


def _follow_valves(
    plant: Plant,
    recording: Recording,
    states: np.ndarray,
    blind: np.ndarray,
    known: Collection[str],
) -> None:
    """Write coils and armatures, which follow their commands alone, into the guessed states."""
    valves = [e for e in plant.effects if isinstance(e, SolenoidValve)]
    own = [f"{valve.name}.{state.quantity}" for valve in valves for state in valve.states()]
    if all(name in known for name in own):
        return
    rows = [list(plant.model.states).index(name) for name in own]
    for first, last in pairwise((*recording.starts, len(recording))):
        begun = plant.initial
        begun[rows] = states[0, rows, first]
        try:
            run = simulate(plant, recording.part(first, last), begun)
        except ArithmeticError:
            continue
        there = ~blind[first:last]
        states[0, rows, first:last] = np.where(there, run.rows(own), states[0, rows, first:last])


def _seen_pieces(recording: Recording, blind: np.ndarray) -> list[tuple[int, int]]:
    """First and last sample of every stretch without a gap or a long hole."""
    new = np.diff(np.concatenate([[True], blind, [True]]).astype(int))
    begins, ends = np.flatnonzero(new == -1), np.flatnonzero(new == 1)
    return [
        (int(first), int(last))
        for begin, end in zip(begins, ends, strict=True)
        for first, last in pairwise([begin, *(s for s in recording.starts if begin < s < end), end])
    ]


def _folded(
    flow: ca.Function, mass: float, columns: list[np.ndarray], p: np.ndarray, dt: float
) -> np.ndarray:
    """The followed mass after every sample, shape (n,), in chunks: long graphs build slowly."""
    n = columns[0].shape[1]
    chunk = flow.mapaccum(CHUNK)
    held = np.tile(p[:, None], CHUNK), np.full((1, CHUNK), dt)
    found = np.zeros(0)
    for first in range(0, n, CHUNK):
        part = [c[:, first : first + CHUNK] for c in columns]
        short = CHUNK - part[0].shape[1]
        part = [np.pad(c, ((0, 0), (0, short)), mode="edge") for c in part]
        found = np.append(found, result(chunk, [[mass]], *part, *held).ravel())
        mass = found[-1]
    return found[:n]


def _flow_from_energy(plant: Plant, chamber: GasVolume, row: int) -> ca.Function:
    """(mass, x, dp/dt, u, d, p, dt) -> mass one sample later, by the module's equation."""
    model, kappa = plant.model, HEAT_CAPACITY_RATIO
    x, u, d, p = model.symbols
    own, around = model.conditions[chamber.name], model.conditions
    source = around["supply" if "supply" in around else "atmosphere"]
    heat_w = sum(
        value
        for (_, kind, balance), value in model.flows.items()
        if kind == "HeatFlow" and balance == chamber.name
    )
    mass, rate, dt = ca.SX.sym("mass"), ca.SX.sym("rate"), ca.SX.sym("dt")
    energy_w = own.volume_m3 * rate + kappa * own.pressure_pa * own.volume_rate_m3_s
    energy_w -= (kappa - 1.0) * heat_w
    source_k = ca.if_else(energy_w > 0, source.temperature_k, own.temperature_k)
    later = x[row] + dt * energy_w / (kappa * chamber.gas_constant_j_kg_k * source_k)
    later = ca.substitute(later, x[row], mass)
    return ca.Function("gas", [mass, x, rate, u, d, p, dt], [later])
