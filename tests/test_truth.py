"""The truth simulator is independent, agrees with physics.md, conserves mass, repeats itself."""

import ast
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studies.truth import draw as draws
from studies.truth import drive as d
from studies.truth import misfit, restriction, rule
from studies.truth.batch import stack
from studies.truth.case import shrink
from studies.truth.integrate import open_loop
from studies.truth.manoeuvre import training_reference, validation_reference
from studies.truth.record import HIDDEN, draw, drive_of, record, run_cases, write_csv

FOLDER = Path(d.__file__).parent
NOMINAL = d.Drive()
SHUT = replace(NOMINAL, flow_area=0.0, spool_leak_m2=0.0, heat_transfer_w_m2_k=0.0)


def sine(samples: int) -> np.ndarray:
    return 4.95 + 0.8 * np.sin(np.pi * np.arange(samples) * 1e-3)


def run(drive: d.Drive, command, position_m=0.03, pressure_pa=5.65e5, **keywords):
    batch = stack([drive])
    return open_loop(batch, command, d.at_rest(batch, position_m, pressure_pa), **keywords)


def mass(drive: d.Drive, out: dict, chamber: str) -> np.ndarray:
    y = out["position_m"] if chamber == "a" else d.STROKE_M - out["position_m"]
    dead = drive.dead_volume_a_m3 if chamber == "a" else drive.dead_volume_b_m3
    volume = dead + d.PISTON_AREA_M2 * y
    return out[f"true_pressure_{chamber}_pa"] * volume / out[f"temperature_{chamber}_k"]


def test_it_imports_nothing_of_ours():
    allowed = set(sys.stdlib_module_names) | {"numpy"}
    for path in FOLDER.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = (
                [alias.name for alias in node.names]
                if isinstance(node, ast.Import)
                else [node.module or ""]
                if isinstance(node, ast.ImportFrom)
                else []
            )
            for name in names:
                ours = name == "studies.truth" or name.startswith("studies.truth.")
                assert ours or name.split(".")[0] in allowed, f"{path.name} imports {name}"
            assert not (isinstance(node, ast.ImportFrom) and node.level), "relative import"


def test_restrictions_give_the_numbers_of_physics_10():
    ratio = np.array([0.5, 0.8, 0.95])
    np.testing.assert_allclose(
        restriction.iso6358(ratio, 0.3, 1.0, 0.5), [0.958315, 0.699854, 0.371154], rtol=2e-6
    )
    np.testing.assert_allclose(
        restriction.iso6358(ratio, 0.35, 0.95, 0.55), [0.965126, 0.634655, 0.0], rtol=2e-6
    )
    scale = np.sqrt(287 / d.GAS_CONSTANT_J_KG_K)  # the vectors are for R = 287
    flow = 1e-6 * 7e5 / np.sqrt(293.15) * restriction.nozzle(np.array([1, 5, 6, 6.9]) / 7)
    np.testing.assert_allclose(
        flow, scale * np.array([1.652466e-3, 1.520094e-3, 1.187179e-3, 4.047890e-4]), rtol=2e-6
    )


def test_the_tables_follow_their_functions():
    intercept, slope = restriction.tables()
    ratio = np.linspace(0.0, 0.993, 9_973)
    cell = (ratio * restriction.CELLS).astype(int)
    for row, curve in (
        (1, restriction.nozzle),
        (0, lambda r: d.DISCHARGE * d.CHOKED * restriction.iso6358(r, 0.35)),
    ):
        index = cell + row * (restriction.CELLS + 1)
        np.testing.assert_allclose(intercept[index] + slope[index] * ratio, curve(ratio), rtol=2e-4)


def test_friction_by_direction_is_table_5_of_the_paper():
    for sign, coulomb, stiction, viscous in ((1, 28.35, 50.97, 46.01), (-1, 26.22, 46.15, 42.18)):
        low = NOMINAL.coulomb_n * (1 + sign * NOMINAL.coulomb_asymmetry)
        excess = NOMINAL.stiction_excess_n * (1 + sign * NOMINAL.stiction_asymmetry)
        slope = NOMINAL.viscous_n_s_m * (1 + sign * NOMINAL.viscous_asymmetry)
        np.testing.assert_allclose(
            (low, low + excess, slope), (coulomb, stiction, viscous), atol=2e-3
        )


def test_stiction_holds_a_load_below_break_away_and_not_above():
    # A sudden load stretches the bristle to twice its rest length: 22 N act like 44 N.
    still = run(replace(SHUT, constant_force_n=22.0), np.full(300, 4.95), 0.145, 1e5)
    assert np.ptp(still["position_m"]) < 50e-6
    moving = run(replace(SHUT, constant_force_n=75.0), np.full(300, 4.95), 0.145, 1e5)
    assert np.ptp(moving["position_m"]) > 1e-3


@pytest.mark.slow
def test_open_loop_sine_gives_the_numbers_of_physics_7():
    out = run(NOMINAL, sine(4000), substeps=25)
    position, velocity = out["position_m"], out["velocity_m_s"]
    assert position.min() == pytest.approx(0.012, abs=0.003)
    assert position.max() == pytest.approx(0.224, abs=0.010)
    assert velocity.min() == pytest.approx(-0.53, rel=0.05)
    assert velocity.max() == pytest.approx(0.47, rel=0.05)
    for name, low, high in (("pressure_a_pa", 4.9e5, 6.6e5), ("pressure_b_pa", 4.9e5, 6.3e5)):
        assert out[name].min() == pytest.approx(low, rel=0.03)
        assert out[name].max() == pytest.approx(high, rel=0.03)
    assert out["temperature_a_k"].min() > 279 and out["temperature_a_k"].max() < 309


def test_a_closed_valve_rests_at_the_pressure_of_symmetric_leaks():
    leaky = replace(NOMINAL, spool_leak_m2=2e-6)  # 25 times nominal: rests in 1 s, same ratio
    out = run(leaky, np.full(1500, 4.95), 0.145, 3e5, substeps=25)
    for chamber in ("a", "b"):
        ratio = out[f"pressure_{chamber}_pa"][-1] / NOMINAL.supply_pressure_pa
        assert ratio == pytest.approx(0.807458, rel=2e-3)


def test_a_closed_adiabatic_chamber_keeps_its_mass_and_its_isentrope():
    # Heavy, so that the load moves it slowly: the isentrope is first order in the step.
    out = run(replace(SHUT, constant_force_n=300.0, moving_mass_kg=20.0), np.full(400, 4.95), 0.1)
    assert np.ptp(out["position_m"]) > 0.02
    for chamber in ("a", "b"):
        m = mass(SHUT, out, chamber)
        assert np.ptp(m) < 1e-10 * m[0]
        isentrope = (
            out[f"true_pressure_{chamber}_pa"] ** 0.4 / out[f"temperature_{chamber}_k"] ** 1.4
        )
        assert np.ptp(isentrope) < 2e-4 * isentrope[0]


def test_a_piston_leak_moves_gas_and_loses_none():
    leaking = replace(SHUT, piston_leak_m2=2e-6)
    batch = stack([leaking])
    start = d.at_rest(batch, 0.145, np.array([[6e5], [5.3e5]]))
    out = open_loop(batch, np.full(300, 4.95), start)
    a, b = mass(leaking, out, "a")[:, 0], mass(leaking, out, "b")[:, 0]
    assert a[-1] < 0.97 * a[0]
    np.testing.assert_allclose(a + b, a[0] + b[0], rtol=1e-10)


def test_stops_hold_the_piston():
    out = run(NOMINAL, np.full(700, 7.0), 0.2, substeps=25)
    assert d.STROKE_M < out["position_m"].max() < d.STROKE_M + 2e-3
    assert abs(out["position_m"][-1] - d.STROKE_M) < 3e-4


@pytest.mark.slow
def test_the_error_is_first_order_in_the_step():
    fine, coarse, coarser = (
        run(NOMINAL, sine(400), substeps=n)["position_m"] for n in (100, 50, 25)
    )
    error, larger = np.abs(coarse - fine).max(), np.abs(coarser - fine).max()
    # First order: (1/50 - 1/100) against (1/25 - 1/100) is a third.
    assert error < 20e-6
    assert 0.28 < error / larger < 0.40


def test_the_valve_is_slow_and_arrives():
    slow = replace(NOMINAL, valve_lag_s=0.01, valve_period_s=0.01, valve_damping=0.8)
    late, prompt = (run(x, np.full(200, 5.8), 0.05)["position_m"] for x in (slow, NOMINAL))
    assert np.all(late <= prompt + 1e-9) and late[60] < prompt[60]


@pytest.mark.parametrize("name", draws.EFFECTS)
def test_every_effect_is_absent_at_its_null(name):
    case = draw(name, 3)
    off, on = drive_of(case, "hidden"), drive_of(case)
    assert off != on
    share = abs(case.size) / draws.EFFECTS[name].typical
    assert 0.10 <= share <= 0.60
    if name == "supply_droop":
        assert off.tank_per_m3 == 0.0 and on.tank_per_m3 == pytest.approx(1e3)
    else:
        assert all(getattr(off, field) == 0.0 for field in draws.EFFECTS[name].fields)


def test_a_draw_repeats_and_differs_by_seed_and_effect():
    assert draw("valve_lag", 4) == draw("valve_lag", 4)
    assert draw("valve_lag", 4) != draw("valve_lag", 5)
    assert draw(None, 4).differences != draw("valve_lag", 4).differences
    with pytest.raises(KeyError, match="is not a hidden effect"):
        draw("gremlin", 1)


def test_the_hidden_quantity_keeps_its_size_and_the_supply_error_needs_a_blind_supply():
    assert drive_of(draw("coulomb_friction", 2)).coulomb_n == draw("coulomb_friction", 2).size
    for name in HIDDEN:
        changed = {x.field for x in draw(name, 2).differences}
        assert ("supply_pressure_pa" in changed) == (name == "supply_droop")


def test_halving_stops_below_a_fifth():
    found = rule.Misfit(10.0, {"small": 1.9, "large": 2.1, "huge": 40.0})
    assert rule.halvings(found) == {"large": 0.5, "huge": 0.125}
    case = draw("valve_lag", 1)
    smaller = shrink(shrink(case, {"area_exponent": 0.5}), {"area_exponent": 0.5})
    assert dict(smaller.shrunk) == {"area_exponent": 0.25}


@pytest.mark.parametrize("seed", range(20))
def test_references_cross_most_of_the_stroke_and_rest(seed):
    for reference in (training_reference, validation_reference):
        r = reference(np.random.default_rng(seed))
        assert len(r) == 10_000 and 0.020 < r.min() < 0.08 and 0.22 < r.max() < 0.27
        speed = np.abs(np.gradient(r, 1e-3))
        assert 0.6 < speed.max() < 1.6
        still = np.flatnonzero(np.diff(np.concatenate([[1], (speed > 1e-9) * 1, [1]])))
        assert np.diff(still)[::2].max() >= 500


def test_csv_files_repeat_byte_for_byte(tmp_path):
    table = dict(time_s=np.arange(3) * 1e-3, command_V=np.full(3, 4.95), position_mm=np.ones(3))
    for name in ("one.csv", "two.csv"):
        write_csv(table, tmp_path / name)
    text = (tmp_path / "one.csv").read_text()
    assert text == (tmp_path / "two.csv").read_text()
    assert text.splitlines()[:2] == ["time_s,command_V,position_mm", "0.000,4.950000,1.0000"]


@pytest.mark.slow
def test_recordings_do_not_depend_on_their_batch():
    cases = [draw(None, 1), draw("supply_droop", 1)]
    together, alone = record(cases), record(cases[:1])
    for one, other in zip(together[0], alone[0], strict=True):
        assert all(np.array_equal(one[name], other[name]) for name in one)
    assert "supply_bar" in together[0][0] and "supply_bar" not in together[1][0]


@pytest.mark.slow
def test_all_effects_are_recorded_inside_the_stroke_with_rests_and_speed():
    truth = run_cases([draw(name, 2) for name in (None, *draws.EFFECTS)]).truth
    position, speed = truth["position_m"], np.abs(truth["velocity_m_s"])
    assert position.min() > 0.010 and position.max() < 0.280
    assert np.all(np.ptp(position, axis=0) > 0.14)
    assert np.all(speed.max(axis=0) > 0.5) and np.all((speed < 1e-3).mean(axis=0) > 0.1)


@pytest.mark.slow
def test_after_scaling_no_difference_hides_the_effect():
    case = misfit.scaled([draw("constant_force", 1)])[0]
    found = misfit.misfits([case])[0]
    assert found.hidden >= rule.VISIBLE
    assert max(found.differences.values()) <= rule.LARGEST_SHARE * found.hidden
