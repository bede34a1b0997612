"""Reference movements and the position loop with which a person would record the `crr_rig`.

Training: moves with rests, slow ramps both ways, a multi-tone.  Validation: a slow triangle, a
sine sweep, holds at rest, a creep.  Both 10 s at 1 kHz, inside 10..142 mm.
"""

from types import SimpleNamespace

import numpy as np

from studies.truth.movement import between, move, multi_tone, sweep, time_s

SAMPLES = 10_000
MIDDLE_M, START_M = 0.0762, 0.040
LOW_M, HIGH_M = 0.018, 0.134
TONES_HZ_M_S = ((0.55, 0.13), (1.1, 0.13), (2.1, 0.10), (3.7, 0.05))  # 0.45 m/s together
CENTRE_V = 5.25
# Those of physics.md 2.1 (250, 200, 8) ring at 20 Hz with a real valve: a person turns them down.
PROPORTIONAL_V_M, INTEGRAL_V_M_S, DERIVATIVE_V_S_M, FILTER_S = 150.0, 100.0, 4.0, 3e-3


def training_reference(rng: np.random.Generator) -> np.ndarray:
    """Moves with rests (5.6 s), ramps at 8..20 mm/s both ways (1.9 s), multi-tone (2.5 s)."""
    parts = [_moves(rng, 5600)]
    last = parts[0][-1]
    slope = rng.uniform(0.008, 0.020) * np.sign(MIDDLE_M - last)
    parts.append(last + slope * np.minimum(time_s(1900), 1.9 - time_s(1900)))
    left = SAMPLES - sum(map(len, parts))
    parts.append(multi_tone(rng, parts[-1][-1], MIDDLE_M, left, TONES_HZ_M_S))
    return _clip(np.concatenate(parts))


def validation_reference(rng: np.random.Generator) -> np.ndarray:
    """Hold, slow triangle, hold, move, sine sweep of falling amplitude, move, rest, creep."""
    slope = rng.uniform(0.03, 0.05)
    parts = [
        np.full(600, START_M),
        START_M + slope * np.minimum(time_s(2000), 2.0 - time_s(2000)),
        np.full(500, START_M),
        move(START_M, rng.uniform(0.115, HIGH_M), 900, rng.uniform(0.3, 0.6)),
    ]
    parts.append(sweep(rng, parts[-1][-1], MIDDLE_M, 3600, 3.0, 0.050))
    parts.append(move(parts[-1][-1], rng.uniform(LOW_M, 0.05), 1000, rng.uniform(0.3, 0.6)))
    creep = rng.uniform(0.008, 0.020) * time_s(SAMPLES - sum(map(len, parts)))
    return _clip(np.concatenate([*parts, parts[-1][-1] + creep]))


def _clip(reference: np.ndarray) -> np.ndarray:
    return np.clip(reference, LOW_M - 0.005, HIGH_M + 0.005)


def _moves(rng: np.random.Generator, samples: int) -> np.ndarray:
    """Moves between random positions with rests; the first two cross most of the stroke."""
    targets = [rng.uniform(0.120, HIGH_M), rng.uniform(LOW_M, 0.035)]
    lengths = [1300, 1300]
    while sum(lengths) < samples:
        far = targets[-1] + rng.choice([-1, 1]) * rng.uniform(0.01, 0.08)
        targets.append(far if LOW_M < far < HIGH_M else 2 * MIDDLE_M - targets[-1])
        lengths.append(int(rng.uniform(450, 900)))
    return between(rng, START_M, targets, lengths, (0.2, 0.6))[:samples]


def start_loop(position_m: np.ndarray, reference_m: np.ndarray) -> SimpleNamespace:
    """Memory of the loop: integral of the error, filtered slope of it, the error before."""
    n = len(position_m)
    return SimpleNamespace(integral=np.zeros(n), slope=np.zeros(n), before=reference_m - position_m)


def loop_command(memory: SimpleNamespace, reference_m, position_m) -> np.ndarray:
    """PID, as in physics.md 2.1, around the nominal centre, within 0..10 V; updates the memory.

    The integral stands still while the command is at a limit.
    """
    error = reference_m - position_m
    raw = (error - memory.before) / 1e-3
    memory.slope = memory.slope + 1e-3 / (1e-3 + FILTER_S) * (raw - memory.slope)
    memory.before = error
    wanted = (
        CENTRE_V
        + PROPORTIONAL_V_M * error
        + INTEGRAL_V_M_S * (memory.integral + 1e-3 * error)
        + DERIVATIVE_V_S_M * memory.slope
    )
    command = np.clip(wanted, 0.0, 10.0)
    memory.integral = memory.integral + np.where(command == wanted, 1e-3 * error, 0.0)
    return command
