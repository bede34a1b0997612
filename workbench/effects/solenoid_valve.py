"""A 3/2 solenoid valve: energised it joins a chamber to the supply, released to the atmosphere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import pi

import casadi as ca
import numpy as np

from workbench.air import GAS_CONSTANT_J_KG_K, NozzleLaw
from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Effect,
    Expression,
    MassFlow,
    Received,
    State,
    form,
    strength,
)
from workbench.effects.forces import push_n
from workbench.port import port

VACUUM_PERMEABILITY_H_M = 4e-7 * pi
COPPER_PER_K = 0.0039  # temperature coefficient of the coil's resistance
COIL_REFERENCE_K = 293.15
QUENCHED_A = 0.01  # current below which the clamp of the release lets go; its force is 0.04 N


@dataclass(frozen=True, kw_only=True)
class SolenoidValve(Effect):
    """Coil, armature between two stops, and the two seats that it opens in turn.

    L di/dt = U - R_c i - i dL/dx v_v,   U = U_sup for c = 1,  -U_z min(i / 10 mA, 1) for c = 0
    L = N^2 / R_m,   R_m = R_m0 + gap / (mu0 A_p),   gap = g_res + x_max - x_v
    dL/dx = L / (R_m mu0 A_p)
    m dv_v/dt = i^2/2 dL/dx + (p_sup - p) A_seat - F_0 - k x_v - d v_v + stops at 0 and x_max
    A_in = C_d (1 + e) (1 - share) min(pi d_in x_v, pi d_in^2/4)
    A_ex = C_d (1 - e) (1 - share) min(pi d_ex (x_max - x_v), pi d_ex^2/4)
    mdot = A_in psi(supply to chamber) - A_ex psi(chamber to atmosphere), nozzle law, plus leaks

    R_c = R_20 (1 + 0.0039 / K (T - 20 degC)).  A command between 0 and 1 mixes the two voltages,
    as fast switching would.  The armature is kept between its stops before it enters the magnetic
    circuit and the seats, since a bounce beyond would make the gap negative (physics.md 8.2); so
    the inductance stands still while the armature is in a stop, and induces nothing there.

    The force of the pressures on the armature is absent by assumption 7 of the paper
    (``seat_area_m2``).  Assumptions 5 and 6: the working port does not restrict; the stroke is
    longer than both seats need.  Where the clamp lets go the voltage falls in a straight line, a
    repair of the switch at zero current.

    Source: paper 003, solenoid valves; equations and all values by physics.md 2.5 (*chosen*: the
    paper prints no parameter).
    """

    causes = (
        Cause(
            name="exhaust_restriction",
            strength="exhaust_restriction_share",
            balance=Balance.FLOW,
            drivers=("exhausting chamber pressure",),
            shown_by="release from full pressure",
            source="paper 003 (choked exhaust raises p2); physics.md section 6",
        ),
        Cause(
            name="supply_restriction",
            strength="supply_restriction_share",
            balance=Balance.FLOW,
            drivers=("charging chamber pressure",),
            shown_by="charge from ambient pressure",
            source="interface.md section 6",
        ),
        Cause(
            name="discharge_asymmetry",
            strength="discharge_asymmetry",
            balance=Balance.FLOW,
            drivers=("direction of the flow",),
            shown_by="charge and release of the same chamber",
            source="papers 000, 004; physics.md section 6 (cd_asymmetry)",
        ),
        Cause(
            name="spool_leak",
            strength="leak_area_m2",
            balance=Balance.MASS,
            drivers=("pressure at rest",),
            shown_by="both commands held for a second",
            source="physics.md section 6 (spool_leak)",
        ),
    )

    chamber: str
    gas_constant_j_kg_k: float = GAS_CONSTANT_J_KG_K

    exhaust_restriction_share: Expression = strength(typical=0.3, upper=0.9)
    supply_restriction_share: Expression = strength(typical=0.3, upper=0.9)
    discharge_asymmetry: Expression = strength(typical=0.2, lower=-0.5, upper=0.5)
    leak_area_m2: Expression = strength(typical=3e-7, upper=1e-5)
    seat_area_m2: Expression = strength(typical=7e-6, upper=5e-5)

    supply_voltage_v: Expression = form(24.0, lower=10.0, upper=40.0, deviation=1.0)
    clamp_voltage_v: Expression = form(45.0, lower=1.0, upper=200.0)
    coil_resistance_ohm: Expression = form(30.0, lower=1.0, relative_deviation=0.05)
    coil_temperature_k: Expression = form(293.15, lower=230.0, upper=450.0)
    coil_turns: Expression = form(1100.0, lower=1.0)
    pole_area_m2: Expression = form(1e-4, lower=1e-6)
    core_reluctance_per_h: Expression = form(2e6, lower=1e3, relative_deviation=0.05)
    residual_gap_m: Expression = form(0.2e-3, lower=1e-5)
    full_lift_m: Expression = form(1.9e-3, lower=1e-4)
    armature_mass_kg: Expression = form(5e-3, lower=1e-4, relative_deviation=0.05)
    spring_stiffness_n_m: Expression = form(700.0, relative_deviation=0.05)
    preload_n: Expression = form(2.0, relative_deviation=0.05)
    damping_n_s_m: Expression = form(1.0, relative_deviation=0.05)
    stop_stiffness_n_m: Expression = form(2e5, lower=1e3)
    stop_damping_n_s_m: Expression = form(8.0)
    inlet_diameter_m: Expression = form(3.2e-3, lower=1e-4)
    exhaust_diameter_m: Expression = form(4e-3, lower=1e-4)
    discharge_coefficient: Expression = form(0.72, lower=0.1, upper=1.0, relative_deviation=0.05)

    @property
    def absent(self) -> bool:
        """Never: with all its flaws at null it is still the valve."""
        return False

    def states(self) -> Iterator[State]:
        seated_m = -self.preload_n / (self.stop_stiffness_n_m + self.spring_stiffness_n_m)
        yield State("current_a", initial=0.0, scale=0.5, tolerance=3e-4)
        yield State("armature_position_m", initial=seated_m, scale=1e-3, tolerance=1e-6)
        yield State("armature_velocity_m_s", initial=0.0, scale=1.0, tolerance=2.5e-4)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        """As after a long time under the recorded command."""
        command = seen.get(f"{self.name}.command")
        if command is None:
            return {}
        spread = {"current_a": 0.3, "armature_position_m": 0.5e-3}
        return {key: (command * self.driven()[key], std) for key, std in spread.items()}

    def driven(self) -> dict[str, Expression]:
        """Own states a long time after the command has come."""
        return {
            "current_a": self.supply_voltage_v / self._warm_ohm,
            "armature_position_m": self.full_lift_m,
            "armature_velocity_m_s": 0.0,
        }

    def terms(self, now: Conditions) -> Iterator[MassFlow]:
        law, lift_m = NozzleLaw(), self._lift_m(now)
        paths = port(now, self.chamber, self.gas_constant_j_kg_k)
        inlet_m2 = _seat_m2(self.inlet_diameter_m, lift_m)
        outlet_m2 = _seat_m2(self.exhaust_diameter_m, self.full_lift_m - lift_m)
        inlet_m2 *= (1.0 + self.discharge_asymmetry) * (1.0 - self.supply_restriction_share)
        outlet_m2 *= (1.0 - self.discharge_asymmetry) * (1.0 - self.exhaust_restriction_share)
        into_kg_s = paths.charge.flow_kg_s(self._hole_m2(inlet_m2), law)
        out_kg_s = paths.vent.flow_kg_s(self._hole_m2(outlet_m2), law)
        yield from paths.flows(into_kg_s, out_kg_s, law, law)

    def _hole_m2(self, seat_m2: Expression) -> Expression:
        """Effective area of a seat and of the leak beside it."""
        return self.discharge_coefficient * seat_m2 + self.leak_area_m2

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        own, lift_m = now[self.name], self._lift_m(now)
        current_a, place_m = own.current_a, own.armature_position_m
        between = ca.logic_and(place_m >= 0, place_m <= self.full_lift_m)
        moving_m_s = ca.if_else(between, own.armature_velocity_m_s, 0.0)
        gap_m = self.residual_gap_m + self.full_lift_m - lift_m
        pole_h_m = VACUUM_PERMEABILITY_H_M * self.pole_area_m2
        reluctance_per_h = self.core_reluctance_per_h + gap_m / pole_h_m
        inductance_h = self.coil_turns**2 / reluctance_per_h
        slope_h_m = inductance_h / (reluctance_per_h * pole_h_m)
        across_v = self._voltage_v(own.command, current_a) - self._warm_ohm * current_a
        across_v -= current_a * slope_h_m * moving_m_s
        force_n = 0.5 * current_a**2 * slope_h_m + self._mechanical_n(now)
        return {
            "current_a": across_v / inductance_h,
            "armature_position_m": own.armature_velocity_m_s,
            "armature_velocity_m_s": force_n / self.armature_mass_kg,
        }

    @property
    def _warm_ohm(self) -> Expression:
        """Resistance of the coil at its temperature."""
        warm = 1.0 + COPPER_PER_K * (self.coil_temperature_k - COIL_REFERENCE_K)
        return self.coil_resistance_ohm * warm

    def _voltage_v(self, command: Expression, current_a: Expression) -> Expression:
        clamped = ca.fmin(ca.fmax(current_a / QUENCHED_A, -1.0), 1.0)
        return command * self.supply_voltage_v - (1.0 - command) * self.clamp_voltage_v * clamped

    def _mechanical_n(self, now: Conditions) -> Expression:
        """All forces on the armature but the magnetic one."""
        own, wall = now[self.name], (self.stop_stiffness_n_m, self.stop_damping_n_s_m)
        across_pa = now["supply"].pressure_pa - now[self.chamber].pressure_pa
        return (
            self.seat_area_m2 * across_pa
            - self.preload_n
            - self.spring_stiffness_n_m * own.armature_position_m
            - self.damping_n_s_m * own.armature_velocity_m_s
            + push_n(-own.armature_position_m, -own.armature_velocity_m_s, *wall)
            - push_n(own.armature_position_m - self.full_lift_m, own.armature_velocity_m_s, *wall)
        )

    def _lift_m(self, now: Conditions) -> Expression:
        """Lift of the armature, between its stops."""
        return ca.fmin(ca.fmax(now[self.name].armature_position_m, 0.0), self.full_lift_m)


def _seat_m2(diameter_m: Expression, lift_m: Expression) -> Expression:
    """Open area of a seat: the curtain under the armature, at most the bore."""
    return ca.fmin(pi * diameter_m * lift_m, pi / 4.0 * diameter_m**2)
