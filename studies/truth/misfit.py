"""Misfits of the servo drive, for the rule that no small difference may hide the hidden effect.

Outputs are position and both pressures; see `replay` and `rule`.
"""

from collections.abc import Sequence

import numpy as np

from studies.truth import drive as d
from studies.truth import rule
from studies.truth.batch import take
from studies.truth.case import Case, generator
from studies.truth.draw import draw_size, drive_of
from studies.truth.integrate import open_loop
from studies.truth.manoeuvre import training_reference
from studies.truth.replay import REPLAY_SUBSTEPS, STARTS, Replay
from studies.truth.rule import Misfit
from studies.truth.run import POSITION_NOISE_M, PRESSURE_NOISE_PA, Run, closed_loop


def scaled(cases: Sequence[Case], rounds: int = rule.ROUNDS) -> list[Case]:
    """Cases that meet the rule, see `rule.scaled`."""
    return rule.scaled(cases, misfits, draw_size, rounds)


def misfits(cases: Sequence[Case]) -> list[Misfit]:
    """One misfit per case, from one closed-loop batch and batches of window replays."""
    if not cases:
        return []
    references = [training_reference(generator(c.hidden, c.seed, "training")) for c in cases]
    noises = [generator(c.hidden, c.seed, "reference run") for c in cases]
    drives = [drive_of(c) for c in cases]
    return of_run(cases, closed_loop(drives, np.stack(references, axis=1), noises, STARTS))


def of_run(cases: Sequence[Case], run: Run) -> list[Misfit]:
    """Misfits over the windows of a run with one column per case, and its states at `STARTS`."""
    return Replay(drive_of, _starts, _outputs).misfits(cases, run.states, run.readings["command_v"])


def _starts(state: d.State, column: int, case: Case, names: Sequence[str]) -> d.State:
    """The true state once per variant; without an error of a sensor, the reading is the state.

    Otherwise it would only shift one output, although a model that does not know of it also starts
    every window at the wrong place.
    """
    start = take(state, np.full(len(names), column))
    if case.hidden == "sensor_offset":
        start.pressure_pa[0, names.index("hidden")] += case.size
        start.read_pa[0, names.index("hidden")] += case.size
    if case.hidden == "sensor_scale":
        start.position_m[names.index("hidden")] *= 1 + case.size
    return start


def _outputs(drives: d.Drive, command_v: np.ndarray, states: d.State) -> np.ndarray:
    out = open_loop(drives, command_v, states, substeps=REPLAY_SUBSTEPS)
    return np.stack(
        [
            out["position_m"] / POSITION_NOISE_M,
            out["pressure_a_pa"] / PRESSURE_NOISE_PA,
            out["pressure_b_pa"] / PRESSURE_NOISE_PA,
        ]
    )
