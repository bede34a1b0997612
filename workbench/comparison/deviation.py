"""The deviation measure of paper 003, shift by shift: its Table I for any recording.

eps = 1/T integral of |y - yhat| / (y_max - y_min) dt

over a shift, from the energising that began it to where the position is reached.  The paper prints
it without the absolute value, so that errors of both signs cancel; its numbers fit the form with it
(erratum E003-5).  y_max and y_min are those of the recording within the shift.

As in the paper the plant runs freely under the recorded commands, and the recorded supply pressure
where there is one; here from shortly before each shift, from the state guessed there.

Source: paper 003 Eq. 13 and Table I; physics.md 3 (E003-5) and S003-2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.comparison.course import Course
from workbench.comparison.shifts import SETTLED_S, Shift, shifts
from workbench.fitting.holes import usual_gap
from workbench.simulation import simulate


@dataclass(frozen=True)
class ShiftDeviation:
    """One shift with the deviation of each output, by full name; NaN where it does not vary."""

    case: str
    start_s: float
    end_s: float
    deviations: Mapping[str, float]


def deviation(
    measured: np.ndarray, simulated: np.ndarray, sample_time_s: float, usual: int | None = None
) -> float:
    """Mean absolute error over the range of what was measured, by the trapezoidal rule.

    ``measured`` and ``simulated`` have shape (n,).  ``usual`` is how many samples the sensor takes
    from one value to the next, by default as most are apart here.  Where values are missing, two
    are at least twice as far apart, and what is between them counts for nothing.  NaN where nothing
    was measured or the measured signal does not vary.

    Source: paper 003 Eq. 13, with the absolute value (erratum E003-5).
    """
    size = np.abs(measured - simulated)
    both = np.isfinite(size)
    span = float(np.ptp(measured[both])) if both.any() else 0.0
    gaps, sizes = np.diff(np.flatnonzero(both)), size[both]
    middle = (sizes[1:] + sizes[:-1]) / 2.0
    whole = gaps < 2 * (usual or usual_gap(both))
    if span == 0.0 or not whole.any():
        return float("nan")
    duration_s = sample_time_s * gaps[whole].sum()
    return float(sample_time_s * (gaps * middle)[whole].sum() / duration_s / span)


def shift_deviations(course: Course) -> tuple[ShiftDeviation, ...]:
    """Every shift of a recording; none where the plant has no gears.

    Raises
    ------
    ArithmeticError
        If a simulation is not finite.
    """
    return tuple(_deviation_of(course, shift) for shift in shifts(course))


def _deviation_of(course: Course, shift: Shift) -> ShiftDeviation:
    recording, plant = course.recording, course.plant
    dt = recording.sample_time_s
    begin = max(s for s in recording.starts if s <= shift.first)
    # so long before a shift valves and delays are at rest, and their states known
    begin = max(shift.first - max(round(SETTLED_S / dt), 1), begin)
    found = simulate(plant, recording.part(begin, shift.last + 1), course.states[:, begin])
    inside = slice(shift.first, shift.last + 1)
    deviations = {}
    for name in plant.measured:
        values, usual = recording[name], usual_gap(np.isfinite(recording[name]))
        simulated = found[name][shift.first - begin :]
        deviations[name] = deviation(values[inside], simulated, dt, usual)
    return ShiftDeviation(shift.case, dt * shift.first, dt * shift.last, deviations)
