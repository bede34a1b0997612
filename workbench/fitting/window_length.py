"""How long windows are: from what the plant does, and from how often it was sampled.

Where something moves, errors of flows and forces pile up in its position, and where it sticks a
window runs across break-aways and is far from linear in anything (diagnosis.md 4.5): windows stay
short.  Where pressures alone are states nothing piles up, and a short window sees less of a slow
decay than the sensor's noise: windows last a few time constants of the gas (diagnosis.md 1.1).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.fitting.starts import guessed_states
from workbench.fitting.windows import WINDOW_S, position_alone
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import inputs

LONGEST_PIECE_S = 2.0  # of recordings of a position alone whose pieces stay whole
STUB = 0.5  # of the median length: shorter pieces are left out, and so set no length
POSITION_WINDOW_S = 0.5  # of longer ones
FEWEST_SAMPLES = 20  # of a window: a fast sensor at 1 kHz fills them in a tenth of one
TIME_CONSTANTS = 3.0  # in a window: diagnosis.md asks for two to five
ENOUGH_WINDOWS = 24  # of a training: with fewer, little of what is held out is independent
POINTS = 50  # at which a recording is linearised
MOTIONS = ("position_m", "angle_rad")
GAS = ("pressure_pa", "mass_kg")


def window_length_s(
    plant: Plant, train: Sequence[Recording], validation: Sequence[Recording] = ()
) -> float:
    """Windows are short where something moves and pressures are recorded too.

    A position alone says little of flows and forces in a fifth of a second.  Short experiments,
    such as kicks from rest, stay whole, or as long as the shortest of them: each has a start of its
    own.  A piece less than half as long as most of its set is a stub that gets no window.

    Where nothing moves, a window lasts three time constants of the gas, or a 24th of the training
    where that is less; a decay so slow that its recording holds no three stays whole, or as long as
    the shortest: sensors wander, and a slope is told from that the better the longer it is seen.
    No window has fewer than 20 samples.
    """
    sample_s = train[0].sample_time_s
    least_s = FEWEST_SAMPLES * sample_s
    shortest_s = min(_shortest_piece_s(each) for each in (train, validation) if each)
    if position_alone(plant):
        wanted_s = shortest_s if shortest_s <= LONGEST_PIECE_S else POSITION_WINDOW_S
    elif moves(plant) or not plant.state_list:
        wanted_s = WINDOW_S
    else:
        wanted_s = _of_gas_s(plant, train, shortest_s)
        windows = int(np.ceil(shortest_s / max(wanted_s, least_s)))
        # Rounded up they would be one too long together, and the last one would be left out.
        wanted_s = round(shortest_s / sample_s) // windows * sample_s
    return float(max(wanted_s, least_s))


def _of_gas_s(plant: Plant, train: Sequence[Recording], shortest_s: float) -> float:
    """Three time constants, but enough windows to judge by; all of what is slower than that."""
    wanted_s = TIME_CONSTANTS * time_constant_s(plant, train)
    if wanted_s >= shortest_s:
        return shortest_s
    total_s = sum(len(recording) * recording.sample_time_s for recording in train)
    return min(wanted_s, total_s / ENOUGH_WINDOWS)


def moves(plant: Plant) -> bool:
    """True for a plant with a position or an angle among its states."""
    return any(name.endswith(MOTIONS) for name in plant.state_list)


def time_constant_s(plant: Plant, recordings: Sequence[Recording]) -> float:
    """Time constant of the slowest mode of the gas where the pressure changes, inf without any.

    The mean of its rate over recorded operating points, each weighed by how fast the pressures
    change there: a valve that rests shut says nothing of how long a change lasts.  Without gas it
    is the slowest mode of all.
    """
    found = [_slowest_modes(plant, recording) for recording in recordings]
    rates, weights = (np.concatenate(each) for each in zip(*found, strict=True))
    weighed = float(np.sum(weights * rates))
    return float(np.sum(weights)) / weighed if weighed > 0.0 else float("inf")


def _slowest_modes(plant: Plant, recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Rate of the slowest mode in 1/s, and how fast its states change, at points of a recording."""
    model, p = plant.model, plant.nominal[2]
    names = list(model.states)
    gas = [k for k, name in enumerate(names) if name.endswith(GAS)] or [*range(len(names))]
    at = np.unique(np.linspace(0, len(recording) - 1, POINTS).astype(int))
    u, d = (rows[:, at] for rows in inputs(plant, recording))
    x = guessed_states(plant, recording)[0][:, at]
    change = model.f.map(len(at))(x, u, d, np.tile(p[:, None], len(at)))[0].full()[gas]
    rates = [
        max(-float(np.linalg.eigvals(A[np.ix_(gas, gas)]).real.max()), 0.0)
        for A in (model.jacobians(x[:, k], u[:, k], d[:, k], p)[0].full() for k in range(len(at)))
    ]
    return np.array(rates), np.linalg.norm(change / plant.scale[gas, None], axis=0)


def _shortest_piece_s(recordings: Sequence[Recording]) -> float:
    """Length of the shortest piece that is no stub."""
    lengths_s = np.array([len(p) * r.sample_time_s for r in recordings for p in r.pieces])
    return float(lengths_s[lengths_s >= STUB * np.median(lengths_s)].min())
