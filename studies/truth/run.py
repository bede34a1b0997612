"""Closed-loop runs of a batch of true drives: sensors, converters, controller, plant."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.truth import drive as d
from studies.truth.batch import stack
from studies.truth.disturbance import disturbance, disturbed
from studies.truth.instruments import quantised
from studies.truth.integrate import advance, bench, observed
from studies.truth.manoeuvre import START_M, Loop, loop_command, start_loop

POSITION_NOISE_M, PRESSURE_NOISE_PA = 5e-6, 500.0
POSITION_STEP_M = 5e-6
PRESSURE_STEP_PA = 10e5 / 4096
COMMAND_STEP_V = 10.0 / 4096
SETTLING_SAMPLES = 300


@dataclass(frozen=True)
class Run:
    """Arrays of shape (n_samples, n_columns), and the states at the asked samples.

    Command k acts from time k ms on; readings k are taken at time k ms.
    """

    readings: dict[str, np.ndarray]
    truth: dict[str, np.ndarray]
    states: dict[int, d.State]


def closed_loop(
    drives: Sequence[d.Drive],
    references_m: np.ndarray,
    generators: Sequence[np.random.Generator],
    keep_states: Sequence[int] = (),
    start_m: float | np.ndarray = START_M,
    disturbances: Sequence[np.random.Generator] = (),
) -> Run:
    """Follow references of shape (n_samples, n_columns), after 0.3 s of unrecorded settling.

    With a generator for each column, each is under a process disturbance of its own.
    """
    prepared = bench(stack(drives))
    lead = np.repeat(references_m[:1], SETTLING_SAMPLES, axis=0)
    reference = np.concatenate([lead, references_m])
    speed = np.gradient(reference, 1e-3, axis=0)
    noise = np.stack([g.standard_normal((len(reference), 4)) for g in generators], axis=-1)
    # The person has tuned the jump a little short of the true half-width: no limit cycle.
    p = prepared.drive
    loop = Loop(p.dead_zone_centre_v, 0.95 * p.dead_zone_half_width_v)
    state = d.at_rest(p, np.full(len(drives), start_m), 0.8 * p.supply_pressure_pa)
    memory = start_loop(state.position_m)
    by = disturbance(len(reference), disturbances) if disturbances else None
    readings, truths, states = [], [], {}
    for k in range(len(reference)):
        seen = observed(p, state)
        reading = _read(seen, noise[k])
        command = loop_command(loop, memory, reference[k], speed[k], reading["position_m"])
        reading["command_v"] = quantised(command, COMMAND_STEP_V)
        readings.append(reading)
        truths.append(seen)
        if k - SETTLING_SAMPLES in keep_states:
            states[k - SETTLING_SAMPLES] = state
        sent = reading["command_v"]
        state = disturbed(prepared, state, sent, by, k) if by else advance(prepared, state, sent)
    return Run(_columns(readings), _columns(truths), states)


def commanded(
    drives: Sequence[d.Drive],
    commands_v: np.ndarray,
    generators: Sequence[np.random.Generator],
    start_m: float | np.ndarray,
    keep_states: Sequence[int] = (),
) -> Run:
    """Play commands of shape (n_samples, n_columns) as they are, after 0.3 s with a shut valve."""
    prepared = bench(stack(drives))
    p = prepared.drive
    shut = np.repeat(p.dead_zone_centre_v[None], SETTLING_SAMPLES, axis=0)
    commands = np.concatenate([shut, commands_v])
    noise = np.stack([g.standard_normal((len(commands), 4)) for g in generators], axis=-1)
    state = d.at_rest(p, np.full(len(drives), start_m), 0.8 * p.supply_pressure_pa)
    readings, truths, states = [], [], {}
    for k, command in enumerate(commands):
        seen = observed(p, state)
        command_v = quantised(command, COMMAND_STEP_V)
        readings.append({**_read(seen, noise[k]), "command_v": command_v})
        truths.append(seen)
        if k - SETTLING_SAMPLES in keep_states:
            states[k - SETTLING_SAMPLES] = state
        state = advance(prepared, state, command_v)
    return Run(_columns(readings), _columns(truths), states)


def _columns(rows: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    rows = rows[SETTLING_SAMPLES:]
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def _read(seen: dict[str, np.ndarray], noise: np.ndarray) -> dict[str, np.ndarray]:
    """Noise, then quantisation."""
    position = seen["position_m"] + POSITION_NOISE_M * noise[0]
    reading = dict(position_m=quantised(position, POSITION_STEP_M))
    for row, name in enumerate(("pressure_a_pa", "pressure_b_pa", "supply_pa"), start=1):
        reading[name] = quantised(seen[name] + PRESSURE_NOISE_PA * noise[row], PRESSURE_STEP_PA)
    return reading
