"""A tube between valve and chambers: what happens at the valve arrives later, and weaker."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import casadi as ca
import numpy as np

from workbench.air import GAS_CONSTANT_J_KG_K, HEAT_CAPACITY_RATIO, LOWEST_PRESSURE_PA
from workbench.effect import Balance, Cause, Conditions, Expression, form, strength
from workbench.effects.timing import Timing

VISCOSITY_PA_S = 1.8e-5  # of air at room temperature
SOUND_M_S = sqrt(HEAT_CAPACITY_RATIO * GAS_CONSTANT_J_KG_K * 293.15)


@dataclass(frozen=True, kw_only=True)
class LineDelay(Timing):
    """mdot(t - L/c) phi instead of mdot(t), on all flows of the valve.

    phi = exp(-R_t R T L / (2 p c)),   R_t = 32 mu / D^2   (laminar)

    The delay acts on the valve's sampled command: the flow depends on the chamber's pressure too,
    but that hardly changes while sound runs through the tube.

    Source: physics.md section 6 (line_delay, 3 ms/m), after Richer and Hurmuzlu 2000.
    """

    causes = (
        Cause(
            name="line_delay",
            strength="length_m",
            balance=Balance.FLOW,
            drivers=("rate of the command", "flow"),
            shown_by="fast command steps with two lengths of tube",
            source="physics.md section 6 (line_delay), after Richer and Hurmuzlu 2000",
        ),
    )

    signal: str
    chambers: tuple[str, ...]

    length_m: Expression = strength(typical=2.0, upper=10.0)
    diameter_m: Expression = form(4e-3, lower=1e-3, upper=2e-2)

    def acts_on(self, channel: str) -> bool:
        return channel == self.signal

    def sent_at_s(self, time_s: np.ndarray) -> np.ndarray:
        return time_s - float(self.length_m) / SOUND_M_S

    def alter(self, signal: str, value: Expression, now: Conditions) -> Expression:
        chamber, _, quantity = signal.rpartition(".")
        if quantity != "line_share" or chamber not in self.chambers:
            return value
        gas = now[chamber]
        friction_pa_s_m2 = 32.0 * VISCOSITY_PA_S / self.diameter_m**2
        carried_m2_s2 = GAS_CONSTANT_J_KG_K * gas.temperature_k
        doubled_pa = 2.0 * ca.fmax(gas.pressure_pa, LOWEST_PRESSURE_PA)
        return value * ca.exp(
            -friction_pa_s_m2 * carried_m2_s2 * self.length_m / (doubled_pa * SOUND_M_S)
        )
