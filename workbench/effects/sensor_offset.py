"""Sensors that read too much or too little by a constant.

There is none for forces: an offset of a force sensor is what :class:`ConstantForce` is.
"""

from __future__ import annotations

from dataclasses import dataclass

from workbench.effect import Balance, Cause, Conditions, Effect, Expression, strength

CAUSE = dict(
    name="sensor_offset",
    balance=Balance.SENSOR,
    drivers=("nothing: it is constant",),
    shown_by="hold at rest with both chambers vented to ambient",
    source="interface.md section 6; physics.md section 6 (adc bias)",
)


@dataclass(frozen=True, kw_only=True)
class PressureSensorOffset(Effect):
    """y = p + e.  Source: physics.md section 6 (adc bias)."""

    causes = (Cause(strength="offset_pa", **CAUSE),)

    signal: str
    offset_pa: Expression = strength(typical=30e3, lower=-2e5, upper=2e5)

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        return value + self.offset_pa if signal == self.signal else value


@dataclass(frozen=True, kw_only=True)
class PositionSensorOffset(Effect):
    """y = x + e.  Source: physics.md section 6 (adc bias)."""

    causes = (Cause(strength="offset_m", **CAUSE),)

    signal: str
    offset_m: Expression = strength(typical=10e-3, lower=-0.1, upper=0.1)

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        return value + self.offset_m if signal == self.signal else value


@dataclass(frozen=True, kw_only=True)
class AngleSensorOffset(Effect):
    """y = theta + e.  Source: physics.md section 6 (adc bias)."""

    causes = (Cause(strength="offset_rad", **CAUSE),)

    signal: str
    offset_rad: Expression = strength(typical=0.05, lower=-0.5, upper=0.5)

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        return value + self.offset_rad if signal == self.signal else value
