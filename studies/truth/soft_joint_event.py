"""The record of paper 004 once more: steps, quick steps, and a vent that the spool refuses.

The true bellows has a spool that sticks: its vent opens only below 0.45 of the command, 0.03 below
where it should.  Steps to all other levels are as they should be; late in the record the command
stands just below the centre for five seconds, and the bellows does not vent.

Source: paper 004, Fig. 7 to 10 (steps for more than 250 s, quick steps near 150 s, the event after
250 s); physics.md 7 for the size of the event.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.truth.batch import stack
from studies.truth.case import Case, generator
from studies.truth.cases import read_cases
from studies.truth.instruments import quantised
from studies.truth.plants import SOFT_JOINT
from studies.truth.soft_joint_draw import joint_of
from studies.truth.soft_joint_manoeuvre import NEUTRAL, RATE_HZ
from studies.truth.soft_joint_record import (
    COMMAND_STEP,
    PRESSURE_NOISE_PA,
    PRESSURE_STEP_PA,
    run,
)

HIDDEN = "valve_stuck_band"
STUCK_SHARE = 0.03
EVENT_COMMAND, EVENT_S, FILL_S = 0.478, 5.0, 3.0
SHORTEST_S = 25.0  # of a record: the event and what comes before it have room
QUICK_PART, EVENT_PART = (0.45, 0.62), 0.78  # shares of the record


@dataclass(frozen=True)
class EventRecord:
    """A record and where its event is.

    table      time_s, command (0 to 1), pressure_bar and supply_bar as recorded
    event      first and last sample of the event
    """

    table: Mapping[str, np.ndarray]
    event: tuple[int, int]


def bellows() -> Case:
    """The bellows of all these records: small differences of a stored case, and the full band."""
    return replace(read_cases(SOFT_JOINT.stored)[HIDDEN, 1], size=STUCK_SHARE)


def diagnosis_records() -> tuple[Mapping[str, np.ndarray], Mapping[str, np.ndarray]]:
    """Training and validation of the same bellows, with ramps through the centre of the valve.

    Steps past the edges cannot tell a spool that sticks from a wider overlap; a slow ramp can.
    """
    return SOFT_JOINT.record([bellows()])[0]


def event_records(duration_s: float, seeds: Sequence[int]) -> list[EventRecord]:
    """Records of so many seconds at 400 Hz, one for each seed, of one bellows, in one batch."""
    joint = joint_of(bellows())
    wanted = [event_command(duration_s, generator(HIDDEN, seed, "event")) for seed in seeds]
    command = quantised(np.stack([each for each, _ in wanted], axis=1), COMMAND_STEP)
    readings, _ = run(stack([joint] * len(seeds)), command)
    return [
        EventRecord(_table(readings, command, k, seed), event)
        for k, (seed, (_, event)) in enumerate(zip(seeds, wanted, strict=True))
    ]


def _table(
    readings: Mapping[str, np.ndarray], command: np.ndarray, column: int, seed: int
) -> dict[str, np.ndarray]:
    random = generator(HIDDEN, seed, "event noise")
    noise = PRESSURE_NOISE_PA * random.standard_normal((2, len(command)))
    seen = [readings[name][:, column] for name in ("pressure_pa", "supply_pa")] + noise
    own, supply = 1e-5 * quantised(seen, PRESSURE_STEP_PA)
    time_s = np.arange(len(command)) / RATE_HZ
    table = dict(time_s=time_s, command=command[:, column], pressure_bar=own)
    return {**table, "supply_bar": supply}


def event_command(
    duration_s: float, rng: np.random.Generator
) -> tuple[np.ndarray, tuple[int, int]]:
    """Levels from 0 to 1, shape (n,), and first and last sample of the event.

    Raises ValueError for a record that has no room for its parts.
    """
    if duration_s < SHORTEST_S:
        raise ValueError(
            f"a record of {duration_s:g} s is too short, expected {SHORTEST_S:g} s or more"
        )
    n = round(duration_s * RATE_HZ)
    quick = [round(share * n) for share in QUICK_PART]
    fill, start = (round(EVENT_PART * n - s * RATE_HZ) for s in (FILL_S, 0.0))
    end = start + round(EVENT_S * RATE_HZ)
    parts = [
        _steps(rng, quick[0], 1.0, 3.0),
        _steps(rng, quick[1] - quick[0], 0.1, 0.4),
        _steps(rng, fill - quick[1], 1.0, 3.0),
        np.full(start - fill, 0.62),
        np.full(end - start, EVENT_COMMAND),
        _steps(rng, n - end, 1.0, 3.0),
    ]
    return np.concatenate(parts), (start, end)


def _steps(rng: np.random.Generator, samples: int, shortest_s: float, longest_s: float):
    """Fills, vents and pauses in turn, none where the spool sticks."""
    levels: list[np.ndarray] = []
    while sum(map(len, levels)) < samples:
        fill, vent = rng.uniform(0.53, 0.62), rng.uniform(0.38, 0.44)
        for level in rng.permutation([fill, vent, NEUTRAL]):
            held = round(rng.uniform(shortest_s, longest_s) * RATE_HZ)
            levels.append(np.full(held, level))
    return np.concatenate(levels)[:samples]
