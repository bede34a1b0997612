"""Friction with presliding: before it slides, a seal bends like a bristle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import casadi as ca

from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Expression,
    Force,
    Received,
    State,
    form,
    strength,
)
from workbench.effects.stribeck_friction import StribeckFriction

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


@dataclass(frozen=True)
class ElastoPlastic:
    """A bristle that bends back without loss before it slides (F5 of paper 002): no creep."""

    def __call__(
        self, deflection: Expression, velocity: Expression, limit: Expression
    ) -> Expression:
        return blend(deflection, velocity, limit)


@dataclass(frozen=True)
class LuGre:
    """A bristle that slides a little at any speed: alpha = 1, which creeps under small loads."""

    def __call__(
        self, deflection: Expression, velocity: Expression, limit: Expression
    ) -> Expression:
        return 1.0


@dataclass(frozen=True, kw_only=True)
class BristleFriction(StribeckFriction):
    """Stribeck friction, of which ``presliding_share`` acts through an elastic bristle.

    F   = (1 - share) F3 + share F5 + s2 (v + e |v|)
    F3  = g tanh(k v),    g as in :class:`StribeckFriction`
    F5  = s0 z + s1 dz/dt,    dz/dt = v - alpha(z, v) s0/g |v| z

    The bristle's stiffness follows from the static force, s0 = (F_C + F_ex + c_p |dp|) / z_b with
    z_b the break-away deflection, and its damping from the stiffness, s1 = s0 tau: so it stays well
    behaved when Coulomb friction goes to zero, and paper 002's s0 = 1.12e6 N/m, s1 = 50 N s/m come
    out with its forces.

    Source: paper 002 Eqs. 9 to 14 and Table 5 (F5; erratum E002-6: magnitudes for v < 0).  Law
    selection by share: architecture.md section 4.  ``plasticity`` is alpha: LuGre is F5 with 1.
    """

    causes = (
        *StribeckFriction.causes,
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
    )

    plasticity: ElastoPlastic | LuGre = ElastoPlastic()

    presliding_share: Expression = strength(typical=1.0, upper=1.0, relative_deviation=0.0)

    breakaway_deflection_m: Expression = form(40e-6, lower=1e-6, upper=1e-3)
    bristle_time_s: Expression = form(45e-6, lower=0.0, upper=1e-2)

    def reduced(self) -> StribeckFriction:
        """Without presliding there is no bristle."""
        if not isinstance(self.presliding_share, int | float) or self.presliding_share != 0.0:
            return self
        kept = (f.name for f in fields(StribeckFriction))
        return StribeckFriction(**{name: getattr(self, name) for name in kept})

    def states(self) -> Iterator[State]:
        yield State("deflection_m", initial=0.0, scale=2e-5, tolerance=1e-8)

    def terms(self, now: Conditions) -> Iterator[Force]:
        velocity_m_s, z = self.sliding_velocity_m_s(now), now[self.name].deflection_m
        plain_n = self.dry_force_n(now) * ca.tanh(self.steepness_s_m * velocity_m_s)
        stiffness_n_m = self._static_force_n(now) / self.breakaway_deflection_m
        bristle_n = stiffness_n_m * (z + self.bristle_time_s * self._rate(now))
        dry_n = plain_n + self.presliding_share * (bristle_n - plain_n)
        yield from self.opposing(dry_n + self.viscous_force_n(velocity_m_s))

    def rates(self, now: Conditions, received: Received) -> dict[str, Expression]:
        return {"deflection_m": self._rate(now)}

    def _static_force_n(self, now: Conditions) -> Expression:
        return self.coulomb_force_n + self.stiction_excess_n + self.pressed_force_n(now)

    def _rate(self, now: Conditions) -> Expression:
        velocity_m_s, z = self.sliding_velocity_m_s(now), now[self.name].deflection_m
        static_n = self._static_force_n(now) + NEGLIGIBLE_FORCE_N
        relative = (self.dry_force_n(now) + NEGLIGIBLE_FORCE_N) / static_n
        limit_m = self.breakaway_deflection_m * ca.fmax(relative, LEAST_DEFLECTION)
        plastic = self.plasticity(z, velocity_m_s, limit_m) * ca.fabs(velocity_m_s) * z / limit_m
        return velocity_m_s - plastic
