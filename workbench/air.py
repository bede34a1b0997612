"""Dry air as an ideal gas, and its flow through a restriction (physics.md 0, 1.1)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace

import casadi as ca

from workbench.effect import Expression

HEAT_CAPACITY_RATIO = 1.4
GAS_CONSTANT_J_KG_K = 287.0


def critical_ratio(heat_capacity_ratio: Expression) -> Expression:
    """Pressure ratio below which an ideal nozzle is choked: (2/(kappa+1))^(kappa/(kappa-1))."""
    k = heat_capacity_ratio
    return (2.0 / (k + 1.0)) ** (k / (k - 1.0))


CRITICAL_RATIO = critical_ratio(HEAT_CAPACITY_RATIO)
LAMINAR_RATIO = 0.999  # above it the flow is linear in the ratio, so that its slope stays finite
LOWEST_PRESSURE_PA = 1.0  # solvers try states that no gas has; the equations must survive them
LOWEST_TEMPERATURE_K = 1.0


def choked_constant(
    gas_constant_j_kg_k: float, heat_capacity_ratio: Expression = HEAT_CAPACITY_RATIO
) -> Expression:
    """C_chk in s sqrt(K)/m: mass flow per area and upstream pressure over sqrt(T), choked.

    C_chk = sqrt(kappa/R (2/(kappa+1))^((kappa+1)/(kappa-1)))
    """
    k = heat_capacity_ratio
    return ca.sqrt(k / gas_constant_j_kg_k * (2.0 / (k + 1.0)) ** ((k + 1.0) / (k - 1.0)))


def nozzle_function(
    ratio: Expression, heat_capacity_ratio: Expression = HEAT_CAPACITY_RATIO
) -> Expression:
    """Psi(r) / C_chk of an ideal nozzle, r = p_d/p_u clipped to [0, 1].

    1                                                     r <= r_c
    C_sub/C_chk r^(1/k) sqrt(1 - r^((k-1)/k))             r_c < r <= 0.999
    straight line to zero                                 r > 0.999

    Source: papers 000, 001 (flow through a valve), 003 Eq. 1, 004 Eqs. 3 and 4; the straight line
    is a repair, because the slope at r = 1 is infinite (physics.md 1.1 c).
    """
    k, critical = heat_capacity_ratio, critical_ratio(heat_capacity_ratio)
    at_choking = critical ** (1.0 / k) * ca.sqrt(1.0 - critical ** ((k - 1.0) / k))
    bounded = ca.fmin(ca.fmax(ratio, critical), LAMINAR_RATIO)
    cooled = ca.exp((k - 1.0) / k * ca.log(bounded))  # a power whose slope costs no second one
    subsonic = bounded / cooled * ca.sqrt(1.0 - cooled) / at_choking  # r^(1/k) = r / r^((k-1)/k)
    above = ca.fmin((1.0 - ratio) / (1.0 - LAMINAR_RATIO), 1.0)
    return subsonic * above


def iso_function(
    ratio: Expression,
    critical_ratio: Expression,
    cracking_ratio: Expression,
    subsonic_index: Expression,
) -> Expression:
    """psi(r) of ISO 6358-1:2013 with the laminar zone repaired (erratum E002-4).

    1                                     r <= b
    [1 - ((r-b)/(a-b))^2]^m               b < r < a_reg = min(0.999 a, a - 1e-4)
    psi(a_reg) (a-r)/(a-a_reg)            a_reg <= r < a
    0                                     r >= a

    Source: paper 002 Eq. 3; as printed the base turns negative between a and the laminar limit.
    """
    b, a = critical_ratio, cracking_ratio
    regular = ca.fmin(LAMINAR_RATIO * a, a - 1e-4)
    bounded = ca.fmin(ca.fmax(ratio, b), regular)
    subsonic = ca.exp(subsonic_index * ca.log(1.0 - ((bounded - b) / (a - b)) ** 2))
    return subsonic * ca.fmin(ca.fmax((a - ratio) / (a - regular), 0.0), 1.0)


@dataclass(frozen=True)
class NozzleLaw:
    """Flow law of a plain hole."""

    heat_capacity_ratio: Expression = HEAT_CAPACITY_RATIO

    def __call__(self, ratio: Expression) -> Expression:
        return nozzle_function(ratio, self.heat_capacity_ratio)


@dataclass(frozen=True)
class IsoLaw:
    """Flow law of ISO 6358-1:2013; without arguments the standard orifice."""

    critical_ratio: Expression = 0.528
    cracking_ratio: Expression = 1.0
    subsonic_index: Expression = 0.5

    def __call__(self, ratio: Expression) -> Expression:
        return iso_function(ratio, self.critical_ratio, self.cracking_ratio, self.subsonic_index)


FlowLaw = NozzleLaw | IsoLaw


@dataclass(frozen=True)
class Path:
    """The two ends of a flow path: pressure and temperature of ``above`` and ``below``.

    Everything that depends on the ends alone is worked out once, so that several holes between the
    same two ends share it.  Flow counts from above to below and has the sign of the pressure
    difference: direction follows the pressures, not the command (erratum E000-4).
    """

    above_pa: Expression
    above_k: Expression
    below_pa: Expression
    below_k: Expression
    gas_constant_j_kg_k: float = GAS_CONSTANT_J_KG_K

    @cached_property
    def forward(self) -> Expression:
        """True where gas flows from above to below."""
        return self.above_pa >= self.below_pa

    @cached_property
    def temperature_k(self) -> Expression:
        """Temperature of the gas that flows: that of the upstream end."""
        return self.below_k + ca.if_else(self.forward, self.above_k - self.below_k, 0.0)

    @cached_property
    def ratio(self) -> Expression:
        """Downstream over upstream pressure, at most 1; negative only where no gas can be."""
        return (self.above_pa - self._fall_pa) / self._upstream_pa

    @cached_property
    def choked_kg_s_m2(self) -> Expression:
        """Signed choked mass flow per effective area: C_chk p_u / sqrt(T_u)."""
        direction = 2.0 * self.forward - 1.0
        size = choked_constant(self.gas_constant_j_kg_k) * self._upstream_pa
        return direction * size / ca.sqrt(self.temperature_k)

    @cached_property
    def _fall_pa(self) -> Expression:
        """Pressure difference where gas flows forward, else zero.

        Upstream and downstream are chosen by it, because the derivative of a minimum is shared
        between both arguments where they are equal, and the slope of the flow would be lost there.
        """
        return ca.if_else(self.forward, self.above_pa - self.below_pa, 0.0)

    @cached_property
    def _upstream_pa(self) -> Expression:
        return ca.fmax(self.below_pa + self._fall_pa, LOWEST_PRESSURE_PA)

    def flow_kg_s(self, area_m2: Expression, law: FlowLaw) -> Expression:
        """Mass flow from above to below through an effective area.

        mdot = A_e C_chk p_u/sqrt(T_u) psi(p_d/p_u).  Source: physics.md 1.1.
        """
        return area_m2 * law(self.ratio) * self.choked_kg_s_m2


def path_between(
    above: SimpleNamespace, below: SimpleNamespace, gas_constant_j_kg_k: float | None = None
) -> Path:
    """The path between two conditions; the gas constant is that of ``above`` unless given."""
    ends = (above.pressure_pa, above.temperature_k, below.pressure_pa, below.temperature_k)
    return Path(*ends, gas_constant_j_kg_k or above.gas_constant_j_kg_k)
