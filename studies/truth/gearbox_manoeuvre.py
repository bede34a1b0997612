"""Commands with which a person would record the gearbox: 5 s at 1 kHz, open loop, from Neutral.

Training: Low, Neutral, High in turn, as in normal driving, each command held until the piston is
there and then released.  Validation: also straight from one end to the other, pulses that end
before the piston has arrived, both valves at slightly different times; and another supply pressure.
"""

import numpy as np

SAMPLES = 5000
HIGH, LOW, NEUTRAL, RELEASED = (1, 0), (0, 1), (1, 1), (0, 0)
TRAINING_SUPPLY_PA = 9.0e5


def training_command(rng: np.random.Generator) -> np.ndarray:
    """Shifts by way of Neutral with releases in between, shape (5000, 2)."""
    pieces = [(RELEASED, 0.05)]
    while _length_s(pieces) < SAMPLES * 1e-3:
        for end in rng.permutation([HIGH, LOW]).tolist():
            for command in (tuple(end), NEUTRAL):
                pieces.append((command, rng.uniform(0.05, 0.09)))
                pieces.append((RELEASED, rng.uniform(0.10, 0.28)))
    return _held(pieces)


def validation_command(rng: np.random.Generator) -> np.ndarray:
    """Straight shifts, short pulses, valves that switch one after the other, shape (5000, 2)."""
    pieces = [(RELEASED, 0.08)]
    while _length_s(pieces) < SAMPLES * 1e-3:
        pieces += [(HIGH, rng.uniform(0.05, 0.08)), (RELEASED, rng.uniform(0.1, 0.2))]
        pieces += [(LOW, rng.uniform(0.07, 0.1)), (RELEASED, rng.uniform(0.08, 0.2))]
        pieces += [(HIGH, rng.uniform(0.004, 0.01)), (NEUTRAL, rng.uniform(0.05, 0.08))]
        pieces += [(RELEASED, rng.uniform(0.1, 0.25)), (LOW, rng.uniform(0.008, 0.016))]
        pieces += [(RELEASED, rng.uniform(0.1, 0.2)), (NEUTRAL, rng.uniform(0.05, 0.08))]
        pieces += [(RELEASED, rng.uniform(0.08, 0.2))]
    return _held(pieces)


def validation_supply_pa(rng: np.random.Generator) -> float:
    """Supply pressure of the other recording."""
    return float(rng.uniform(7.0e5, 8.5e5))


def _length_s(pieces) -> float:
    return sum(duration for _, duration in pieces)


def _held(pieces) -> np.ndarray:
    rows = [np.repeat([command], round(duration * 1e3), axis=0) for command, duration in pieces]
    return np.concatenate(rows)[:SAMPLES].astype(float)
