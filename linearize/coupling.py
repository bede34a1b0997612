"""Parts that move rigidly with a body: which they are, and what remains of their equations.

A contact of 2e7 N/m or a joint of 5e6 N/m makes poles that no design wants.  Without its give the
two sides move as one, and the forces between them do no work (d'Alembert): nothing is written anew,
the rates of the one model are added up.

Source: physics.md 4.2 (masses below and above Neutral, E003-8, E003-9) and 2.3 (mass matrix).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import casadi as ca

from workbench.effect import Conditions, Expression
from workbench.floating_piston import FloatingPiston
from workbench.lever import Lever
from workbench.model import Model
from workbench.plant import Plant


@dataclass(frozen=True)
class RigidCoupling:
    """A part whose place is a ratio times that of a body.

    x_s = r x,   v_s = r v,   (m + sum r^2 m_s) dv/dt = m a + sum r m_s a_s

    with a and a_s the rates of the two by themselves; forces between them cancel.  The ratio may
    jump with the place of the body, as that of a piston which is pushed on one side only.

    body        the part that leads
    position, velocity    states of the part that follows
    inertia     mass or moment of inertia of it, as quantity of the plant
    ratio       r, from the plant at one instant
    """

    body: str
    position: str
    velocity: str
    inertia: str
    ratio: Callable[[Conditions], Expression]

    def stand_ins(self, now: Conditions) -> dict[str, Expression]:
        """What takes the place of the two states."""
        lead, ratio = now[self.body], self.ratio(now)
        return {self.position: ratio * lead.position_m, self.velocity: ratio * lead.velocity_m_s}


def couplings(plant: Plant) -> Iterator[RigidCoupling]:
    """A floating piston that moves with the body above zero, and levers on the tip of a body."""
    for part in plant.parts:
        if isinstance(part, FloatingPiston):
            yield RigidCoupling(
                part.pushed_by,
                f"{part.name}.position_m",
                f"{part.name}.velocity_m_s",
                f"{part.name}.moving_mass_kg",
                _pushed(part.pushed_by),
            )
        elif isinstance(part, Lever):
            yield RigidCoupling(
                part.tip_body,
                f"{part.name}.angle_rad",
                f"{part.name}.velocity_rad_s",
                f"{part.name}.inertia_kg_m2",
                _turned(part.name),
            )


def coupled_rates(model: Model, coupled: tuple[RigidCoupling, ...]) -> ca.SX:
    """dx/dt of the model with the acceleration of each leading body that of all it carries."""
    rates, now = ca.SX(model.rates), model.conditions
    for body in dict.fromkeys(each.body for each in coupled):
        row = model.states.index(f"{body}.velocity_m_s")
        mass_kg = now[body].moving_mass_kg
        force_n = mass_kg * model.rates[row]
        for each in coupled:
            if each.body == body:
                ratio, inertia = each.ratio(now), now.read(each.inertia)
                force_n += ratio * inertia * model.rates[model.states.index(each.velocity)]
                mass_kg += ratio**2 * inertia
        rates[row] = force_n / mass_kg
    return rates


def with_reactions(
    x: ca.SX, rates: ca.SX, rows: Mapping[str, tuple[int, int]], held: tuple[str, ...]
) -> ca.SX:
    """The rates, shape (n_x, 1), where what is held takes up all that would move it.

    With accelerations a = M^-1 tau, a held one is zero by a reaction on it, and the others feel
    that through the inertia that they share:

    a_k <- a_k - S_kh S_hh^-1 a_h,   S = da/dp,   p a pressure on each held body alone

    S is M^-1 but for the area and lever of each pressure, which cancel.  ``rows`` gives the row of
    each velocity and the column of its pressure.
    """
    if not held:
        return rates
    velocities = [row for row, _ in rows.values()]
    fixed, pushed = (list(row) for row in zip(*(rows[name] for name in held), strict=True))
    free = [row for row in velocities if row not in fixed]
    slopes = ca.jacobian(rates, x)
    reaction = ca.solve(slopes[fixed, pushed], rates[fixed])
    found = ca.SX(rates)
    found[free] -= slopes[free, pushed] @ reaction
    found[fixed] = 0.0
    return found


def _pushed(body: str) -> Callable[[Conditions], Expression]:
    return lambda now: ca.if_else(now[body].position_m > 0.0, 1.0, 0.0)


def _turned(lever: str) -> Callable[[Conditions], Expression]:
    return lambda now: 1.0 / now[lever].arm_m
