"""The lag of the valve's spool between the opening of a law and the modes, which leave it out.

A mode takes an opening for open at once (:mod:`linearize.reduction`).  Behind a first-order lag

    dx/dt = A x + B z,   dz/dt = (u - z) / T

with z the opening that the spool lets through, one more state of the mode.  T is that of the plant
where the law acts on the measurement itself, and what :mod:`controllers.through_valve` leaves of it
where an estimator tells of the spool.  A hybrid model with such modes has margins, foresight,
filters and certificates as any other.

Source: paper 002 (100 Hz, neglected there); physics.md section 6 (valve_dynamics).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from controllers.axis import Axis
from controllers.margins import Law
from controllers.scheduled import Schedule
from controllers.through_valve import through_valve
from linearize.modes import HybridModel, Mode
from workbench.plant import Plant

SPOOL = "spool.opening_v"  # the state's name; it is in volts of opening, whose scale is 1


def spool_lag_s(plant: Plant, told: bool, axis: Axis | None = None) -> float:
    """Time constant between the opening that a law wants and the one that it gets, 0 without lag.

    ``told``: whether an estimator tells the law of the spool, so that it is led.
    """
    return through_valve(plant, 1.0, axis.command if axis else None).lag_s(told)


def behind_spool(hybrid: HybridModel, lag_s: float) -> HybridModel:
    """Every mode with a command behind a spool of this time constant; of 0 the model itself."""
    if lag_s == 0.0:
        return hybrid
    driven = (_lagged(mode, lag_s) if mode.command_names else mode for mode in hybrid.modes)
    return replace(hybrid, modes=tuple(driven))


def not_reading_it(laws: Schedule[Law], lag_s: float) -> Schedule[Law]:
    """The laws on the modes of :func:`behind_spool`: none of them reads the spool."""
    return laws.mapped(unread) if lag_s else laws


def unread(law: Law) -> Law:
    """A law with one more state before it that it does not read."""
    return replace(law, B=np.pad(law.B, ((0, 0), (0, 1))), D=np.append(law.D, 0.0))


def _lagged(mode: Mode, lag_s: float) -> Mode:
    """The mode of one more state: its first command goes through the spool."""
    n = len(mode.state_names)
    A, B = np.pad(mode.A, (0, 1)), np.pad(mode.B, ((0, 1), (0, 0)))
    A[:n, n], A[n, n] = mode.B[:, 0], -1.0 / lag_s
    B[:, 0] = 0.0
    B[n, 0] = 1.0 / lag_s
    return replace(
        mode,
        state_names=(*mode.state_names, SPOOL),
        A=A,
        B=B,
        C=np.column_stack([mode.C, mode.D[:, 0]]),
        D=np.column_stack([np.zeros(len(mode.D)), mode.D[:, 1:]]),
        state=np.append(mode.state, mode.command[0]),
        drift=np.append(mode.drift, 0.0),
        scale=np.append(mode.scale, 1.0),
    )
