"""Reference movements and the position loop with which a person would record the drive.

Training: random position steps, a slow ramp, a multi-tone, a hold.  Validation: a slow triangle,
a sine sweep, holds at rest.  Both 10 s at 1 kHz, inside 20..270 mm.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from studies.truth.movement import between, move, multi_tone, sweep, time_s

SAMPLES = 10_000
MIDDLE_M, START_M = 0.145, 0.060
LOW_M, HIGH_M = 0.038, 0.248
TRAVEL_SPEED_M_S = 0.9
TONES_HZ_M_S = ((0.45, 0.25), (0.9, 0.25), (1.7, 0.2), (2.9, 0.1))  # 0.8 m/s together


def training_reference(rng: np.random.Generator) -> np.ndarray:
    """Random steps with rests (6.4 s), ramp at 25..50 mm/s (0.8 s), multi-tone (2.8 s)."""
    steps = _steps(rng, 6400)
    ramp = steps[-1] + np.sign(MIDDLE_M - steps[-1]) * rng.uniform(0.025, 0.05) * time_s(800)
    tones = multi_tone(rng, ramp[-1], MIDDLE_M, 2800, TONES_HZ_M_S)
    return _clip(np.concatenate([steps, ramp, tones]))


def validation_reference(rng: np.random.Generator) -> np.ndarray:
    """Hold, slow triangle, hold, fast move, falling-amplitude sine sweep, hold, creep."""
    slope = rng.uniform(0.04, 0.07)
    rise = START_M + slope * np.minimum(time_s(2200), 2.2 - time_s(2200)).clip(0)
    parts = [
        np.full(800, START_M),
        rise,
        np.full(600, rise[-1]),
        move(rise[-1], rng.uniform(0.235, HIGH_M), 900, TRAVEL_SPEED_M_S),
    ]
    parts.append(sweep(rng, parts[-1][-1], MIDDLE_M, 3600, 2.5, 0.095))
    parts.append(move(parts[-1][-1], rng.uniform(LOW_M, 0.08), 1000, TRAVEL_SPEED_M_S))
    last = parts[-1][-1]
    parts.append(last + rng.uniform(0.02, 0.05) * time_s(SAMPLES - sum(map(len, parts))))
    return _clip(np.concatenate(parts))


def _clip(reference: np.ndarray) -> np.ndarray:
    return np.clip(reference, LOW_M - 0.005, HIGH_M + 0.005)


def _steps(rng: np.random.Generator, samples: int) -> np.ndarray:
    """Steps between random positions; the first two cross most of the stroke and rest long."""
    targets = [rng.uniform(0.23, HIGH_M), rng.uniform(LOW_M, 0.07)]
    lengths = [1700, 1600]
    while sum(lengths) < samples:
        far = targets[-1] + rng.choice([-1, 1]) * rng.uniform(0.02, 0.16)
        targets.append(far if LOW_M < far < HIGH_M else 2 * MIDDLE_M - targets[-1])
        lengths.append(int(rng.uniform(500, 1000)))
    return between(rng, START_M, targets, lengths, (0.5, 1.1))[:samples]


@dataclass(frozen=True)
class Loop:
    """PI position loop with feed-forward of the reference speed and a jump over the dead zone.

    u = centre + du + jump sat(du/0.02 V),  du = k_p e + k_i sum(e) + k_v dr/dt - k_d dy/dt
    Inside `rest_m` and with a resting reference the valve is closed and the integral frozen,
    as a person stops the hunting of a drive with stiction.  Gains are of shape () or (n,).
    """

    centre_v: np.ndarray
    jump_v: np.ndarray
    k_p: float = 14.0
    k_i: float = 15.0
    k_v: float = 0.75
    k_d: float = 0.4
    rest_m: float = 1.5e-3
    limit_v: float = 1.6


def start_loop(position_m: np.ndarray) -> SimpleNamespace:
    """Memory of the loop: integral, last position, filtered speed, whether it rests."""
    n = len(position_m)
    return SimpleNamespace(
        integral=np.zeros(n), last=position_m.copy(), speed=np.zeros(n), resting=np.zeros(n, bool)
    )


def loop_command(loop: Loop, memory: SimpleNamespace, reference_m, speed_m_s, position_m):
    """Command in volt from this sample's reference and reading; updates the memory.

    Without a reference (NaN), or without its speed next to that, the loop rests.
    """
    off = np.isnan(reference_m + speed_m_s)
    error = np.where(off, 0.0, reference_m - position_m)
    speed_m_s = np.where(off, 0.0, speed_m_s)
    memory.speed += 0.12 * ((position_m - memory.last) / 1e-3 - memory.speed)
    memory.last = position_m.copy()
    band = np.where(memory.resting, 2.5, 1.0) * loop.rest_m
    memory.resting = (np.abs(error) < band) & (np.abs(speed_m_s) < 1e-4)
    memory.integral += np.where(memory.resting, 0.0, 1e-3 * error)
    memory.integral = np.clip(memory.integral, -0.03, 0.03)
    du = (
        loop.k_p * error
        + loop.k_i * memory.integral
        + loop.k_v * speed_m_s
        - loop.k_d * memory.speed
    )
    du = np.where(memory.resting, 0.0, np.clip(du, -loop.limit_v, loop.limit_v))
    return np.clip(loop.centre_v + du + loop.jump_v * np.clip(du / 0.02, -1, 1), 0.0, 10.0)
