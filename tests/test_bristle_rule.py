"""The bristle by rule S002-6, by hand from the forces of paper 002's Table 5."""

from dataclasses import replace
from math import nan

import pytest

from workbench.effects import BristleFriction, StribeckFriction
from workbench.identification.bristle import bristle, rule
from workbench.identification.estimate import Estimate

TABLE_5 = {  # sigma_2 in N s/m, F_s and F_c in N; magnitudes for v < 0 (E002-6)
    "viscous_forward_n_s_m": 46.01,
    "static_forward_n": 50.97,
    "coulomb_forward_n": 28.35,
    "viscous_backward_n_s_m": 42.18,
    "static_backward_n": 46.15,
    "coulomb_backward_n": 26.22,
}
ESTIMATES = [Estimate(name, value, nan) for name, value in TABLE_5.items()]
COULOMB_N, STATIC_N = 27.285, 48.56  # means of both directions
LARGEST_N_S_M = 55.49  # 42.18 / (46.15 / 26.22 - 1), less than 57.66 of the other direction
PAPER_N_M = COULOMB_N / 25.3e-6  # 1.078e6; the paper has 1.12e6 of F_c = 28.35 N
FRICTION = BristleFriction(name="seal", body="slide", coulomb_force_n=27.0, viscous_n_s_m=44.0)


def of_rig(deflection_m, time_s):
    """Stiffness in N/m and damping in N s/m that the rule gives a rig with this bristle."""
    rig = replace(FRICTION, breakaway_deflection_m=deflection_m, bristle_time_s=time_s)
    deflection, time = bristle(rig, ESTIMATES)

    assert deflection.name == "seal.breakaway_deflection_m" and time.name == "seal.bristle_time_s"
    stiffness = STATIC_N / deflection.value
    return stiffness, time.value * stiffness


def test_the_range_of_the_stiffness_and_the_largest_damping_are_those_of_table_5():
    found = {each.name: each.value for each in rule(ESTIMATES)}

    assert found == {
        "least_bristle_stiffness_n_m": pytest.approx(COULOMB_N / 50e-6),
        "largest_bristle_stiffness_n_m": pytest.approx(COULOMB_N / 1e-6),
        "largest_bristle_damping_n_s_m": pytest.approx(LARGEST_N_S_M, abs=0.01),
    }


@pytest.mark.parametrize("coulomb_m", [49.9e-6, 25e-6, 1.01e-6])
def test_inside_the_bounds_a_rig_keeps_its_bristle(coulomb_m):
    """The bounds are of F_c over stiffness; what a rig holds is F_s over stiffness."""
    stiffness = COULOMB_N / coulomb_m
    own = of_rig(STATIC_N / stiffness, 50.0 / stiffness)

    assert own == (pytest.approx(stiffness), pytest.approx(50.0))


@pytest.mark.parametrize("coulomb_m", [50.1e-6, 500e-6, 0.99e-6], ids=["soft", "softer", "stiff"])
def test_beyond_them_it_gets_the_stiffness_of_the_paper_and_keeps_its_time(coulomb_m):
    """45 us with F_c / 25.3 um are 48.5 N s/m: with its own stiffness the softest had 2.5 N s/m."""
    found = of_rig(STATIC_N / COULOMB_N * coulomb_m, 45e-6)

    assert found == (pytest.approx(PAPER_N_M), pytest.approx(48.53, abs=0.01))


@pytest.mark.parametrize("coulomb_m", [500e-6, 25.3e-6, 0.6e-6], ids=["soft", "inside", "stiff"])
def test_no_damping_is_larger_than_the_law_stays_passive_with(coulomb_m):
    stiffness, damping = of_rig(STATIC_N / COULOMB_N * coulomb_m, 1e-3)

    assert stiffness == pytest.approx(PAPER_N_M)
    assert damping == pytest.approx(LARGEST_N_S_M, abs=0.01)


def test_friction_without_a_bristle_has_none():
    plain = StribeckFriction(name="seal", body="slide", coulomb_force_n=27.0, viscous_n_s_m=44.0)

    assert bristle(plain, ESTIMATES) == []
