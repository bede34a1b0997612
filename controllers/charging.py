"""The opening of a wanted motion that builds the pressures which belong to it: a mode's inverse.

On a mode, dv/dt = r + d v + f p and dp/dt = b + A p + s v + B u.  The wanted pressures are carried
along as a plan.  The opening of a sample is the one that takes their force to what the motion needs
at its end,

    u = ((dv/dt - r - d v - f p) / T - f (b + A p + s v)) / (f B)

and what it does to the mean of both pressures, which no motion asks for, follows from the mode.  So
a change of direction, where dry friction turns, has the charge that it needs; a steady slide's
opening has none.  A series in speed, acceleration and jerk does not say it either: the mean
pressures are slower than the motion, and its terms grow.

Source: A. Isidori, "Nonlinear Control Systems", 3rd ed., Sec. 4.3 (inverse with its zero dynamics).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np

from controllers.axis import Axis
from linearize.modes import Mode


@dataclass(frozen=True)
class Charging:
    """One mode, or several mixed.

    rest, drag, push        r, d and f: acceleration at rest without pressures, per speed, per Pa
    inflow, fill, stir, open    b, A, s and B: Pa/s at rest without pressures, per Pa, speed and V
    """

    rest: float
    drag: float
    push: np.ndarray
    inflow: np.ndarray
    fill: np.ndarray
    stir: np.ndarray
    open: np.ndarray

    def opening(
        self, pressures: np.ndarray, speed: float, coming: np.ndarray, sample_time_s: float
    ) -> float:
        """The opening now, for the speed and acceleration of the next sample, ``coming``."""
        missing = coming[1] - self.rest - self.drag * coming[0] - self.push @ pressures
        flows = self.inflow + self.fill @ pressures + self.stir * speed
        return float((missing / sample_time_s - self.push @ flows) / (self.push @ self.open))

    def after(
        self, pressures: np.ndarray, speed: float, opening_v: float, sample_time_s: float
    ) -> np.ndarray:
        """The planned pressures a sample later, shape (2,)."""
        flows = self.inflow + self.fill @ pressures + self.stir * speed
        return pressures + sample_time_s * (flows + self.open * opening_v)


def charging_on(mode: Mode, axis: Axis, centre_v: float) -> Charging:
    """The speed and the pressures of an axis on one mode, from its opening."""
    rows = [mode.state_names.index(name) for name in (axis.velocity, *axis.pressures)]
    A, B, x = mode.A[np.ix_(rows, rows)], mode.B[rows, 0], mode.state[rows]
    level = mode.drift[rows] - A @ x - B * (mode.command[0] - centre_v)
    return Charging(
        float(level[0]), float(A[0, 0]), A[0, 1:], level[1:], A[1:, 1:], A[1:, 0], B[1:]
    )


def charging_mixed(here: Iterable[tuple[float, Charging]]) -> Charging:
    """Several modes mixed linearly by their weights."""
    here = [*here]
    names = [f.name for f in fields(Charging)]
    return Charging(*(sum(w * getattr(each, name) for w, each in here) for name in names))
