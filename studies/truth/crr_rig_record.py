"""Recordings of the true `crr_rig`: sensors, converters, position loop, tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from studies.truth import crr_rig as c
from studies.truth.batch import stack
from studies.truth.case import Case, generator
from studies.truth.crr_rig_draw import rig_of
from studies.truth.crr_rig_integrate import SUBSTEPS, advance, bench, observed
from studies.truth.crr_rig_manoeuvre import (
    START_M,
    loop_command,
    start_loop,
    training_reference,
    validation_reference,
)
from studies.truth.instruments import quantised

POSITION_NOISE_M, PRESSURE_NOISE_PA = 5e-5, 500.0
POSITION_STEP_M = c.STROKE_M / 4096  # a potentiometer over the stroke
PRESSURE_STEP_PA = 10e5 / 4096
COMMAND_STEP_V = 10.0 / 4096
SETTLING_SAMPLES = 500
PRESSURES = ("cap_pressure_pa", "rod_pressure_pa", "supply_pa")


@dataclass(frozen=True)
class Run:
    """Arrays of shape (n_samples, n_columns), and the states at the asked samples.

    Command k leaves the computer and readings k arrive there at time k ms.
    """

    readings: dict[str, np.ndarray]
    truth: dict[str, np.ndarray]
    states: dict[int, c.State]


def closed_loop(
    rigs: Sequence[c.CrrRig],
    references_m: np.ndarray,
    generators: Sequence[np.random.Generator],
    keep_states: Sequence[int] = (),
    substeps: int = SUBSTEPS,
) -> Run:
    """Follow references of shape (n_samples, n_columns), after 0.5 s of unrecorded settling."""
    prepared = bench(stack(rigs), substeps)
    lead = np.repeat(references_m[:1], SETTLING_SAMPLES, axis=0)
    reference = np.concatenate([lead, references_m])
    noise = np.stack([g.standard_normal((len(reference), 4)) for g in generators], axis=-1)
    state = c.at_rest(prepared.rig, START_M)
    memory = start_loop(state.position_m, reference[0])
    readings, truths, states = [], [], {}
    for k in range(len(reference)):
        seen = observed(state)
        reading = _read(seen, noise[k])
        command = loop_command(memory, reference[k], reading["position_m"])
        reading["command_v"] = quantised(command, COMMAND_STEP_V)
        if k >= SETTLING_SAMPLES:
            readings.append(reading)
            truths.append(seen)
        if k - SETTLING_SAMPLES in keep_states:
            states[k - SETTLING_SAMPLES] = state
        state = advance(prepared, state, reading["command_v"])
    return Run(_columns(readings), _columns(truths), states)


def _columns(rows: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def _read(seen: dict[str, np.ndarray], noise: np.ndarray) -> dict[str, np.ndarray]:
    """Noise, then quantisation."""
    position = seen["position_m"] + POSITION_NOISE_M * noise[0]
    reading = dict(position_m=quantised(position, POSITION_STEP_M))
    for row, name in enumerate(PRESSURES, start=1):
        reading[name] = quantised(seen[name] + PRESSURE_NOISE_PA * noise[row], PRESSURE_STEP_PA)
    return reading


def record(
    cases: Sequence[Case],
) -> list[tuple[Mapping[str, np.ndarray], Mapping[str, np.ndarray]]]:
    """Training and validation table of every case, all integrated in one batch (10 s, 1 kHz).

    Channels: time_s, command_V, position_mm, cap_bar, rod_side_bar (absolute) and, unless the
    supply droops, supply_bar.
    """
    run = run_cases(cases)
    return [
        (_table(run, 2 * i, case), _table(run, 2 * i + 1, case)) for i, case in enumerate(cases)
    ]


def run_cases(cases: Sequence[Case]) -> Run:
    """The batch behind `record`: columns 2 i (training) and 2 i + 1 (validation), in SI."""
    rigs, references, generators = [], [], []
    for case in cases:
        for purpose, reference in (
            ("training", training_reference),
            ("validation", validation_reference),
        ):
            rigs.append(rig_of(case))
            references.append(reference(generator(case.hidden, case.seed, f"crr_rig {purpose}")))
            generators.append(generator(case.hidden, case.seed, f"crr_rig {purpose} noise"))
    return closed_loop(rigs, np.stack(references, axis=1), generators)


def _table(run: Run, column: int, case: Case) -> dict[str, np.ndarray]:
    r = {name: values[:, column] for name, values in run.readings.items()}
    table = dict(
        time_s=np.arange(len(r["command_v"])) * 1e-3,
        command_V=r["command_v"],
        position_mm=r["position_m"] * 1e3,
        cap_bar=r["cap_pressure_pa"] * 1e-5,
        rod_side_bar=r["rod_pressure_pa"] * 1e-5,
    )
    return {**table, "supply_bar": r["supply_pa"] * 1e-5} if case.supply_recorded else table
