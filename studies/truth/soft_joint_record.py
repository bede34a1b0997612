"""Recordings of the true bellows, and the misfits by which its small differences are kept small."""

from collections.abc import Mapping, Sequence

import numpy as np

from studies.truth import soft_joint as s
from studies.truth.batch import stack, take
from studies.truth.case import Case, generator
from studies.truth.instruments import quantised
from studies.truth.replay import Replay
from studies.truth.rule import Misfit
from studies.truth.soft_joint_draw import joint_of
from studies.truth.soft_joint_manoeuvre import NEUTRAL, training_command, validation_command
from studies.truth.soft_joint_run import SAMPLE_TIME_S, open_loop

Table = Mapping[str, np.ndarray]
PRESSURE_NOISE_PA = 1e3
PRESSURE_STEP_PA = 10e5 / 4096
COMMAND_STEP = 1.0 / 4096
SETTLING_SAMPLES = 120
WINDOW_SAMPLES = 400  # 1 s: creep needs it
STARTS = tuple(range(0, 4000, WINDOW_SAMPLES))
MANOEUVRES = dict(training=training_command, validation=validation_command)


def record(cases: Sequence[Case]) -> list[tuple[Table, Table]]:
    """Training and validation table of every case, all integrated in one batch (10 s, 400 Hz).

    Channels: time_s, command (0 to 1), pressure_bar (absolute) and, unless the supply droops,
    supply_bar.
    """
    runs = [(case, purpose) for case in cases for purpose in MANOEUVRES]
    command = np.stack([commands(*each) for each in runs], axis=1)
    readings, _ = run(stack([joint_of(case) for case, _ in runs]), command)
    tables = [_table(readings, command, k, *each) for k, each in enumerate(runs)]
    return list(zip(tables[::2], tables[1::2], strict=True))


def commands(case: Case, purpose: str) -> np.ndarray:
    """What the converter of a case puts out, shape (4000,)."""
    wanted = MANOEUVRES[purpose](generator(case.hidden, case.seed, purpose))
    return quantised(wanted, COMMAND_STEP)


def run(joint: s.SoftJoint, command: np.ndarray) -> tuple[dict[str, np.ndarray], list[s.State]]:
    """Readings and states under the commands, after 0.3 s of unrecorded settling."""
    lead = np.full((SETTLING_SAMPLES, command.shape[1]), NEUTRAL)
    readings, states = open_loop(joint, np.concatenate([lead, command]), s.at_rest(joint))
    recorded = {name: values[SETTLING_SAMPLES:] for name, values in readings.items()}
    return recorded, states[SETTLING_SAMPLES:]


def _table(readings: Table, command: np.ndarray, column: int, case: Case, purpose: str) -> Table:
    random = generator(case.hidden, case.seed, purpose + " noise")
    noise = PRESSURE_NOISE_PA * random.standard_normal((2, len(command)))
    seen = [readings[name][:, column] for name in ("pressure_pa", "supply_pa")] + noise
    own, supply = 1e-5 * quantised(seen, PRESSURE_STEP_PA)
    time_s = np.arange(len(command)) * SAMPLE_TIME_S
    table = dict(time_s=time_s, command=command[:, column], pressure_bar=own)
    return {**table, "supply_bar": supply} if case.supply_recorded else table


def misfits(cases: Sequence[Case]) -> list[Misfit]:
    """One misfit per case, from one batch and batches of window replays (1 s, see `replay`)."""
    if not cases:
        return []
    command = np.stack([commands(case, "training") for case in cases], axis=1)
    _, states = run(stack([joint_of(case) for case in cases]), command)
    replay = Replay(joint_of, _starts, _outputs, STARTS, WINDOW_SAMPLES)
    return replay.misfits(cases, {start: states[start] for start in STARTS}, command)


def _starts(state: s.State, column: int, case: Case, names: Sequence[str]) -> s.State:
    """The true state once per variant; without a sensor offset, the reading is the state.

    Otherwise an offset would shift the output alone, although a model that does not know of it
    also starts every window at the wrong pressure.
    """
    start = take(state, np.full(len(names), column))
    if case.hidden == "sensor_offset":
        start.gas[[s.PRESSURE, s.READ], names.index("hidden")] += case.size
    return start


def _outputs(joints: s.SoftJoint, command: np.ndarray, states: s.State) -> np.ndarray:
    readings, _ = open_loop(joints, command, states)
    return readings["pressure_pa"][None] / PRESSURE_NOISE_PA
