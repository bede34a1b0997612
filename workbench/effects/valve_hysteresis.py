"""Play between command and spool: a spool that sticks follows only when pushed far enough."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

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


@dataclass(frozen=True, kw_only=True)
class ValveHysteresis(Effect):
    """The spool moves only where the command is more than s away from it.

    out = min(max(z, u - s), u + s),   T dz/dt = out - z

    The state z is where the spool was left; it follows the edge of the play within the time T, and
    the output never lags behind.  s is given as a share of the command's range ``span``; at s = 0
    the output is u.

    Source: paper 004 (suspected); physics.md section 6 (play of valve_stiction); T is chosen.
    """

    causes = (
        Cause(
            name="valve_hysteresis",
            strength="play_share",
            balance=Balance.VALVE,
            drivers=("command since its last reversal",),
            kinked=True,
            shown_by="slow command triangle through the centre",
            source="paper 004; physics.md section 6 (valve_stiction)",
        ),
    )

    signal: str
    span: float
    initial: float

    play_share: Expression = strength(typical=0.02, upper=0.2)
    settling_time_s: Expression = form(1e-3, lower=1e-4, upper=1e-2)

    def states(self) -> Iterator[State]:
        yield State("left_share", initial=self.initial / self.span, scale=0.1)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        command = seen.get(self.signal)
        return {} if command is None else {"left_share": (command / self.span, 0.02)}

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        if signal != self.signal:
            return value
        play, left = self.play_share * self.span, now[self.name].left_share * self.span
        held = ca.fmin(ca.fmax(left, value - play), value + play)
        now.place(f"{self.name}.entering_share", value / self.span)
        now.place(f"{self.name}.moved_share", held / self.span)
        return held

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        own = now[self.name]
        return {"left_share": (own.moved_share - own.left_share) / self.settling_time_s}
