"""Whether the times of a file are in the unit that its rig says."""

from __future__ import annotations

import warnings

import numpy as np

from workbench.errors import InputError, Message
from workbench.fitting.window_length import moves
from workbench.plant import Plant
from workbench.reading.table import RecordingWarning
from workbench.units import scale

FASTEST_S = 2e-5  # between samples: nobody samples a pneumatic actuator faster
SLOWEST_S = 0.2  # nor slower, where it moves: a stroke is over by then
SLOWEST_OF_VESSELS_S = 5.0  # a vessel may take an hour to empty
SHORTEST_S, LONGEST_S = 1e-6, 60.0  # beyond, nothing can be told, and a grid may fill the memory
USUAL_S = 1e-4  # between samples, at least, in a unit that is offered instead
COUNTED = 2000  # samples a whole second apart, half an hour of them: more likely numbers
UNITS = ("s", "ms", "us", "ns")  # in which people log time
RARE_UNITS = ("min", "h", "day")  # or what a spreadsheet makes of it: offered where no other fits


def check_time_unit(raw: np.ndarray, unit: str, plant: Plant, file: str) -> None:
    """Warn of times, shape (n,) as in the file, that would be ordinary in another unit.

    Times that run backwards, stand still or are missing are left to who puts them on a grid.

    Raises
    ------
    InputError
        If samples are so close or so far apart that nothing can be told from them.
    """
    steps = np.diff(raw) if np.isfinite(raw).all() else np.zeros(0)
    if not len(steps) or not (steps > 0).all():
        return
    usual, moving = float(np.median(steps)), moves(plant)
    slowest_s = SLOWEST_S if moving else SLOWEST_OF_VESSELS_S
    step_s = _seconds(usual, unit)
    even = step_s == 1.0 and bool((steps == 1.0).all())
    counts = even and (moving or len(raw) > COUNTED)
    if FASTEST_S < step_s <= _and_a_bit(slowest_s) and not counts:
        return
    length_s = _seconds(raw[-1], unit) - _seconds(raw[0], unit)
    what = f"{len(raw)} samples {step_s:.4g} s apart, {length_s:.4g} s long"
    looks, remedies = _other_units(usual, unit, slowest_s)
    looks += ["sample numbers"] * counts
    remedies += ['step = "..." for its column'] * counts
    if looks:
        what += f", look like times {' or '.join(looks)}"
        expected = f"{' or '.join(remedies)} in the time of [recording]"
    else:
        what += f", look like no times of {plant.name}"
        expected = f"samples {FASTEST_S:g} to {slowest_s:g} s apart"
    if _and_a_bit(step_s) < SHORTEST_S or step_s > _and_a_bit(LONGEST_S):
        raise InputError(Message(what, "time", expected, file=file))
    text = str(Message(what, "time", expected, file=file))
    warnings.warn(text, RecordingWarning, stacklevel=3)


def _other_units(usual: float, unit: str, slowest_s: float) -> tuple[list[str], list[str]]:
    """Units in which such a step is ordinary, in words, and how a rig says each."""
    for units in (UNITS, RARE_UNITS):
        steps_s = {each: _seconds(usual, each) for each in units if each != unit}
        others = [each for each, s in steps_s.items() if USUAL_S <= s <= _and_a_bit(slowest_s)]
        if others:
            return [f"in {each}" for each in others], [f'unit = "{each}"' for each in others]
    return [], []


def _and_a_bit(value: float) -> float:
    """A limit that rounding does not pass."""
    return value * (1.0 + 1e-6)


def _seconds(value: float, unit: str) -> float:
    return float(scale(unit, "time_s").to_si(value))
