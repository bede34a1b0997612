"""Seals that rub less once they are warm."""

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
    Force,
    Received,
    State,
    form,
    strength,
)

GUESSED_K = 0.01  # of a seal's warmth where the strokes before are recorded, at a known time
UNSURE = 0.2  # of the warming time


@dataclass(frozen=True, kw_only=True)
class ThermalFriction(Effect):
    """Friction falls with the temperature that rubbing gives the seal.

    dF = -k_T w tanh(k v),   dw/dt = c F_r |v| - w / tau,   w = T_seal - T_room

    The heat comes from a typical friction force F_r, since effects do not see each other; only the
    product c F_r counts, in kelvin per metre of travel.

    Source: future work in paper 002 (Eq. 15, F = F_EPF + dF(T)); physics.md section 6
    (thermal_friction).
    """

    causes = (
        Cause(
            name="friction_thermal",
            strength="softening_n_k",
            forms=("warming_time_s",),
            balance=Balance.MOMENTUM,
            drivers=("distance travelled so far", "sign of the velocity"),
            shapes={"warming_time_s": (300.0, 1000.0, 3000.0)},
            shown_by="strokes repeated for many minutes from cold",
            source="paper 002 Eq. 15; physics.md section 6 (thermal_friction)",
        ),
    )

    body: str
    softening_n_k: Expression = strength(typical=0.5, upper=5.0)
    warming_time_s: Expression = form(1000.0, lower=30.0, upper=1e4, relative_deviation=UNSURE)
    heating_k_j: Expression = form(0.01, lower=1e-5, upper=1.0)
    rubbing_force_n: Expression = form(40.0, lower=0.1, upper=1e3)
    steepness_s_m: Expression = form(500.0, lower=1.0, upper=1e5)

    def states(self) -> Iterator[State]:
        yield State("warmer_k", initial=0.0, scale=10.0)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """As warm as the recorded strokes make a seal that was cold when the recording began.

        They tell it well: a free warmth in every window would be a free friction in each, which
        imitates whatever changes from one stroke to the next.  What the warming time leaves open
        grows from nothing.
        """
        speed = seen.get(f"{self.body}.velocity_m_s")
        if speed is None:
            return {}
        step_s = float(np.diff(seen["time_s"][:2]).sum())
        warmer_k, later_k = (
            self._warmth(np.abs(speed), step_s, share * self.warming_time_s)
            for share in (1.0, 1.0 + UNSURE)
        )
        return {"warmer_k": (warmer_k, GUESSED_K + np.abs(later_k - warmer_k))}

    def _warmth(self, speed: np.ndarray, step_s: float, warming_time_s: float) -> np.ndarray:
        """Warmth at every sample of strokes that begin cold."""
        from scipy.signal import lfilter

        heated_k = self.heating_k_j * self.rubbing_force_n * step_s
        return lfilter([heated_k], [1.0, -np.exp(-step_s / warming_time_s)], speed)

    def terms(self, now: Conditions) -> Iterator[Force]:
        side = ca.tanh(self.steepness_s_m * now[self.body].velocity_m_s)
        yield Force(self.body, self.softening_n_k * now[self.name].warmer_k * side)

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        heated = self.heating_k_j * self.rubbing_force_n * ca.fabs(now[self.body].velocity_m_s)
        return {"warmer_k": heated - now[self.name].warmer_k / self.warming_time_s}
