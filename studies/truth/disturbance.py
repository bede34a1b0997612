"""The process disturbance of a plant used as truth: a force and a flow into each chamber.

Both are first-order noise of 20 Hz corner frequency, exactly sampled: sigma = 1 N and 0.5 % of the
valve's full flow.  The flow comes at the temperature of the chamber.

Source: physics.md section 2 (process disturbance).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.truth import drive as d
from studies.truth.bench import SAMPLE_TIME_S, Bench
from studies.truth.integrate import advance

CORNER_HZ = 20.0
FORCE_N = 1.0
FLOW_KG_S = 0.005 * d.FULL_AREA_M2 * d.DISCHARGE * d.CHOKED * 7e5 / np.sqrt(293.15)


@dataclass(frozen=True)
class Disturbance:
    """Force, (n_samples, n_columns), and flow into both chambers, (n_samples, 2, n_columns)."""

    force_n: np.ndarray
    flow_kg_s: np.ndarray


def disturbance(samples: int, generators: Sequence[np.random.Generator]) -> Disturbance:
    """One draw for each column, from its own generator."""
    normal = np.stack([g.standard_normal((samples, 3)) for g in generators], axis=-1)
    kept = np.exp(-2.0 * np.pi * CORNER_HZ * SAMPLE_TIME_S)
    rows = [normal[0]]
    for fresh in normal[1:]:
        rows.append(kept * rows[-1] + np.sqrt(1.0 - kept**2) * fresh)
    coloured = np.stack(rows)
    return Disturbance(FORCE_N * coloured[:, 0], FLOW_KG_S * coloured[:, 1:])


def disturbed(
    b: Bench, state: d.State, command_v: np.ndarray, by: Disturbance, sample: int
) -> d.State:
    """`advance` under the disturbance of a sample; the flow enters half before, half after."""
    force_n = b.drive.constant_force_n + by.force_n[sample]
    pushed = replace(b, drive=replace(b.drive, constant_force_n=force_n))
    half_kg = 0.5 * SAMPLE_TIME_S * by.flow_kg_s[sample]
    moved = advance(pushed, _filled(b, state, half_kg), command_v)
    filled = _filled(b, moved, half_kg)
    gained_pa = filled.pressure_pa - moved.pressure_pa
    # A sensor sees it too, all of it at once where it has no lag.
    return replace(filled, read_pa=moved.read_pa + b.constant.read_weight[-1] * gained_pa)


def _filled(b: Bench, state: d.State, mass_kg: np.ndarray) -> d.State:
    """Gas of the chamber's own temperature added at once: dU = c_p T dm."""
    volume = b.constant.volume_0 + b.constant.signed_area * state.position_m
    mass = state.pressure_pa * volume / (d.GAS_CONSTANT_J_KG_K * state.temperature_k)
    gained = (d.KAPPA - 1.0) * d.CP_J_KG_K * state.temperature_k * mass_kg / volume
    pressure = state.pressure_pa + gained
    temperature = pressure * volume / ((mass + mass_kg) * d.GAS_CONSTANT_J_KG_K)
    return replace(state, pressure_pa=pressure, temperature_k=temperature)
