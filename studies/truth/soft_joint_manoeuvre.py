"""Commands with which a person would record the bellows: 10 s at 400 Hz, valve open loop.

Training: fills and vents at many openings, each followed by a pause with the valve shut, and a slow
ramp through the centre.  Validation: a staircase without pauses, a slow triangle through the
centre, a long pause, a sine sweep.  0 to 1, neutral at 0.5.
"""

import numpy as np

SAMPLES = 4000
RATE_HZ = 400
NEUTRAL = 0.5
OVERLAP = 0.02
FILL_S, VENT_S = 0.043, 0.073  # time to fill or vent nearly all, times the travel past the overlap


def training_command(rng: np.random.Generator) -> np.ndarray:
    """Fills and vents with pauses, shape (4000,); 2 s of them make way for a slow ramp."""
    ramp = _ramp(rng, 800)
    parts = [_level(NEUTRAL, 0.2)]
    while sum(map(len, parts)) < SAMPLES - len(ramp):
        for side, whole in ((1, FILL_S), (-1, VENT_S)):
            travel = np.exp(rng.uniform(np.log(0.025), np.log(0.2)))
            duration = rng.uniform(0.35, 0.8) * whole / (travel - OVERLAP)
            parts += [_level(NEUTRAL + side * travel, min(duration, 0.8))]
            parts += [_level(NEUTRAL, rng.uniform(0.15, 0.7))]
    return np.concatenate([np.concatenate(parts)[: SAMPLES - len(ramp)], ramp])


def validation_command(rng: np.random.Generator) -> np.ndarray:
    """Staircase (4 s), slow triangle (2 s), pause (1.5 s), sine sweep (2.5 s), shape (4000,)."""
    stairs = [_level(NEUTRAL + 0.08, 0.3)]
    while sum(map(len, stairs)) < 4 * RATE_HZ:
        stairs.append(_level(rng.uniform(0.42, 0.57), rng.uniform(0.1, 0.4)))
    triangle = _triangle(rng.uniform(0.04, 0.07), 2 * RATE_HZ)
    rise = _level(NEUTRAL + rng.uniform(0.06, 0.12), 0.25)
    pause = _level(NEUTRAL, 1.25)
    t = np.arange(SAMPLES - 8 * RATE_HZ + RATE_HZ // 2) / RATE_HZ
    turns = rng.uniform(0.5, 0.8) * t + rng.uniform(0.3, 0.6) * t**2
    sweep = NEUTRAL + 0.005 + rng.uniform(0.05, 0.09) * np.sin(2 * np.pi * turns)
    stairs = np.concatenate(stairs)[: 4 * RATE_HZ]
    return np.concatenate([stairs, triangle, rise, pause, sweep])


def _level(command: float, duration_s: float) -> np.ndarray:
    return np.full(max(round(duration_s * RATE_HZ), 1), command)


def _triangle(travel: float, samples: int) -> np.ndarray:
    """From neutral up, down through the centre and back."""
    phase = np.arange(samples) / samples
    return NEUTRAL + travel * (np.abs(4 * ((phase + 0.75) % 1.0) - 2) - 1)


def _ramp(rng: np.random.Generator, samples: int) -> np.ndarray:
    """A quick fill, then slowly from just above the centre to well below it."""
    filling = _level(NEUTRAL + 0.1, rng.uniform(0.25, 0.4))
    slow = np.linspace(NEUTRAL + 0.03, NEUTRAL - rng.uniform(0.05, 0.08), samples - len(filling))
    return np.concatenate([filling, slow])
