"""First-order lags in a loop that the modes leave out: of the valve's spool, and of the sensor.

A mode takes an opening for open at once and a reading for true (:mod:`linearize.reduction`).  With
a lag before its command,

    dx/dt = A x + B (u + s (z - u)),   dz/dt = (u - z) / T

s the share that goes through the lag, z is one more state of the mode.  T of a spool is that of the
plant where the law acts on the measurement itself, and what :mod:`controllers.through_valve` leaves
of it where an estimator tells of the spool.  The lag of a sensor is in the loop of a law on that
measurement alone, where it does the same before the command as behind the output; estimators know
it.  A hybrid model with such modes has margins, foresight, filters and certificates as any other.

Source: paper 002 (spool of 100 Hz, neglected there); physics.md section 6 (valve_dynamics, adc).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from controllers.axis import Axis
from controllers.margins import Law
from controllers.on_measurement import OnMeasurement
from controllers.scheduled import Schedule
from controllers.through_valve import through_valve
from linearize.modes import HybridModel, Mode
from workbench.contracts import Controller
from workbench.effects.sensor_response import SensorLag
from workbench.plant import Plant

SPOOL, SENSOR = "spool", "sensor"


@dataclass(frozen=True)
class Lag:
    """A first-order lag through which all goes that enters."""

    name: str
    time_constant_s: float


def lags_of(plant: Plant, law: Controller) -> tuple[Lag, ...]:
    """What lags in the loop of a law, from its opening on; nothing where nothing does."""
    if not isinstance(law, OnMeasurement):
        return spool_lag(plant, told=True, axis=getattr(law, "axis", None))
    return measured_lags(plant, law.signal)


def measured_lags(plant: Plant, signal: str) -> tuple[Lag, ...]:
    """Those of a law on one measured signal as it arrives."""
    sensors = (
        Lag(SENSOR, float(e.time_constant_s))
        for e in plant.effects
        if isinstance(e, SensorLag) and e.signal == signal and not e.absent
    )
    return (*spool_lag(plant, told=False), *sensors)


def spool_lag(plant: Plant, told: bool, axis: Axis | None = None) -> tuple[Lag, ...]:
    """Of the valve of an axis, the first one unless given; none where its spool has no lag.

    ``told``: whether an estimator tells the law of the spool, so that it is led.
    """
    lag_s = through_valve(plant, 1.0, axis.command if axis else None).lag_s(told)
    return (Lag(SPOOL, lag_s),) if lag_s else ()


def behind_lags(hybrid: HybridModel, lags: Iterable[Lag]) -> HybridModel:
    """Every mode with a command, behind these lags; without any the model itself."""
    for lag in lags:
        driven = (_behind(mode, lag) if mode.command_names else mode for mode in hybrid.modes)
        hybrid = replace(hybrid, modes=tuple(driven))
    return hybrid


def not_reading(laws: Schedule[Law], lags: tuple[Lag, ...]) -> Schedule[Law]:
    """The laws on the modes of :func:`behind_lags`: none of them reads what lags."""
    return laws.mapped(lambda law: unread(law, len(lags)))


def unread(law: Law, more: int = 1) -> Law:
    """A law with so many more states before it that it does not read."""
    return replace(law, B=np.pad(law.B, ((0, 0), (0, more))), D=np.pad(law.D, (0, more)))


def _behind(mode: Mode, lag: Lag) -> Mode:
    """The mode of one more state: its first command goes through the lag."""
    n = len(mode.state_names)
    A, B = np.pad(mode.A, (0, 1)), np.pad(mode.B, ((0, 1), (0, 0)))
    A[:n, n], A[n, n] = mode.B[:, 0], -1.0 / lag.time_constant_s
    B[:n, 0] = 0.0
    B[n, 0] = 1.0 / lag.time_constant_s
    D = mode.D.copy()
    D[:, 0] = 0.0
    return replace(
        mode,
        state_names=(*mode.state_names, f"{lag.name}.lagged"),
        A=A,
        B=B,
        C=np.column_stack([mode.C, mode.D[:, 0]]),
        D=D,
        state=np.append(mode.state, mode.command[0]),
        drift=np.append(mode.drift, 0.0),
        scale=np.append(mode.scale, 1.0),
    )
