"""Whether the times of a file are in the unit that its rig says."""

from __future__ import annotations

import warnings

import numpy as np

from workbench.reading.table import RecordingWarning
from workbench.units import scale

FASTEST_S, SLOWEST_S = 2e-5, 5.0  # between samples: so far out nobody samples a pneumatic actuator
USUAL_S = (1e-4, 0.2)  # between samples
COUNTED = 2000  # samples a whole second apart, half an hour of them: more likely numbers
UNITS = ("s", "ms", "us")  # in which people log time


def warn_of_time_unit(raw: np.ndarray, unit: str, file: str) -> None:
    """Warn of times, shape (n,) as in the file, that would be ordinary in another unit."""
    usual = float(np.median(np.diff(raw)))
    step_s = _seconds(usual, unit)
    counts = step_s == 1.0 and len(raw) > COUNTED and bool((np.diff(raw) == 1.0).all())
    if FASTEST_S < step_s < SLOWEST_S and not counts:
        return
    others = [each for each in UNITS if USUAL_S[0] <= _seconds(usual, each) <= USUAL_S[1]]
    if not others:
        return
    looks = " or ".join(f"in {other}" for other in others) + counts * " or sample numbers"
    remedies = [f'unit = "{other}"' for other in others] + counts * ['step = "..." for its column']
    what = f"{len(raw)} samples {step_s:.4g} s apart, {_seconds(raw[-1] - raw[0], unit):.4g} s long"
    warnings.warn(
        f"{file}: time: {what}, look like times {looks}; expected {' or '.join(remedies)} in the "
        "time of [recording]",
        RecordingWarning,
        stacklevel=3,
    )


def _seconds(value: float, unit: str) -> float:
    return float(scale(unit, "time_s").to_si(value))
