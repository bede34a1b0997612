"""A tube between valve and chamber: what happens at the valve arrives later, and weaker.

The delay L/c acts on the valve's sampled command: the flow through the valve depends on the
chamber's pressure too, but that hardly changes while sound runs through the tube.  The attenuation
acts on the flow, see :func:`workbench.air.line_share`.  Both belong to the valve that feeds the
line, so the strength is a field of the valve.
"""

from __future__ import annotations

import numpy as np

from workbench.air import SOUND_M_S
from workbench.effect import Balance, Cause, Expression


def line_delay_cause() -> Cause:
    """The cause, for a valve with the fields ``line_length_m`` and ``line_diameter_m``."""
    return Cause(
        name="line_delay",
        strength="line_length_m",
        balance=Balance.FLOW,
        drivers=("rate of the command", "flow"),
        shown_by="fast command steps with two lengths of tube",
        source="physics.md section 6 (line_delay), after Richer and Hurmuzlu 2000",
    )


def sent_late(values: np.ndarray, length_m: Expression, sample_time_s: float) -> np.ndarray:
    """A sampled command after the time that sound takes along the line, shape (n,)."""
    return delayed(values, float(length_m) / SOUND_M_S, sample_time_s)


def delayed(values: np.ndarray, delay_s: float, sample_time_s: float) -> np.ndarray:
    """A sequence a while later, interpolated linearly between samples, shape (n,)."""
    if delay_s == 0.0:
        return values
    samples = np.arange(len(values), dtype=float)
    return np.interp(samples - delay_s / sample_time_s, samples, values)
