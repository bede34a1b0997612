"""Recordings of the true gearbox, and the misfits by which its small differences are kept small."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from studies.truth import gearbox as g
from studies.truth.batch import stack, take
from studies.truth.case import Case, generator
from studies.truth.gearbox_draw import gearbox_of
from studies.truth.gearbox_manoeuvre import (
    TRAINING_SUPPLY_PA,
    training_command,
    validation_command,
    validation_supply_pa,
)
from studies.truth.gearbox_run import SAMPLE_TIME_S, open_loop
from studies.truth.instruments import quantised
from studies.truth.replay import REPLAY_SUBSTEPS, Replay
from studies.truth.rule import Misfit

Table = Mapping[str, np.ndarray]
POSITION_NOISE_M, PRESSURE_NOISE_PA = 20e-6, 1e3
POSITION_STEP_M = 30e-3 / 4096
PRESSURE_STEP_PA = 16e5 / 4096
WINDOW_SAMPLES = 250
STARTS = tuple(range(0, 4500, 750))
MANOEUVRES = dict(training=training_command, validation=validation_command)


def record(cases: Sequence[Case]) -> list[tuple[Table, Table]]:
    """Training and validation table of every case, all integrated in one batch (5 s, 1 kHz).

    Channels: time_s, command_1, command_2 (0 or 1), position_mm, pressure_1_bar, pressure_2_bar and
    supply_bar (absolute).
    """
    runs = [(case, purpose) for case in cases for purpose in MANOEUVRES]
    batch = stack([_supplied(*each) for each in runs])
    command = np.stack([commands(*each) for each in runs], axis=2)
    readings, _ = open_loop(batch, command, g.at_rest(batch))
    tables = []
    for k, each in enumerate(runs):
        seen = {name: readings[name][:, k] for name in readings if name != "body"}
        supply_pa = np.full(len(command), batch.supply_pressure_pa[k])
        tables.append(_table(command[:, :, k], {**seen, "supply_pa": supply_pa}, *each))
    return list(zip(tables[::2], tables[1::2], strict=True))


def commands(case: Case, purpose: str) -> np.ndarray:
    """Commands of both valves, shape (5000, 2)."""
    return MANOEUVRES[purpose](generator(case.hidden, case.seed, purpose))


def _supplied(case: Case, purpose: str) -> g.Gearbox:
    pressure_pa = TRAINING_SUPPLY_PA
    if purpose == "validation":
        pressure_pa = validation_supply_pa(generator(case.hidden, case.seed, "supply"))
    return replace(gearbox_of(case), supply_pressure_pa=pressure_pa)


def _table(command: np.ndarray, seen: Table, case: Case, purpose: str) -> Table:
    random = generator(case.hidden, case.seed, purpose + " noise")
    noise = random.standard_normal((4, len(command)))
    position_m = quantised(seen["position_m"] + POSITION_NOISE_M * noise[0], POSITION_STEP_M)
    table = dict(
        time_s=np.arange(len(command)) * SAMPLE_TIME_S,
        command_1=command[:, 0],
        command_2=command[:, 1],
        position_mm=1e3 * position_m,
    )
    for row, name in enumerate(("pressure_1", "pressure_2", "supply"), start=1):
        noisy = seen[name + "_pa"] + PRESSURE_NOISE_PA * noise[row]
        table[name + "_bar"] = 1e-5 * quantised(noisy, PRESSURE_STEP_PA)
    return table


def misfits(cases: Sequence[Case]) -> list[Misfit]:
    """One misfit per case, from one batch and batches of window replays (0.25 s, see `replay`)."""
    if not cases:
        return []
    batch = stack([gearbox_of(case) for case in cases])
    command = np.stack([commands(case, "training") for case in cases], axis=1)
    sent = np.moveaxis(command, 2, 1)
    _, states = open_loop(batch, sent, g.at_rest(batch), REPLAY_SUBSTEPS, STARTS)
    return Replay(gearbox_of, _starts, _outputs, STARTS, WINDOW_SAMPLES).misfits(
        cases, states, command
    )


def _starts(state: g.State, column: int, case: Case, names: Sequence[str]) -> g.State:
    """The true state once per variant."""
    return take(state, np.full(len(names), column))


def _outputs(gearboxes: g.Gearbox, command: np.ndarray, states: g.State) -> np.ndarray:
    out, _ = open_loop(gearboxes, np.moveaxis(command, 2, 1), states, REPLAY_SUBSTEPS)
    return np.stack(
        [
            out["position_m"] / POSITION_NOISE_M,
            out["pressure_1_pa"] / PRESSURE_NOISE_PA,
            out["pressure_2_pa"] / PRESSURE_NOISE_PA,
        ]
    )
