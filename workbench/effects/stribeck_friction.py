"""Dry and viscous friction of the seals as a function of speed, without a state of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca

from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Effect,
    Expression,
    Force,
    form,
    strength,
)


@dataclass(frozen=True, kw_only=True)
class StribeckFriction(Effect):
    """Coulomb, Stribeck and viscous friction, which may vary with direction, place and pressure.

    F   = g tanh(k v) + s2 (v + e |v|)
    g   = (1 + e_x cos(2 pi x / lambda + phi)) (F_C + F_ex exp(-(|v|/v_s)^i)) + c_p |dp|

    Each coefficient counts times 1 + w e for v >= 0 and 1 - w e below, with e ``asymmetry`` and w
    its weight.  F_ex = F_S - F_C is the excess of static friction; i is 2 in paper 002 and 5 in
    paper 000, where the tanh keeps the peak below F_S (erratum E000-10).  dp is the pressure
    between the two ``chambers``, or of the one against ambient.  v is the velocity of the body,
    relative to the body ``against`` where it rubs on one: that one gets the opposite force.

    Source: paper 000 Eq. 11 (F3 of physics.md 1.3); asymmetry by paper 002 Table 5 (erratum
    E002-6: magnitudes for v < 0); place and pressure by physics.md section 6.  Deviations from
    there: the cosine has a phase, since no seal knows where the axis begins; pressure adds to g
    instead of multiplying it, so that seals pressed on by the pressure alone have friction too.
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
            needs="coulomb_force_n",
            balance=Balance.MOMENTUM,
            drivers=("speed near zero",),
            kinked=True,
            shapes={"stribeck_velocity_m_s": (0.0025, 0.008, 0.024)},  # 000, between, 002
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
            name="friction_asymmetry",
            strength="asymmetry",
            balance=Balance.MOMENTUM,
            drivers=("speed", "direction"),
            shown_by="equal strokes in both directions at several speeds",
            source="paper 002 table 5",
        ),
        Cause(
            name="friction_position",
            strength="position_share",
            forms=("wavelength_m", "phase_rad"),
            balance=Balance.MOMENTUM,
            drivers=("position", "sign of the velocity"),
            kinked=True,
            shapes={"wavelength_m": (0.04, 0.08, 0.16), "phase_rad": (0.0, 1.5708)},
            shown_by="slow strokes over the whole length, both directions",
            source="observed in paper 002; physics.md section 6 (position_dependent)",
        ),
        Cause(
            name="friction_pressure",
            strength="pressure_factor_n_pa",
            balance=Balance.MOMENTUM,
            drivers=("pressure difference", "sign of the velocity"),
            kinked=True,
            shown_by="slow strokes at three pressure levels",
            source="physics.md section 6 (pressure_dependent); Tran and Yanada 2013",
        ),
    )

    body: str
    chambers: tuple[str, ...] = ()
    against: str | None = None
    stribeck_exponent: int = 2

    coulomb_force_n: Expression = strength(typical=60.0, upper=1e3)
    stiction_excess_n: Expression = strength(typical=60.0, upper=1e3)
    viscous_n_s_m: Expression = strength(typical=60.0, upper=1e4)
    asymmetry: Expression = strength(typical=0.3, lower=-0.9, upper=0.9)
    position_share: Expression = strength(typical=0.3, lower=-0.9, upper=0.9, deviation=0.05)
    pressure_factor_n_pa: Expression = strength(typical=2e-5, upper=1e-2)

    stribeck_velocity_m_s: Expression = form(0.024, lower=1e-3, upper=1.0)
    steepness_s_m: Expression = form(500.0, lower=1.0, upper=1e5)
    coulomb_weight: Expression = form(1.0, upper=5.0)
    excess_weight: Expression = form(1.0, upper=5.0)
    wavelength_m: Expression = form(0.08, lower=0.01, upper=0.5, relative_deviation=0.2)
    phase_rad: Expression = form(0.0, lower=-10.0, upper=10.0, deviation=1.0)

    def terms(self, now: Conditions) -> Iterator[Force]:
        velocity_m_s = self.sliding_velocity_m_s(now)
        dry_n = self.dry_force_n(now) * ca.tanh(self.steepness_s_m * velocity_m_s)
        yield from self.opposing(dry_n + self.viscous_force_n(velocity_m_s))

    def opposing(self, friction_n: Expression) -> Iterator[Force]:
        """Friction on the body, and its reaction on what the body rubs on."""
        yield Force(self.body, -friction_n)
        if self.against:
            yield Force(self.against, friction_n)

    def sliding_velocity_m_s(self, now: Conditions) -> Expression:
        """Velocity of the body past what it rubs on."""
        velocity_m_s = now[self.body].velocity_m_s
        return velocity_m_s - now[self.against].velocity_m_s if self.against else velocity_m_s

    def dry_force_n(self, now: Conditions) -> Expression:
        """g: the dry force of steady sliding, positive."""
        velocity_m_s = self.sliding_velocity_m_s(now)
        side = ca.if_else(velocity_m_s >= 0, self.asymmetry, -self.asymmetry)
        relative = ca.fabs(velocity_m_s) / self.stribeck_velocity_m_s
        peak = ca.exp(-ca.fmin(relative**self.stribeck_exponent, 50.0))
        excess_n = self.stiction_excess_n * (1.0 + self.excess_weight * side) * peak
        plain_n = self.coulomb_force_n * (1.0 + self.coulomb_weight * side) + excess_n
        return self._along(now) * plain_n + self.pressed_force_n(now)

    def steady_force_n(self, now: Conditions) -> Expression:
        """What any of these laws comes to in steady sliding: F = sign(v) g + s2 (v + e |v|).

        Source: paper 002 Eqs. 12 to 14 (F4 of physics.md 1.3).
        """
        velocity_m_s = self.sliding_velocity_m_s(now)
        dry_n = ca.sign(velocity_m_s) * self.dry_force_n(now)
        return dry_n + self.viscous_force_n(velocity_m_s)

    def viscous_force_n(self, velocity_m_s: Expression) -> Expression:
        """Viscous part, asymmetric too: s2 (v + e |v|)."""
        return self.viscous_n_s_m * (velocity_m_s + self.asymmetry * ca.fabs(velocity_m_s))

    def _along(self, now: Conditions) -> Expression:
        """Share of the dry friction that acts at this place."""
        angle = 2.0 * ca.pi * now[self.body].position_m / self.wavelength_m + self.phase_rad
        return 1.0 + self.position_share * ca.cos(angle)

    def pressed_force_n(self, now: Conditions) -> Expression:
        """Part of the dry friction by the pressure that presses the seals on, positive."""
        if not self.chambers:
            return 0.0
        first, second = (*self.chambers, "atmosphere")[:2]
        across_pa = now[first].pressure_pa - now[second].pressure_pa
        return self.pressure_factor_n_pa * ca.fabs(across_pa)
