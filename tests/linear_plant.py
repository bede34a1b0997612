"""A plant that is linear: a mass on a spring and a damper under a forcing command."""

from dataclasses import dataclass

from workbench.effect import Effect, Force
from workbench.parts import Body
from workbench.plant import Plant, Signal

MASS_KG, STIFFNESS_N_M, DAMPING_N_S_M = 2.0, 50.0, 3.0


@dataclass(frozen=True, kw_only=True)
class Drive(Effect):
    """F = u - k x - c v."""

    def terms(self, now):
        cart = now["cart"]
        spring_n = STIFFNESS_N_M * cart.position_m + DAMPING_N_S_M * cart.velocity_m_s
        yield Force("cart", now["drive"].force_n - spring_n)


def cart():
    return Plant(
        name="cart",
        parts=(Body(name="cart", mass_kg=MASS_KG),),
        effects=(Drive(name="drive"),),
        commands=(Signal("drive.force_n", nominal=0.0, lower=-10.0, upper=10.0),),
        measured=("cart.position_m",),
    )
