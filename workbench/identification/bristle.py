"""S002-6: the bristle by rule, from the forces that a friction map gives.

F_c / 50 um <= sigma_0 <= F_c / 1 um, and sigma_1 <= sigma_2 / (F_s / F_c - 1).  The rig keeps its
own deflection inside these bounds; beyond them it gets sigma_0 = F_c / 25.3 um, the paper's choice.
It keeps the bristle's own time tau, so that sigma_1 = sigma_0 tau goes with that stiffness, unless
sigma_1 is too large: then it gets the largest.  The paper's own, 50 N s/m, is below that.

Source: paper 002 Eqs. 20, 21 (sigma_1 in N s/m, E002-13); physics.md 2.4 and 5, row S002-6.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

import numpy as np

from workbench.effects import BristleFriction, StribeckFriction
from workbench.identification.estimate import Estimate

DEFLECTION_M = (1e-6, 50e-6, 25.3e-6)  # F_c over stiffness: least, largest, the paper's


def _bounds(estimates: Sequence[Estimate]) -> tuple[float, float, float]:
    """Mean Coulomb friction, mean static friction, and the largest damping of the bristle."""
    value = {each.name: each.value for each in estimates}
    ways = ("forward", "backward")
    coulomb, static = (
        float(np.mean([value[f"{kind}_{way}_n"] for way in ways])) for kind in ("coulomb", "static")
    )
    damping = min(
        value[f"viscous_{w}_n_s_m"]
        / max(value[f"static_{w}_n"] / value[f"coulomb_{w}_n"] - 1.0, 1e-6)
        for w in ways
    )
    return coulomb, static, damping


def rule(estimates: Sequence[Estimate]) -> list[Estimate]:
    """The range of the bristle's stiffness and the bound of its damping."""
    coulomb, _, damping = _bounds(estimates)
    return [
        Estimate("least_bristle_stiffness_n_m", coulomb / DEFLECTION_M[1], nan),
        Estimate("largest_bristle_stiffness_n_m", coulomb / DEFLECTION_M[0], nan),
        Estimate("largest_bristle_damping_n_s_m", damping, nan),
    ]


def bristle(effect: StribeckFriction, estimates: Sequence[Estimate]) -> list[Estimate]:
    """Break-away deflection and time of the bristle that keep the rule."""
    if not isinstance(effect, BristleFriction):
        return []
    coulomb, static, largest = _bounds(estimates)
    own = static / effect.breakaway_deflection_m
    inside = coulomb / DEFLECTION_M[1] <= own <= coulomb / DEFLECTION_M[0]
    stiffness = own if inside else coulomb / DEFLECTION_M[2]
    damping = min(stiffness * effect.bristle_time_s, largest)
    return [
        Estimate(f"{effect.name}.breakaway_deflection_m", static / stiffness, nan),
        Estimate(f"{effect.name}.bristle_time_s", damping / stiffness, nan),
    ]
