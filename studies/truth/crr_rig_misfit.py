"""Misfits of the `crr_rig`, for the rule that no small difference may hide the hidden effect.

Outputs are position and both pressures; see `replay` and `rule`.
"""

from collections.abc import Sequence

import numpy as np

from studies.truth import crr_rig as c
from studies.truth.batch import take
from studies.truth.case import Case, generator
from studies.truth.crr_rig_draw import rig_of
from studies.truth.crr_rig_integrate import open_loop
from studies.truth.crr_rig_manoeuvre import training_reference
from studies.truth.crr_rig_record import POSITION_NOISE_M, PRESSURE_NOISE_PA, closed_loop
from studies.truth.replay import REPLAY_SUBSTEPS, STARTS, Replay
from studies.truth.rule import Misfit


def misfits(cases: Sequence[Case]) -> list[Misfit]:
    """One misfit per case, from one closed-loop batch and batches of window replays."""
    if not cases:
        return []
    draws = [generator(k.hidden, k.seed, "crr_rig training") for k in cases]
    noises = [generator(k.hidden, k.seed, "crr_rig reference run") for k in cases]
    references = np.stack([training_reference(rng) for rng in draws], axis=1)
    rigs = [rig_of(k) for k in cases]
    run = closed_loop(rigs, references, noises, STARTS, REPLAY_SUBSTEPS)
    return Replay(rig_of, _starts, _outputs).misfits(cases, run.states, run.readings["command_v"])


def _starts(state: c.State, column: int, case: Case, names: Sequence[str]) -> c.State:
    """The true state once per variant; without a sensor offset, the reading is the state.

    Otherwise an offset would only shift one output, although a model that does not know of it
    also starts every window at the wrong pressure.
    """
    start = take(state, np.full(len(names), column))
    if case.hidden == "sensor_offset":
        start.pressure_pa[0, names.index("hidden")] += case.size
        start.read_pa[0, names.index("hidden")] += case.size
    return start


def _outputs(rigs: c.CrrRig, command_v: np.ndarray, states: c.State) -> np.ndarray:
    out = open_loop(rigs, command_v, states, substeps=REPLAY_SUBSTEPS)
    return np.stack(
        [
            out["position_m"] / POSITION_NOISE_M,
            out["cap_pressure_pa"] / PRESSURE_NOISE_PA,
            out["rod_pressure_pa"] / PRESSURE_NOISE_PA,
        ]
    )
