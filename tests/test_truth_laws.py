"""Laws of the true drive that no catalogue has, each against its formula; and weak recordings."""

from dataclasses import replace

import numpy as np
import pytest

from studies.truth import drive as d
from studies.truth import laws, rule, weak
from studies.truth.batch import stack
from studies.truth.draw import EFFECTS, OUTSIDE_CATALOGUE
from studies.truth.integrate import open_loop
from studies.truth.restriction import nozzle

# No valve, no leak, no friction to speak of and no heat: what is left is the law.
BARE = d.Drive(
    flow_area=0.0, spool_leak_m2=0.0, heat_transfer_w_m2_k=0.0,
    coulomb_n=0.0, stiction_excess_n=0.0, viscous_n_s_m=0.0,
)  # fmt: skip
HEAVY_KG = 1e4  # moved by nothing
SAMPLE_S, SAMPLES = 1e-3, 4
PURGE_KG_S, SLIDING_M2_S_M = 1e-4, 5e-7


SPOT = dict(spot_m=0.12, spot_width_m=0.02)
FORCES = (  # place, speed, law, force
    (0.145, 0.5, dict(quadratic_drag_n_s2_m2=400.0), -100.0),
    (0.145, -0.5, dict(quadratic_drag_n_s2_m2=400.0), 100.0),
    (0.0725, 0.0, dict(sagging_cable_n=60.0), 15.0),
    (0.145, 0.0, dict(sagging_cable_n=60.0), 0.0),
    (0.120, 0.4, dict(spot_drag_n_s_m=200.0, **SPOT), -80.0),
    (0.140, 0.4, dict(spot_drag_n_s_m=200.0, **SPOT), -80.0 / np.e),
    (0.140, 0.0, dict(catch_n=60.0, **SPOT), -60.0),
    (0.080, 0.0, dict(catch_n=60.0, **SPOT), 120.0 * np.exp(-1.5)),
)
SPEEDS_M_S = (0.0, 0.2, -0.4)
MASSES = (
    dict(purge_kg_s=PURGE_KG_S),
    *(dict(sliding_leak_m2_s_m=SLIDING_M2_S_M) for _ in SPEEDS_M_S),
)


@pytest.fixture(scope="module")
def pushed():
    """Drives with both chambers at 5 bar from a place and a speed, all in one batch."""
    laws_of = [law for *_, law, _ in FORCES] + [{} for _ in FORCES] + [*MASSES]
    places = 2 * [place - speed * SAMPLE_S / 2 for place, speed, *_ in FORCES]
    places += [0.145] * len(MASSES)
    speeds = 2 * [speed for _, speed, *_ in FORCES] + [0.0, *SPEEDS_M_S]
    batch = stack([replace(BARE, moving_mass_kg=HEAVY_KG, **law) for law in laws_of])
    start = d.at_rest(batch, np.array(places), 5e5)
    out = open_loop(
        batch, np.full(SAMPLES + 1, 4.95), replace(start, velocity_m_s=np.array(speeds))
    )
    return {name: values.T for name, values in out.items()}


@pytest.mark.parametrize("k", range(len(FORCES)))
def test_a_law_of_force_is_its_formula(pushed, k):
    speed = pushed["velocity_m_s"]
    change = (speed[k] - speed[len(FORCES) + k])[1]  # with the law and without, over one sample

    assert HEAVY_KG * change / SAMPLE_S == pytest.approx(FORCES[k][-1], rel=0.01, abs=0.3)


def masses_kg(pushed, k):
    """Gas in both chambers, of the column behind those of the forces."""
    out = {name: values[2 * len(FORCES) + k] for name, values in pushed.items()}
    nominal, y = d.Drive(), out["position_m"]
    found = []
    for side, length in (("a", y), ("b", d.STROKE_M - y)):
        volume = getattr(nominal, f"dead_volume_{side}_m3") + d.PISTON_AREA_M2 * length
        warm = d.GAS_CONSTANT_J_KG_K * out[f"temperature_{side}_k"]
        found.append(out[f"true_pressure_{side}_pa"] * volume / warm)
    return found


def test_a_purge_fills_chamber_b_alone(pushed):
    a, b = masses_kg(pushed, 0)

    assert b[-1] - b[0] == pytest.approx(SAMPLES * SAMPLE_S * PURGE_KG_S, rel=1e-6)
    assert a[-1] == pytest.approx(a[0], rel=1e-9)


@pytest.mark.parametrize("k", range(len(SPEEDS_M_S)))
def test_a_sliding_leak_empties_chamber_a_with_the_speed(pushed, k):
    a, b = masses_kg(pushed, 1 + k)
    choked = nozzle(np.array(0.2)) * 5e5 / np.sqrt(293.15)  # 1 bar outside, 5 bar inside
    lost = SAMPLES * SAMPLE_S * SLIDING_M2_S_M * abs(SPEEDS_M_S[k]) * choked

    assert a[0] - a[-1] == pytest.approx(lost, rel=0.02, abs=1e-12)
    assert b[-1] == pytest.approx(b[0], rel=1e-9)


def test_no_law_acts_at_its_null():
    place, speed = np.linspace(0.0, d.STROKE_M, 7), np.linspace(0.0, 1.0, 7)

    assert not np.any(laws.force_n(d.Drive(), place))
    assert not np.any(laws.drag_n_s_m(d.Drive(), place, speed))
    fields = [field for name in OUTSIDE_CATALOGUE for field in EFFECTS[name].fields]
    assert all(getattr(d.Drive(), field) == 0.0 for field in fields)


def test_weak_recordings_are_of_stored_cases_and_of_two_manoeuvres():
    cases = weak.stored_weak()

    assert len(cases) == 6
    assert all(len(set(weak.WEAK[case.hidden])) == 2 for case in cases)


@pytest.mark.slow
def test_in_weak_recordings_the_hidden_effect_is_below_the_noise():
    cases = weak.stored_weak()
    for found in weak.misfits(cases):
        assert max(each.hidden for each in found) < 0.1 * rule.VISIBLE
    for train, held_out in weak.record_weak(cases):
        assert max(np.ptp(table["position_mm"]) for table in (train, held_out)) < 1.0
