"""Gas laws against the numbers of physics.md section 10."""

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq

from workbench.air import (
    CRITICAL_RATIO,
    LAMINAR_RATIO,
    IsoLaw,
    NozzleLaw,
    Path,
    choked_constant,
    iso_function,
    nozzle_function,
)

AIR_J_KG_K = 287.0
ROOM_K = 293.15


def flow_kg_s(above_pa, below_pa, area_m2=1e-6, law=None, above_k=ROOM_K, below_k=ROOM_K):
    path = Path(above_pa, above_k, below_pa, below_k, AIR_J_KG_K)
    return float(path.flow_kg_s(area_m2, law or NozzleLaw()))


@pytest.mark.parametrize(
    ("below_pa", "expected_kg_s"),
    [
        (1e5, 1.652466e-3),
        (5e5, 1.520094e-3),
        (6e5, 1.187179e-3),
        (6.9e5, 4.047890e-4),
        (6.9995e5, 7.7049e-6),
    ],
)
def test_a_nozzle_of_one_square_millimetre_passes_the_known_flow(below_pa, expected_kg_s):
    assert flow_kg_s(7e5, below_pa) == pytest.approx(expected_kg_s, rel=1e-5)


@pytest.mark.parametrize(
    ("b", "a", "m", "ratio", "expected"),
    [
        (0.3, 1.0, 0.5, 0.5, 0.958315),
        (0.3, 1.0, 0.5, 0.8, 0.699854),
        (0.3, 1.0, 0.5, 0.95, 0.371154),
        (0.35, 0.95, 0.55, 0.5, 0.965126),
        (0.35, 0.95, 0.55, 0.8, 0.634655),
        (0.35, 0.95, 0.55, 0.95, 0.0),
        (0.35, 0.95, 0.55, 1.0, 0.0),
    ],
)
def test_the_iso_law_gives_the_known_shares(b, a, m, ratio, expected):
    assert float(iso_function(ratio, b, a, m)) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("ratio", "expected"), [(0.6, -0.0129747), (0.8, -0.0602223), (0.95, -0.171317)]
)
def test_the_slope_of_the_nozzle_law_by_automatic_differentiation(ratio, expected):
    r = ca.SX.sym("r")
    psi = choked_constant(AIR_J_KG_K) * nozzle_function(r)
    slope = ca.Function("slope", [r], [ca.gradient(psi, r)])

    assert float(slope(ratio)) == pytest.approx(expected, rel=1e-5)


def test_two_equal_leaks_in_series_rest_at_0_807458_of_the_supply():
    """The equilibrium pressure that paper 002 prints, 5.65 bar of 7 (physics.md 1.1 d)."""
    rest_pa = brentq(lambda p: flow_kg_s(7e5, p) - flow_kg_s(p, 1e5), 2e5, 6.9e5, xtol=1e-3)

    assert rest_pa / 7e5 == pytest.approx(0.807458, abs=1e-6)


def test_the_choked_constant_is_that_of_the_papers():
    assert choked_constant(287.0) == pytest.approx(0.0404184, rel=1e-5)
    assert choked_constant(288.0) == pytest.approx(0.0403482, rel=1e-5)
    assert pytest.approx(0.528282, abs=1e-6) == CRITICAL_RATIO


@pytest.mark.parametrize("law", [NozzleLaw(), IsoLaw(), IsoLaw(0.35, 0.995, 0.52)])
def test_flow_never_rises_with_the_ratio_and_has_no_jump(law):
    r = ca.SX.sym("r")
    share = ca.Function("share", [r], [law(r)])(np.linspace(0.0, 1.0, 100_001)[None]).full().ravel()
    steps = np.diff(share)

    assert share[0] == pytest.approx(1.0, abs=1e-9)
    assert share[-1] == 0.0
    assert (steps <= 1e-12).all()
    assert steps.min() > -2e-3


@pytest.mark.parametrize("law", [NozzleLaw(), IsoLaw(0.35, 0.995, 0.52)])
def test_flow_turns_round_with_the_pressures(law):
    """Direction follows the pressures, not the command (erratum E000-4)."""
    for low_pa, high_pa in [(1e5, 7e5), (4e5, 5e5), (4.9999e5, 5e5)]:
        assert flow_kg_s(low_pa, high_pa, law=law) == -flow_kg_s(high_pa, low_pa, law=law)


def test_the_gas_that_flows_has_the_temperature_of_its_source():
    assert Path(2e5, 300.0, 1e5, 400.0).temperature_k == pytest.approx(300.0)
    assert Path(1e5, 300.0, 2e5, 400.0).temperature_k == pytest.approx(400.0)


@pytest.mark.parametrize("law", [NozzleLaw(), IsoLaw(0.35, 0.995, 0.52)])
def test_the_slope_at_equal_pressures_is_finite_and_the_same_from_both_sides(law):
    """The laminar zone: without it the slope is infinite (physics.md 1.1 c)."""
    p = ca.SX.sym("p")
    flow = Path(5e5, ROOM_K, p, ROOM_K, AIR_J_KG_K).flow_kg_s(1e-6, law)
    slope = ca.Function("slope", [p], [ca.gradient(flow, p)])

    assert np.isfinite(float(slope(5e5)))
    assert float(slope(5e5 - 1e-3)) == pytest.approx(float(slope(5e5 + 1e-3)), rel=1e-5)
    if isinstance(law, NozzleLaw):
        assert float(slope(5e5)) < 0.0


def test_the_straight_line_meets_the_nozzle_law_where_it_begins():
    below, above = (float(nozzle_function(LAMINAR_RATIO + e)) for e in (-1e-12, 1e-12))

    assert below == pytest.approx(above, rel=1e-8)


@pytest.mark.parametrize("kappa", [1.1, 1.3, 1.66])
def test_a_nozzle_of_another_gas_has_the_textbook_flow(kappa):
    """C_sub r^(1/k) sqrt(1 - r^((k-1)/k)) of physics.md 1.1, and choked where its slope is zero."""
    subsonic = np.sqrt(2.0 * kappa / (AIR_J_KG_K * (kappa - 1.0)))
    exponent = (kappa - 1.0) / kappa
    ratios = np.array([0.7, 0.9, 0.99])
    expected = subsonic * ratios ** (1.0 / kappa) * np.sqrt(1.0 - ratios**exponent)

    choked = float(choked_constant(AIR_J_KG_K, kappa))
    found = [choked * float(nozzle_function(r, kappa)) for r in ratios]

    assert found == pytest.approx(expected)
    every = np.linspace(0.3, 0.7, 4001)
    flows = subsonic * every ** (1.0 / kappa) * np.sqrt(1.0 - every**exponent)
    assert choked == pytest.approx(flows.max(), rel=1e-6)
