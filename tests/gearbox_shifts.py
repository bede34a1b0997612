"""The four shifts of the gearbox actuator, and what is read off them."""

import numpy as np

from workbench.plants.gearbox import gearbox
from workbench.recording import Recording
from workbench.simulation import simulate

COMMANDS = ("valve_1.command", "valve_2.command")
POSITION, VELOCITY = "main_piston.position_m", "main_piston.velocity_m_s"
NEUTRAL_M, HIGH_M, LOW_M = 0.0, 12e-3, -12e-3
SHIFTS = {
    "N to H": (NEUTRAL_M, (1, 0), HIGH_M),
    "H to N": (HIGH_M, (1, 1), NEUTRAL_M),
    "N to L": (NEUTRAL_M, (0, 1), LOW_M),
    "L to N": (LOW_M, (1, 1), NEUTRAL_M),
}
ALL_SHIFTS = (
    ((1, 0), 0.05),
    ((0, 0), 0.20),
    ((1, 1), 0.08),
    ((0, 0), 0.20),
    ((0, 1), 0.08),
    ((0, 0), 0.20),
    ((1, 1), 0.08),
    ((0, 0), 0.20),
)


def held(pieces, sample_time_s):
    """Commands, shape (2, n), of pieces (command, duration in s); one sample more at the end."""
    columns = [np.repeat([c], round(t / sample_time_s), axis=0) for c, t in pieces]
    last = np.array([pieces[-1][0]])
    return np.vstack([*columns, last]).T.astype(float)


def run(plant, pieces, sample_time_s=1e-4):
    """The plant under these commands."""
    channels = dict(zip(COMMANDS, held(pieces, sample_time_s), strict=True))
    return simulate(plant, Recording("shift", sample_time_s, channels))


def shifted(name, duration_s=0.08, **values):
    """One shift, from rest and vented, with other values by ``member__parameter``."""
    start_m, command, _ = SHIFTS[name]
    changed = {key.replace("__", "."): value for key, value in values.items()}
    plant = gearbox(start_m).with_values(changed).lean()
    return run(plant, [(command, duration_s)])


def first_ms(result, condition):
    """Time of the first sample where it holds, in ms."""
    return 1e3 * result.sample_time_s * np.argmax(condition)


def settled_ms(result, place_m, within_m=0.3e-3):
    """Time from which on the piston stays at a place, in ms."""
    outside = np.abs(result[POSITION] - place_m) > within_m
    return 1e3 * result.sample_time_s * (np.flatnonzero(outside)[-1] + 1)
