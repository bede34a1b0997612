"""The synchroniser of a gear: it blocks the way until the speeds agree."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

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

EDGE_M = 0.2e-3  # over which the force rises at either end of the zone
SYNCHRONISED = 0.02  # relative slip below which the blocking force falls to zero


@dataclass(frozen=True, kw_only=True)
class Synchroniser(Effect):
    """A blocking force on the tip of the lever until the relative speed of the gear is gone.

    F_ld += sign(x_tip) F_sync g(|x_tip|) min(z / 0.02, 1)
    dz/dt = -g min(z / 0.02, 1) / T_sync + (1 - z) max(1 - |x_tip| / x_1, 0) / T_slip

    g is 1 between x_1 and x_2 with edges of 0.2 mm and 0 outside; z is the relative speed over its
    value when the gear is out: it falls to zero in T_sync at the full force, later at less, and
    comes back in Neutral.  Where the load force is recorded, the synchroniser is in the record.

    Source: physics.md section 6 (synchroniser); future work in paper 003.  The zone, its edges and
    the return of the slip are *chosen*.  A force only delays a piston that pushes harder: at 9 bar
    the gearbox stands still from about 1300 N on, not with the 800 N named there.
    """

    causes = (
        Cause(
            name="synchroniser",
            strength="force_n",
            forms=("duration_s",),
            balance=Balance.MOMENTUM,
            drivers=("position at the synchronising place", "time spent there"),
            kinked=True,
            shapes={"duration_s": (0.05, 0.1, 0.3)},
            shown_by="a shift N to H: an unexplained standstill",
            source="physics.md section 6 (synchroniser); paper 003 future work",
        ),
    )
    produces: ClassVar[str] = "load.force_n"

    lever: str
    force_n: Expression = strength(typical=1500.0, upper=5e3)
    duration_s: Expression = form(0.1, lower=0.01, upper=1.0, relative_deviation=0.2)
    start_m: Expression = form(5e-3, lower=1e-3, upper=0.1)
    end_m: Expression = form(7e-3, lower=1e-3, upper=0.1)
    slipping_again_s: Expression = form(0.1, lower=0.01, upper=10.0)

    def states(self) -> Iterator[State]:
        yield State("slip", initial=1.0, scale=1.0, tolerance=1e-3)

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        if signal != self.produces:
            return value
        side = ca.if_else(now[self.lever].tip_m >= 0, 1.0, -1.0)
        return value + side * self.force_n * self._blocking(now)

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        out = ca.fmax(1.0 - ca.fabs(now[self.lever].tip_m) / self.start_m, 0.0)
        returning = (1.0 - now[self.name].slip) * out / self.slipping_again_s
        return {"slip": returning - self._blocking(now) / self.duration_s}

    def _blocking(self, now: Conditions) -> Expression:
        """Share of the full force that acts: within the zone, while there is slip."""
        distance_m = ca.fabs(now[self.lever].tip_m)
        entered_m = ca.fmin(distance_m - self.start_m, self.end_m - distance_m)
        within = ca.fmin(ca.fmax(entered_m / EDGE_M, 0.0), 1.0)
        return within * ca.fmin(ca.fmax(now[self.name].slip / SYNCHRONISED, 0.0), 1.0)
