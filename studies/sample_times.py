"""The sample time of each plant's closed loop, which that of a controller must be a multiple of."""

from __future__ import annotations

from linearize.standard import SHIFT_MODES, SLIDE_MODES
from studies.following import BENCHES
from studies.scenarios import SAMPLE_TIME_S
from studies.shift_check import SAMPLE_TIME_S as SHIFT_TIME_S
from workbench.errors import InputError, Message
from workbench.plant import Plant

NEAR_S = 1e-9  # as near as two sample times are the same


def simulated_every_s(plant: Plant) -> float | None:
    """The sample time of a plant's closed loop; none for a plant that has no loop."""
    if plant.name in BENCHES:
        return BENCHES[plant.name].sample_time_s
    if plant.name in SHIFT_MODES:
        return SHIFT_TIME_S
    return SAMPLE_TIME_S if plant.name in SLIDE_MODES else None


def require_multiple(plant: Plant, sample_time_s: float, name: str, file: str = "", line: int = 0):
    """Refuse a controller that acts between two samples of its plant's closed loop.

    Raises
    ------
    InputError
        With the sample times on both sides that fit; ``name``, ``file`` and ``line`` say where.
    """
    every_s = simulated_every_s(plant)
    if every_s is None:
        return
    count = round(sample_time_s / every_s)
    if count >= 1 and abs(count * every_s - sample_time_s) <= NEAR_S:
        return
    below = int(sample_time_s / every_s)
    near = " or ".join(f"{k * every_s:g}" for k in (below, below + 1) if k)
    expected = f"a multiple of the {every_s:g} s at which {plant.name} is simulated, as {near}"
    raise InputError(Message(f"is {sample_time_s:g}", name, expected, file=file, line=line))
