"""What happens to a valve's command before it opens anything: offset, lag, delay, dead zone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
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
from workbench.effects.timing import Timing
from workbench.spool import shut_while_stuck

FADING_V = 0.01  # half-width of a band below which its centre loses its meaning


@dataclass(frozen=True, kw_only=True)
class ValveOffset(Effect):
    """The spool's centre lies beside the nominal one: u -> u - u_off.

    Source: papers 000 (5.25 V) and 002 (4.98 V); physics.md section 6 (offset).
    """

    causes = (
        Cause(
            name="valve_offset",
            strength="offset_v",
            balance=Balance.VALVE,
            drivers=("command",),
            shown_by="constant small commands to both sides",
            source="papers 000, 002; physics.md section 6 (offset)",
        ),
    )

    signal: str
    offset_v: Expression = strength(typical=0.2, lower=-1.0, upper=1.0, deviation=0.02)

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        return value - self.offset_v if signal == self.signal else value


@dataclass(frozen=True, kw_only=True)
class ValveLag(Effect):
    """First-order lag of the spool: u -> lagged u, T d(lagged)/dt = u - lagged.

    The strength is the time constant itself; see :mod:`workbench.effects.fading_lag` for short
    ones.

    Source: paper 002 (100 Hz, neglected); physics.md section 6 (valve_dynamics); share form of
    architecture.md section 4.
    """

    causes = (
        Cause(
            name="valve_lag",
            strength="time_constant_s",
            balance=Balance.VALVE,
            drivers=("rate of the command",),
            kinked=True,
            shown_by="fast command steps and a multi-sine up to 20 Hz",
            source="paper 002; physics.md section 6 (valve_dynamics)",
        ),
    )

    signal: str
    lagged: ClassVar[str] = "lagged_v"
    initial_v: float = 5.0
    command_range: ClassVar[float] = 10.0
    time_constant_s: Expression = strength(typical=20e-3, upper=0.2)
    shortest_s: Expression = form(0.5e-3, lower=1e-4, upper=1e-2)

    def states(self) -> Iterator[State]:
        yield State(self.lagged, initial=self.initial_v, scale=0.1 * self.command_range)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        known_to = 0.01 * self.command_range
        return {self.lagged: (seen[self.signal], known_to)} if self.signal in seen else {}

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        if signal != self.signal:
            return value
        now.place(f"{self.name}.entering_v", value)
        lagged = now.read(f"{self.name}.{self.lagged}")
        return behind_lag(value, lagged, self.time_constant_s, self.shortest_s)

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        entering, lagged = now[self.name].entering_v, now.read(f"{self.name}.{self.lagged}")
        rate = lagged_rate(entering, lagged, self.time_constant_s, self.shortest_s)
        return {self.lagged: rate}


@dataclass(frozen=True, kw_only=True)
class PwmLag(ValveLag):
    """The same lag on a command from 0 to 1; ``initial_v`` is such a command too.

    Source: physics.md section 6 (valve_dynamics).
    """

    lagged: ClassVar[str] = "lagged_share"
    command_range: ClassVar[float] = 1.0
    initial_v: float = 0.5


@dataclass(frozen=True, kw_only=True)
class DeadZone(Effect):
    """Overlap of the spool: a band of commands around the centre that opens nothing.

    u -> u_n + R (u' - u_n - w) / (R - w)  above the band,  u_n inside,  likewise below

    with u' = u - (u_c - u_n), u_c the centre of the band, u_n the valve's own centre and R the
    distance from that to full command, so that full command is full opening for every half-width
    w.  A band beside the valve's centre is an offset of the command; it fades with the band.

    Source: paper 002 Fig. 11 and Table 3 (zms 4.53 V, zmd 5.37 V); the rescaling is the convention
    of physics.md 2.4.
    """

    causes = (
        Cause(
            name="valve_dead_zone",
            strength="half_width_v",
            balance=Balance.VALVE,
            drivers=("command near centre",),
            kinked=True,
            shown_by="slow voltage ramp through the centre",
            source="paper 002 Fig. 11, Table 3",
        ),
    )

    signal: str
    half_width_v: Expression = strength(typical=0.6, upper=2.0, deviation=0.02)
    centre_v: Expression = form(5.0, lower=0.1, upper=9.9, deviation=0.02)
    neutral_v: Expression = form(5.0, lower=0.1, upper=9.9)
    full_v: Expression = form(10.0, lower=1.0, upper=24.0)

    @property
    def shift_v(self) -> Expression:
        """How far the band lies beside the valve's centre; nothing where there is no band."""
        present = 1.0 - ca.exp(-self.half_width_v / FADING_V)
        return present * (self.centre_v - self.neutral_v)

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        if signal != self.signal:
            return value
        entering = value - self.shift_v
        offset_v, w = entering - self.neutral_v, self.half_width_v
        above_v, below_v = self.full_v - self.neutral_v, self.neutral_v
        above = ca.fmax(offset_v - w, 0.0) * (above_v / (above_v - w))
        below = ca.fmin(offset_v + w, 0.0) * (below_v / (below_v - w))
        return entering + (above + below - offset_v)  # exactly the value where there is no zone

    def undo(self, wanted_v: Expression) -> Expression:
        """The command that comes out as ``wanted_v``: what a controller sends to jump the band."""
        offset_v, w = wanted_v - self.neutral_v, self.half_width_v
        above_v, below_v = self.full_v - self.neutral_v, self.neutral_v
        above = w + offset_v * (above_v - w) / above_v
        below = -w + offset_v * (below_v - w) / below_v
        jumped_v = ca.if_else(offset_v > 0, above, ca.if_else(offset_v < 0, below, 0.0))
        return self.neutral_v + self.shift_v + jumped_v


@dataclass(frozen=True, kw_only=True)
class CommandDelay(Timing):
    """A pure delay of a command, u(t - T); at T = 0 the sequence is unchanged.

    Source: papers 000 and 001 (1 ms each way), 003 (3 ms); physics.md section 6 (valve_delay).
    """

    causes = (
        Cause(
            name="command_delay",
            strength="delay_s",
            balance=Balance.TIMING,
            drivers=("rate of the command",),
            kinked=True,
            tolerated=(2e-3, 3e-3),  # a 100 Hz valve and a 1 ms sensor, neglected in paper 002
            shown_by="fast command steps and a multi-sine up to 20 Hz",
            source="papers 000, 001, 003; physics.md section 6 (valve_delay)",
        ),
    )

    signal: str
    delay_s: Expression = strength(typical=15e-3, upper=0.2)

    def acts_on(self, channel: str) -> bool:
        return channel == self.signal

    def sent_at_s(self, time_s: np.ndarray) -> np.ndarray:
        return time_s - float(self.delay_s)


@dataclass(frozen=True, kw_only=True)
class StuckBand(Effect):
    """The spool stays at its centre until a command below it has left a band, then comes loose.

    u -> u_n   where u_n - band < u < u_n

    The band is a share of the command's range ``span``; stand it behind the dead zone.

    Source: paper 004 (event near 250 s) and interface.md section 6, for valves that act on two
    chambers; the spool valve of the soft joint shuts its vent alone.
    """

    causes = (
        Cause(
            name="valve_stuck_band",
            strength="band_share",
            balance=Balance.VALVE,
            drivers=("command just below centre",),
            kinked=True,
            shown_by="small commands to the side below centre",
            source="paper 004, Fig. 8 near 250 s; physics.md sections 6 and 7",
        ),
    )

    signal: str
    neutral: float
    span: float

    band_share: Expression = strength(typical=0.03, upper=0.3)

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        if signal != self.signal:
            return value
        below = ca.fmax(self.neutral - value, 0.0)
        return value + below * shut_while_stuck(below / self.span, self.band_share)
