"""Dry and viscous friction of the piston seals, with a Stribeck peak and presliding."""

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

BREAKAWAY_SHARE = 0.9  # z_ba = 0.9 z_max, paper 002
NEGLIGIBLE_FORCE_N = 1e-6  # keeps 0/0 away where all dry friction is absent
LEAST_DEFLECTION = 0.1  # of the break-away deflection: stiction without Coulomb friction at speed


def blend(deflection: Expression, velocity: Expression, limit: Expression) -> Expression:
    """alpha(z, v) of the elasto-plastic model: 0 elastic, 1 plastic.

    0 where v z <= 0 or |z| <= 0.9 z_max;  1 where |z| >= z_max;  in between
    1/2 sin(pi (|z| - (z_max + z_ba)/2) / (z_max - z_ba)) + 1/2

    Source: paper 002 Eq. 11 with the sign test first (erratum E002-5).
    """
    start = BREAKAWAY_SHARE * limit
    along = ca.fmin(ca.fmax((ca.fabs(deflection) - start) / (limit - start), 0.0), 1.0)
    rising = 0.5 * ca.sin(ca.pi * (along - 0.5)) + 0.5
    return ca.if_else(velocity * deflection > 0, rising, 0.0)


@dataclass(frozen=True, kw_only=True)
class BristleFriction(Effect):
    """Coulomb, Stribeck and viscous friction; by ``presliding_share`` through an elastic bristle.

    F   = (1 - share) F3 + share F5 + (s2 + asymmetry) v
    F3  = g(v) tanh(k v)
    F5  = s0 z + s1 dz/dt,    dz/dt = v - alpha(z, v) s0/g(v) |v| z
    g   = F_C + F_ex exp(-(|v|/v_s)^2),   each coefficient times 1 + w e for v >= 0, 1 - w e below

    F_ex = F_S - F_C is the excess of static friction.  The bristle's stiffness follows from the
    static force, s0 = (F_C + F_ex) / z_b with z_b the break-away deflection, and its damping from
    the stiffness, s1 = s0 tau: so it stays well behaved when Coulomb friction goes to zero, and
    paper 002's s0 = 1.12e6 N/m, s1 = 50 N s/m come out with its forces.  Below a tenth of the static
    force (stiction without Coulomb friction, at speed) the limit of z stays and the force fades.  e is ``asymmetry``, w the
    weight of each coefficient.

    Source: paper 002 Eqs. 9 to 14 and Table 5 (F5; erratum E002-6: magnitudes for v < 0), paper
    000 Eq. 11 (F3).  Law selection by share: architecture.md section 4.
    """

    causes = (
        Cause(
            name="coulomb_friction",
            strength="coulomb_force_n",
            balance=Balance.MOMENTUM,
            drivers=("sign of the velocity",),
            kinked=True,
            shown_by="slow triangle over the stroke at several speeds",
            source="paper 002 table 5; 000 Eq. 11; 003 Eq. 10",
        ),
        Cause(
            name="stiction",
            strength="stiction_excess_n",
            balance=Balance.MOMENTUM,
            drivers=("speed near zero",),
            kinked=True,
            shapes={"stribeck_velocity_m_s": (0.01, 0.024, 0.06)},
            shown_by="slow ramps from rest, both directions",
            source="paper 002 Eq. 13, table 5; 000 Eq. 11",
        ),
        Cause(
            name="viscous_friction",
            strength="viscous_n_s_m",
            balance=Balance.MOMENTUM,
            drivers=("velocity",),
            shown_by="strokes at several constant speeds",
            source="all five papers",
        ),
        Cause(
            name="presliding",
            strength="presliding_share",
            balance=Balance.MOMENTUM,
            drivers=("displacement since reversal",),
            kinked=True,
            sizes=(0.3, 0.6, 1.0),
            shown_by="small slow force or voltage reversals within break-away",
            source="paper 002 Eqs. 9 to 12 (F5)",
        ),
        Cause(
            name="friction_asymmetry",
            strength="asymmetry",
            balance=Balance.MOMENTUM,
            drivers=("speed", "direction"),
            shown_by="equal strokes in both directions at several speeds",
            source="paper 002 table 5",
        ),
    )

    body: str

    coulomb_force_n: Expression = strength(typical=60.0, upper=1e3)
    stiction_excess_n: Expression = strength(typical=60.0, upper=1e3)
    viscous_n_s_m: Expression = strength(typical=60.0, upper=1e4)
    presliding_share: Expression = strength(typical=1.0, upper=1.0, relative_deviation=0.0)
    asymmetry: Expression = strength(typical=0.3, lower=-0.9, upper=0.9, deviation=0.01)

    stribeck_velocity_m_s: Expression = form(0.024, lower=1e-3, upper=1.0)
    breakaway_deflection_m: Expression = form(40e-6, lower=1e-6, upper=1e-3)
    bristle_time_s: Expression = form(45e-6, lower=0.0, upper=1e-2)
    steepness_s_m: Expression = form(500.0, lower=1.0, upper=1e5)
    coulomb_weight: Expression = form(1.0, upper=5.0)
    excess_weight: Expression = form(1.0, upper=5.0)

    def states(self) -> Iterator[State]:
        yield State("deflection_m", initial=0.0, scale=2e-5, tolerance=1e-8)

    def guess(self, seen: Mapping[str, np.ndarray]) -> dict[str, tuple[np.ndarray | float, float]]:
        velocity_m_s = seen.get(f"{self.body}.velocity_m_s")
        if velocity_m_s is None:
            return {}
        sliding_m = 0.7 * float(self.breakaway_deflection_m)  # g(v)/s0 between Stribeck and Coulomb
        return {"deflection_m": (sliding_m * np.tanh(velocity_m_s / 5e-3), 0.5 * sliding_m)}

    def dry_force_n(self, velocity_m_s: Expression) -> Expression:
        """g(v): the dry force of steady sliding, positive."""
        side = ca.if_else(velocity_m_s >= 0, self.asymmetry, -self.asymmetry)
        peak = ca.exp(-ca.fmin((velocity_m_s / self.stribeck_velocity_m_s) ** 2, 50.0))
        excess_n = self.stiction_excess_n * (1.0 + self.excess_weight * side) * peak
        return self.coulomb_force_n * (1.0 + self.coulomb_weight * side) + excess_n

    def viscous_force_n(self, velocity_m_s: Expression) -> Expression:
        """Viscous part, asymmetric too: s2 (v + e |v|)."""
        return self.viscous_n_s_m * (velocity_m_s + self.asymmetry * ca.fabs(velocity_m_s))

    def terms(self, now: Conditions) -> Iterator[Force]:
        velocity_m_s, z = now[self.body].velocity_m_s, now[self.name].deflection_m
        plain_n = self.dry_force_n(velocity_m_s) * ca.tanh(self.steepness_s_m * velocity_m_s)
        relative, limit = self._relative(velocity_m_s)
        weakened = relative / limit  # 1 but where the least deflection takes over
        rate = self._rate(velocity_m_s, z)
        bristle_n = self._stiffness_n_m * (weakened * z + self.bristle_time_s * rate)
        dry_n = plain_n + self.presliding_share * (bristle_n - plain_n)
        yield Force(self.body, -dry_n - self.viscous_force_n(velocity_m_s))

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        rate = self._rate(now[self.body].velocity_m_s, now[self.name].deflection_m)
        return {"deflection_m": rate}

    @property
    def _static_force_n(self) -> Expression:
        return self.coulomb_force_n + self.stiction_excess_n + NEGLIGIBLE_FORCE_N

    @property
    def _stiffness_n_m(self) -> Expression:
        dry_n = self.coulomb_force_n + self.stiction_excess_n
        return dry_n / self.breakaway_deflection_m

    def _relative(self, velocity_m_s: Expression) -> tuple[Expression, Expression]:
        """g(v) / F_S, and the same kept above the least deflection."""
        relative = (self.dry_force_n(velocity_m_s) + NEGLIGIBLE_FORCE_N) / self._static_force_n
        return relative, ca.fmax(relative, LEAST_DEFLECTION)

    def _rate(self, velocity_m_s: Expression, z: Expression) -> Expression:
        limit_m = self.breakaway_deflection_m * self._relative(velocity_m_s)[1]
        plastic = blend(z, velocity_m_s, limit_m) * ca.fabs(velocity_m_s) * z / limit_m
        return velocity_m_s - plastic
