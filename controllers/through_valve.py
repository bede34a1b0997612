"""From a wanted opening of the valve to its command: the dead zone is undone on the way."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import tanh

import casadi as ca
import numpy as np

from linearize.reduction import closed_command
from workbench.called import Curve
from workbench.contracts import Estimate
from workbench.effects.valve_command import DeadZone, ValveLag
from workbench.plant import Plant

LED_S = 4e-3  # time constant of a spool under the lead: faster asks for more than the noise allows


@dataclass(frozen=True)
class ThroughValve:
    """Command of one proportional valve for an opening in volts behind its dead zone.

    u = u_c + o + j(o) tanh(|o| / o_s),   j = jump that the dead zone needs at o

    Within a few o_s of zero only part of the jump is made: the valve stays shut there, so that
    noise on a small opening does not throw the spool across the band.

    Attributes
    ----------
    centre_v, lower_v, upper_v
        Command that opens nothing, and its range.
    offset_v
        Part of the centre that the valve takes off before its dead zone.
    dead_zone
        What is undone; None where the plant has none.
    lag
        First-order lag of the spool; None where it has none.
    smooth_v
        o_s, the opening over which the jump builds up.
    """

    centre_v: float
    lower_v: float
    upper_v: float
    offset_v: float
    dead_zone: DeadZone | None
    smooth_v: float
    lag: ValveLag | None = None

    def sent(self, opening_v: float, estimate: Estimate) -> np.ndarray:
        """The command for an opening, led where the spool lags, shape (1,).

        u = z + (u_wanted - z) T / T_led, so that the spool z, as estimated, moves with the time
        constant T_led instead of T.  An estimator that does not tell of the spool leads nothing.
        """
        wanted = self.shut if opening_v == 0.0 else self.command(opening_v)
        if self.lag is None or (spool_v := f"{self.lag.name}.lagged_v") not in estimate.names:
            return wanted
        spool = estimate.pick([spool_v])
        led = spool + (wanted - spool) * max(float(self.lag.time_constant_s) / LED_S, 1.0)
        return np.clip(led, self.lower_v, self.upper_v)

    def command(self, opening_v: float) -> np.ndarray:
        """The command for an opening, shape (1,), within its range."""
        wanted_v = self.centre_v + opening_v
        through_v = wanted_v
        if self.dead_zone is not None:
            through_v = self.offset_v + self._undone(wanted_v - self.offset_v)
        jump_v = (through_v - wanted_v) * tanh(abs(opening_v) / self.smooth_v)
        return np.array([min(max(wanted_v + jump_v, self.lower_v), self.upper_v)])

    def lag_s(self, told: bool) -> float:
        """Time constant that :meth:`sent` leaves between a wanted opening and the spool's.

        ``told``: whether an estimator tells of the spool.
        """
        if self.lag is None:
            return 0.0
        constant_s = float(self.lag.time_constant_s)
        return min(constant_s, LED_S) if told else constant_s

    @cached_property
    def _undone(self) -> Curve:
        """Wanted opening behind the dead zone -> what goes in before it."""
        wanted = ca.SX.sym("wanted")
        return Curve(ca.Function("undone", [wanted], [self.dead_zone.undo(wanted)]))

    @property
    def shut(self) -> np.ndarray:
        """The command that opens nothing, shape (1,)."""
        return np.array([self.centre_v])

    @property
    def openings_v(self) -> tuple[float, float]:
        """Smallest and largest opening."""
        return self.lower_v - self.centre_v, self.upper_v - self.centre_v


def through_valve(plant: Plant, smooth_v: float, command: str | None = None) -> ThroughValve:
    """The valve of a command of a plant, the first unless named."""
    signal = next(s for s in plant.commands if command in (None, s.name))
    found = [e for e in plant.effects if isinstance(e, DeadZone) and e.signal == signal.name]
    lags = [
        e
        for e in plant.effects
        if isinstance(e, ValveLag) and e.signal == signal.name and not e.absent
    ]
    return ThroughValve(
        centre_v=closed_command(plant, signal.name),
        lower_v=signal.lower,
        upper_v=signal.upper,
        offset_v=closed_command(plant, signal.name) - signal.nominal,
        dead_zone=found[0] if found else None,
        smooth_v=smooth_v,
        lag=lags[0] if lags else None,
    )
