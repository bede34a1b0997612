"""A bellows that goes on growing after its pressure has settled."""

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
from workbench.units import STANDARD_ATMOSPHERE_PA

GUESSED_PA = 1e3  # of what the wall has followed, where the pressures before are recorded
UNSETTLED_PA = 1e5  # as far as a wall may be from settled when the recording begins


@dataclass(frozen=True, kw_only=True)
class BellowsCreep(Effect):
    """A part of the expansion follows the pressure late.

    V -> V + C_1 z,   V' -> V' + C_1 dz/dt,   tau dz/dt = (p - p_atm) - z

    The state is the gauge pressure that the creeping wall has followed so far, so that it stays
    well behaved without creep.  For volumes at constant gas temperature: at the full level the
    temperature would have to follow the added volume too.

    Source: physics.md section 6 (bellows_creep, tau 1..10 s).
    """

    causes = (
        Cause(
            name="bellows_creep",
            strength="creep_m3_pa",
            forms=("creep_time_s",),
            shapes={"creep_time_s": (1.0, 5.0)},
            balance=Balance.MASS,
            drivers=("time since the last step of pressure",),
            shown_by="fill, close the valve, log the pressure for 20 s",
            source="physics.md section 6 (bellows_creep)",
        ),
    )

    chamber: str
    creep_m3_pa: Expression = strength(typical=2e-10, upper=5e-9)
    creep_time_s: Expression = form(3.0, lower=0.2, upper=30.0)

    def states(self) -> Iterator[State]:
        yield State("followed_pa", initial=0.0, scale=1e5)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """As far as the recorded pressure leads a wall that was settled when the recording began.

        A free one would be a free volume in every window.  What a wall half and twice as slow would
        have followed is within the deviation, and that it was not settled as long as it remembers.
        """
        pressure_pa = seen.get(f"{self.chamber}.pressure_pa")
        if pressure_pa is None:
            return {}
        gauge_pa = pressure_pa - STANDARD_ATMOSPHERE_PA
        step_s = float(np.diff(seen["time_s"][:2]).sum())
        followed, *others = (
            _followed(gauge_pa, step_s, share * self.creep_time_s) for share in (1.0, 0.5, 2.0)
        )
        unsettled = np.exp(-np.arange(len(gauge_pa)) * step_s / self.creep_time_s)
        apart = np.max(np.abs(np.array(others) - followed), axis=0)
        return {"followed_pa": (followed, GUESSED_PA + apart + UNSETTLED_PA * unsettled)}

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        if signal == f"{self.chamber}.volume_m3":
            crept_m3 = self.creep_m3_pa * now[self.name].followed_pa
            return ca.fmax(value + crept_m3, 0.1 * value)
        if signal == f"{self.chamber}.volume_rate_m3_s":
            return value + self.creep_m3_pa * self._rate(now)
        return value

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        return {"followed_pa": self._rate(now)}

    def _rate(self, now: Conditions) -> Expression:
        gauge_pa = now[self.chamber].pressure_pa - now["atmosphere"].pressure_pa
        return (gauge_pa - now[self.name].followed_pa) / self.creep_time_s


def _followed(gauge_pa: np.ndarray, step_s: float, creep_time_s: float) -> np.ndarray:
    """What a wall that begins settled has followed at every sample."""
    from scipy.signal import lfilter

    kept = np.exp(-step_s / creep_time_s)
    return gauge_pa[0] + lfilter([0.0, 1.0 - kept], [1.0, -kept], gauge_pa - gauge_pa[0])
