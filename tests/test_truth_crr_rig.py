"""The truth of the crr_rig agrees with physics.md and, stripped of its differences, with the model.

That it imports nothing of ours is tested for the whole folder in ``test_truth.py``.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from studies.hidden_benches import BENCHES, CRR_RIG
from studies.truth import crr_rig as c
from studies.truth import crr_rig_draw as draws
from studies.truth import crr_rig_flow as flow
from studies.truth.batch import spread, stack
from studies.truth.cases import read_cases
from studies.truth.crr_rig_integrate import open_loop
from studies.truth.crr_rig_manoeuvre import training_reference, validation_reference
from workbench.plants.crr_rig import crr_rig
from workbench.recording import Recording
from workbench.rig import default_rig
from workbench.simulation import simulate

DT = 1e-3
NOMINAL = c.CrrRig()
SHUT = replace(NOMINAL, flow_area=0.0)
TIME_S = DT * np.arange(400)
FINE = 100  # substeps: the error at break-away is first order in the step
STEPS_V = 5.25 + 1.5 * np.sin(2 * np.pi * 4.0 * TIME_S) + np.where(TIME_S > 0.3, 1.5, 0.0)
DROOP_PA_S_KG, TANK_M3 = 3e7, 1e-3
# The truth with each law alone, and the same in the model's names.
SAME = {
    "bare": (NOMINAL, {}),
    "leaks": (
        replace(NOMINAL, cap_leak_m2=1e-7, piston_leak_m2=2e-7, constant_force_n=10.0),
        {
            "chamber_leak@cap.area_m2": 1e-7,
            "piston_leak.area_m2": 2e-7,
            "constant_force.force_n": 10.0,
        },
    ),
    "valve": (
        replace(NOMINAL, dead_zone_half_width_v=0.2, valve_lag_s=8e-3),
        {"valve_dead_zone.half_width_v": 0.2, "valve_lag.time_constant_s": 8e-3},
    ),
    "droop": (
        replace(NOMINAL, supply_resistance_pa_s_kg=DROOP_PA_S_KG, tank_per_m3=1 / TANK_M3),
        {
            "supply_droop.resistance_pa_s_kg": DROOP_PA_S_KG,
            "supply_droop.refill_time_s": DROOP_PA_S_KG * TANK_M3 / (1.4 * 287.0 * 293.15),
        },
    ),
    "friction": (
        replace(NOMINAL, coulomb_n=20.0, stiction_excess_n=15.0),
        {"friction.coulomb_force_n": 20.0, "friction.stiction_excess_n": 15.0},
    ),
}


@cache
def true_runs():
    """All of them in one batch, which takes no longer than one."""
    batch = stack([rig for rig, _ in SAME.values()])
    out = open_loop(batch, STEPS_V, c.at_rest(batch, c.STROKE_M / 2), FINE)
    return {name: {k: v[:, i] for k, v in out.items()} for i, name in enumerate(SAME)}


def run(rig: c.CrrRig, samples: int, pressure_pa=c.REST_PA) -> dict[str, np.ndarray]:
    """Response to a centred command."""
    batch = stack([rig])
    start = c.at_rest(batch, c.STROKE_M / 2, pressure_pa)
    out = open_loop(batch, np.full(samples, 5.25), start)
    return {name: values[:, 0] for name, values in out.items()}


def masses(out: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    y = out["true_position_m"]
    volumes = (
        NOMINAL.cap_dead_volume_m3 + c.CAP_AREA_M2 * y,
        NOMINAL.rod_dead_volume_m3 + c.AREAS_M2[1] * (c.STROKE_M - y),
    )
    return tuple(
        out[f"true_{side}_pressure_pa"] * volume / out[f"{side}_temperature_k"]
        for side, volume in zip(("cap", "rod"), volumes, strict=True)
    )


@pytest.mark.parametrize("name", SAME)
def test_without_its_differences_it_agrees_with_the_model(name):
    """Within the noise of a reading, 0.05 mm and 500 Pa.

    Most of it is the dead zone's: the truth keeps 0 V where it was, the model does so for a valve
    centred at 5 V, 0.2 % beside it.  Without the zone it is half of that.
    """
    plant = crr_rig().with_values(SAME[name][1]).lean()
    modelled = simulate(plant, Recording("steps", DT, {"valve.command_v": STEPS_V}))
    truth = true_runs()[name]

    assert np.ptp(truth["position_m"]) > 5e-3 and np.ptp(truth["cap_pressure_pa"]) > 5e4
    np.testing.assert_allclose(truth["position_m"], modelled["rod.position_m"], atol=50e-6)
    for ours, theirs in (("cap_pressure_pa", "cap"), ("rod_pressure_pa", "rod_side")):
        np.testing.assert_allclose(truth[ours], modelled[f"{theirs}.pressure_pa"], atol=500.0)


def test_the_valve_has_the_input_pressures_and_areas_of_physics_10():
    du = np.array([-4.75, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 4.75])
    share, area = flow.openings(spread(NOMINAL, len(du)), 5.25 + du[None])
    inlet = 1.013e5 + share[0, 0] * (6.5e5 - 1.013e5)

    assert inlet[[1, 3, 4, 5, 7]] == pytest.approx([102323, 161461, 375650, 589839, 648977], abs=1)
    known_mm2 = [1.7279, 0.1625, 0.0364, 0.1832, 1.9478]
    assert 1e6 * area[0, 0][[0, 2, 4, 6, 8]] == pytest.approx(known_mm2, abs=1e-4)
    assert share[0, 1] == pytest.approx(share[0, 0][::-1])  # the rod side is driven the other way


def test_the_nozzle_has_the_numbers_of_physics_10():
    up_pa, down_pa = 7e5, np.array([1e5, 5e5, 6e5, 6.9e5, 6.9995e5])
    mass_flow = 1e-6 * up_pa / np.sqrt(293.15) * flow.nozzle(down_pa / up_pa)

    known = [1.652466e-3, 1.520094e-3, 1.187179e-3, 4.047890e-4, 7.7049e-6]
    assert mass_flow == pytest.approx(known, rel=1e-5)


def test_a_dead_zone_opens_nothing_and_full_command_is_full_opening():
    wide = spread(replace(NOMINAL, dead_zone_half_width_v=0.3), 5)

    assert flow.opening_v(wide, np.array([0.0, 4.96, 5.25, 5.54, 10.0])) == pytest.approx(
        [-5.25, 0.0, 0.0, 0.0, 4.75]
    )


def test_closed_chambers_keep_their_mass_and_their_isentropes():
    out = run(replace(SHUT, constant_force_n=60.0, moving_mass_kg=10.0), 300)

    assert np.ptp(out["true_position_m"]) > 5e-3
    for side, m in zip(("cap", "rod"), masses(out), strict=True):
        isentrope = out[f"true_{side}_pressure_pa"] ** 0.4 / out[f"{side}_temperature_k"] ** 1.4
        assert np.ptp(m) < 1e-10 * m[0]
        assert np.ptp(isentrope) < 2e-4 * isentrope[0]


def test_a_piston_leak_moves_gas_and_loses_none():
    out = run(replace(SHUT, piston_leak_m2=2e-6), 200, np.array([[5e5], [3e5]]))
    cap, rod = masses(out)

    assert cap[-1] < 0.97 * cap[0]
    np.testing.assert_allclose(cap + rod, cap[0] + rod[0], rtol=1e-10)


def test_a_warm_wall_cools_the_gas_and_gets_its_heat():
    batch = stack([replace(SHUT, heat_transfer_w_m2_k=50.0, wall_k_per_j=1.0)])
    start = c.at_rest(batch, c.STROKE_M / 2)
    hot = replace(start, temperature_k=start.temperature_k + 60.0)
    cap_k = open_loop(batch, np.full(500, 5.25), hot)["cap_temperature_k"][:, 0]

    assert cap_k[-1] < cap_k[0] - 3.0


@pytest.mark.parametrize("name", draws.EFFECTS)
def test_every_effect_is_absent_at_its_null_and_drawn_in_its_range(name):
    case = draws.draw(name, 3)
    off, on = draws.rig_of(case, "hidden"), draws.rig_of(case)

    assert off != on
    assert 0.10 <= abs(case.size) / draws.EFFECTS[name].typical <= 0.60
    assert case == draws.draw(name, 3) != draws.draw(name, 4)
    if name == "supply_droop":
        assert off.tank_per_m3 == 0.0
    else:
        assert all(getattr(off, field) == 0.0 for field in draws.EFFECTS[name].fields)


def test_an_unknown_effect_is_named_in_the_message():
    with pytest.raises(KeyError, match="gremlin is not a hidden effect"):
        draws.draw("gremlin", 1)


@pytest.mark.parametrize("seed", range(10))
def test_references_cross_most_of_the_stroke_and_rest(seed):
    for reference in (training_reference, validation_reference):
        r = reference(np.random.default_rng(seed))
        speed = np.abs(np.gradient(r, DT))

        assert len(r) == 10_000 and 0.010 < r.min() < 0.055 and 0.110 < r.max() < 0.142
        assert 0.2 < speed.max() < 1.0 and (speed < 1e-9).mean() > 0.1


@pytest.mark.parametrize("bench", BENCHES.values(), ids=BENCHES)
def test_a_bench_speaks_the_language_of_its_plant(bench):
    plant = default_rig(bench.plant).plant
    signals = {s.name for s in (*plant.commands, *plant.optional_inputs)} | set(plant.measured)
    causes = {name.partition("@")[0] for name in plant.candidates}

    told = {public for public, _ in bench.channels.values()}
    assert set(plant.measured) <= told <= signals
    assert {s.name for s in plant.commands} <= told
    assert set(bench.always_there) <= causes
    for hidden in bench.truth.hidden:
        case = bench.truth.draw(hidden, 1)
        assert bench.public_name(case) in plant.candidates
        assert bench.user_rig(case).removed == (bench.public_name(case),)


def test_the_stored_cases_hide_every_effect_twice():
    stored = read_cases(CRR_RIG.truth.stored)
    names = (*draws.HIDDEN, *draws.OUTSIDE_CATALOGUE, None)

    assert set(stored) == {(name, seed) for name in names for seed in (1, 2)}
    assert all(case.plant == "crr_rig" for case in stored.values())
