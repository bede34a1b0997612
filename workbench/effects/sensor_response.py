"""Sensors that read in a wrong scale, or late."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Effect,
    Expression,
    Received,
    State,
    form,
    strength,
)
from workbench.effects.fading_lag import behind_lag, lagged_rate


@dataclass(frozen=True, kw_only=True)
class SensorScale(Effect):
    """y = (1 + e) y_true.  Source: interface.md section 6 (gain 1 + e); physics.md section 6."""

    causes = (
        Cause(
            name="sensor_scale",
            strength="scale_change",
            balance=Balance.SENSOR,
            drivers=("the measured value",),
            shown_by="rest at several known values",
            source="interface.md section 6; physics.md section 6 (adc)",
        ),
    )

    signal: str
    scale_change: Expression = strength(typical=0.05, lower=-0.3, upper=0.3)

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        return value + self.scale_change * value if signal == self.signal else value


@dataclass(frozen=True, kw_only=True)
class SensorLag(Effect):
    """The reading comes through a first-order lag, whole but for the shortest ones.

    y = y_true + g (z - y_true), see :mod:`workbench.effects.fading_lag`.  A share that is fitted
    beside the time would be no sensor: a twelfth of a position that comes 70 ms late imitates a
    valve that lets too much through.

    The lagged value is counted in ``unit``, a typical size of the signal, so that one effect serves
    positions and pressures.

    Source: interface.md section 6; physics.md section 6 (adc, low pass of 100..500 Hz).
    """

    causes = (
        Cause(
            name="sensor_lag",
            strength="time_constant_s",
            balance=Balance.SENSOR,
            drivers=("rate of the measured value",),
            shown_by="fast command steps",
            source="interface.md section 6; physics.md section 6 (adc)",
        ),
    )

    signal: str
    unit: float
    initial: float = 0.0

    time_constant_s: Expression = strength(typical=10e-3, upper=0.5)
    shortest_s: Expression = form(0.5e-3, lower=1e-4, upper=1e-2)

    def states(self) -> Iterator[State]:
        yield State("lagged", initial=self.initial / self.unit, scale=1.0)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        return {"lagged": (seen[self.signal] / self.unit, 0.1)} if self.signal in seen else {}

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        if signal != self.signal:
            return value
        lagged = now[self.name].lagged * self.unit
        return behind_lag(value, lagged, self.time_constant_s, self.shortest_s)

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        true, lagged = now.read(self.signal) / self.unit, now[self.name].lagged
        return {"lagged": lagged_rate(true, lagged, self.time_constant_s, self.shortest_s)}
