"""Misfits of the servo drive, for the rule that no small difference may hide the hidden effect.

Windows of 0.5 s are replayed with the recorded command from the true state at their start, once
as it was, once without the hidden effect, once without each difference.  The misfit is the mean
squared deviation of position and both pressures over the noise variance.
"""

from collections.abc import Sequence

import numpy as np

from studies.truth import drive as d
from studies.truth import rule
from studies.truth.case import Case, generator
from studies.truth.draw import draw_size, drive_of
from studies.truth.integrate import open_loop
from studies.truth.manoeuvre import training_reference
from studies.truth.rule import Misfit
from studies.truth.run import POSITION_NOISE_M, PRESSURE_NOISE_PA, Run, closed_loop

WINDOW_SAMPLES = 500
STARTS = tuple(range(500, 9500, 1000))
REPLAY_SUBSTEPS = 25  # enough for differences of two replays
LARGEST_BATCH = 2500  # columns; more does not fit the cache


def scaled(cases: Sequence[Case], rounds: int = rule.ROUNDS) -> list[Case]:
    """Cases that meet the rule, see `rule.scaled`."""
    return rule.scaled(cases, misfits, draw_size, rounds)


def misfits(cases: Sequence[Case]) -> list[Misfit]:
    """One misfit per case, from one closed-loop batch and batches of window replays."""
    if not cases:
        return []
    references = [training_reference(generator(c.hidden, c.seed, "training")) for c in cases]
    noises = [generator(c.hidden, c.seed, "reference run") for c in cases]
    run = closed_loop([drive_of(c) for c in cases], np.stack(references, axis=1), noises, STARTS)
    per_case = 2 + max(len(c.differences) for c in cases)
    group = max(1, LARGEST_BATCH // (per_case * len(STARTS)))
    found = []
    for first in range(0, len(cases), group):
        found += _group_misfits(cases, run, range(first, min(first + group, len(cases))))
    return found


def _starts(state: d.State, column: int, case: Case, names: Sequence[str]) -> d.State:
    """The true state once per variant; without a sensor offset, the reading is the state.

    Otherwise an offset would only shift one output, although a model that does not know of it
    also starts every window at the wrong pressure.
    """
    start = d.take(state, np.full(len(names), column))
    if case.hidden == "sensor_offset":
        start.pressure_pa[0, names.index("hidden")] += case.size
        start.read_pa[0, names.index("hidden")] += case.size
    return start


def _group_misfits(cases: Sequence[Case], run: Run, members: Sequence[int]) -> list[Misfit]:
    """Replay all windows of some cases; columns are ordered case, window, variant."""
    drives, states, commands, variants = [], [], [], []
    for i in members:
        names = ["", "hidden", *(x.field for x in cases[i].differences)]
        variants.append(names)
        for start in STARTS:
            drives += [drive_of(cases[i], without=name) for name in names]
            states.append(_starts(run.states[start], i, cases[i], names))
            window = run.readings["command_v"][start : start + WINDOW_SAMPLES, i]
            commands.append(np.repeat(window[:, None], len(names), axis=1))
    out = open_loop(
        d.stack(drives), np.concatenate(commands, axis=1), d.join(states), substeps=REPLAY_SUBSTEPS
    )
    outputs = np.stack(
        [
            out["position_m"] / POSITION_NOISE_M,
            out["pressure_a_pa"] / PRESSURE_NOISE_PA,
            out["pressure_b_pa"] / PRESSURE_NOISE_PA,
        ]
    )
    found, column = [], 0
    for names in variants:
        width = len(names) * len(STARTS)
        block = outputs[:, :, column : column + width].reshape(3, -1, len(STARTS), len(names))
        value = np.mean((block - block[..., :1]) ** 2, axis=(0, 1, 2)).tolist()
        found.append(Misfit(value[1], dict(zip(names[2:], value[2:], strict=True))))
        column += width
    return found
