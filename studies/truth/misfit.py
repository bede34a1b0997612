"""The rule that no small difference may hide the hidden effect.

Windows of 0.5 s are replayed with the recorded command from the true state at their start, once
as it was, once without the hidden effect, once without each difference.  The misfit is the mean
squared deviation of position and both pressures over the noise variance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.truth import drive as d
from studies.truth.draw import Case, draw_size, drive_of, generator, resized, shrink
from studies.truth.integrate import open_loop
from studies.truth.manoeuvre import training_reference
from studies.truth.run import POSITION_NOISE_M, PRESSURE_NOISE_PA, Run, closed_loop

WINDOW_SAMPLES = 500
STARTS = tuple(range(500, 9500, 1000))
LARGEST_SHARE = 0.20
VISIBLE = 1.0  # mean squared deviation over noise variance: as large as the noise
REPLAY_SUBSTEPS = 25  # enough for differences of two replays
LARGEST_BATCH = 2500  # columns; more does not fit the cache


@dataclass(frozen=True)
class Misfit:
    """Misfit of the hidden effect and of each difference, in noise variances."""

    hidden: float
    differences: dict[str, float]


def scaled(cases: Sequence[Case], rounds: int = 12) -> list[Case]:
    """Cases whose hidden effect is visible and whose differences are each below 20 % of it.

    An invisible hidden effect gets a new size; a difference that is too large is halved (misfit
    goes about with the square of the amplitude).  Both change the path, so every changed case is
    measured again until the rule holds.  Null cases are returned as they are.

    Raises RuntimeError if the rule does not hold after `rounds` measurements.
    """
    done = list(cases)
    todo = [i for i, case in enumerate(cases) if case.hidden]
    for _ in range(rounds):
        found = misfits([done[i] for i in todo])
        again = []
        for i, misfit in zip(todo, found, strict=True):
            better = corrected(done[i], misfit)
            if better != done[i]:
                done[i] = better
                again.append(i)
        todo = again
        if not todo:
            return done
    names = ", ".join(f"{done[i].hidden} seed {done[i].seed}" for i in todo)
    raise RuntimeError(f"truth: {names} do not meet the misfit rule after {rounds} rounds")


def corrected(case: Case, misfit: Misfit) -> Case:
    """The case with a new size or smaller differences; the same case if it meets the rule."""
    if misfit.hidden < VISIBLE:
        rng = generator(case.hidden, case.seed, f"size {case.redraws}")
        return resized(case, draw_size(case.hidden, rng))
    factors = halvings(misfit)
    return shrink(case, factors) if factors else case


def halvings(misfit: Misfit) -> dict[str, float]:
    """Factors (powers of a half) of the differences that exceed their share."""
    factors = {}
    for field, value in misfit.differences.items():
        excess = value / max(LARGEST_SHARE * misfit.hidden, 1e-30)
        if excess > 1:
            factors[field] = 0.5 ** int(np.ceil(np.log(excess) / np.log(4)))
    return factors


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
