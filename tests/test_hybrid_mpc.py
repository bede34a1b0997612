"""Hybrid MPC of the gearbox: what it predicts, what it searches, and what its shifts do."""

import numpy as np
import pytest
from commands import call
from gearbox_shifts import held
from hypothesis import given
from hypothesis import strategies as st

from controllers.design_file import design, read_design, write_design
from controllers.hybrid_mpc import HybridMpcSpec, hybrid_mpc
from controllers.shift_prediction import query
from controllers.switching_plans import NEVER, flips, plans, switching_times
from linearize.shift_sample import half_stroke_m, one_sample, softened
from linearize.shifting import STATES
from linearize.standard import standard_modes
from linearize.valve_response import (
    BEFORE,
    MASK,
    MEMORY,
    admissible,
    age,
    packed,
    valve_response,
)
from studies.shift_check import OVERSHOT_M, SHIFTS, check_shifts
from workbench.called import called
from workbench.contracts import Estimate
from workbench.errors import InputError
from workbench.plants.gearbox import COMMANDS, gearbox
from workbench.plants.servo_drive import servo_drive
from workbench.recording import Recording
from workbench.simulation import simulate

HOLD, N = 4, 26
VENTED = np.array([1.013e5, 1.013e5, 0.0, 0.0])


@pytest.fixture(scope="module")
def response():
    return valve_response(gearbox(), "valve_1", 1e-3, HOLD)


@pytest.fixture(scope="module")
def made():
    return design("hybrid-mpc", gearbox()).controller


def seen(x):
    return Estimate(STATES, np.array(x, dtype=float), np.eye(4))


def to(place_m):
    return np.array([[place_m]])


def test_a_valve_that_is_switched_too_soon_is_refused(response):
    with pytest.raises(ValueError, match="switches a valve twice within 4 samples"):
        response.ahead(0, packed(np.array([1, 0, 0, 0])))


@given(st.integers(0, 1), st.integers(0, HOLD))
def test_every_plan_keeps_the_least_time_between_switches(response, level, wait):
    found = plans(level, wait, HOLD, N)
    old = HOLD - wait  # samples for which the level has stood
    past = int(packed(np.array([1 - level] * (20 - old) + [level] * old))[-1])

    assert len(found.switches) == len(switching_times(0, HOLD))
    for row, count in zip(found.commands, found.switches, strict=True):
        changes = np.flatnonzero(np.diff([level, *row]))
        assert count in (len(changes), NEVER)
        assert (np.diff(changes) >= HOLD).all()
        assert (changes >= wait).all()
    assert response.keeps(past, found.packed).all()
    if wait:
        sooner = plans(level, wait - 1, HOLD, N)
        assert not response.keeps(past, sooner.packed).all()


def test_all_histories_keep_the_least_time_and_no_other_does():
    for row in admissible(HOLD):
        changes = np.flatnonzero(np.diff(row))
        assert (np.diff(changes) >= HOLD).all()
    kept = {tuple(row[:8]) for row in admissible(HOLD)}
    every = (tuple(int(b) for b in f"{k:08b}") for k in range(256))
    valid = {b for b in every if (np.diff(np.flatnonzero(np.diff(b))) >= HOLD).all()}

    assert kept == valid


@given(st.integers(0, MASK))
def test_the_age_of_a_command_is_counted_from_its_last_change(history):
    bits = f"{history:0{MEMORY + BEFORE}b}"
    assert age(history) == len(bits) - len(bits.rstrip(bits[-1]))


def test_the_reduced_sample_follows_the_whole_plant_through_a_braked_shift(response):
    ahead = held([((1, 0), 0.010), ((1, 1), 0.006), ((1, 0), 0.006)], 1e-3)[:, :-1].astype(int)
    fine = np.column_stack([np.repeat(ahead, 4, axis=1), ahead[:, -1]]).astype(float)
    channels = dict(zip(COMMANDS, fine, strict=True))
    plant = gearbox().lean()
    truth = simulate(plant, Recording("shift", 2.5e-4, channels)).rows(STATES)[:, 4::4]
    step = one_sample(softened(plant), half_stroke_m(plant), 1e-3, stops=True)
    shares, x, rows = [response.ahead(0, packed(row)) for row in ahead], VENTED, []
    for both in np.hstack(shares):
        x = step(x, both)[0].full().ravel()
        rows.append(x)
    error = np.abs(np.array(rows).T - truth).max(axis=1)

    assert error[2] < 0.25e-3 and error[3] < 0.1
    assert (error[:2] < [5e3, 2.5e4]).all()


def test_the_affine_modes_along_a_plan_cost_what_the_nonlinear_model_does(made):
    """Where nothing stops the piston, the pair that changes nothing has the cost of the plan."""
    horizon = HybridMpcSpec().horizon
    plan = np.zeros((2, horizon), dtype=int)
    plan[1] = 1  # towards Low, which it does not reach within the horizon
    asked, count = query(-12e-3, 0.0, 0.0), len(made.search.plans(0).switches)
    shares = np.hstack(
        [r.ahead(0, packed(row)) for r, row in zip(made.search.responses, plan, strict=True)]
    )
    way, _ = called(made.search.prediction.linearised, VENTED, shares.T)
    nothing = np.zeros((count, 2 * horizon))
    ranked = made.search.prediction.ranking.costs(way.ravel(), [nothing] * 2, asked)
    (judged,) = made.search.prediction.judging.costs(VENTED, shares[None], asked)

    assert ranked == pytest.approx(np.full(ranked.shape, judged), rel=1e-9)


def test_the_slopes_along_a_plan_are_those_of_the_nonlinear_model(made):
    horizon = HybridMpcSpec().horizon
    shares = np.full((4, horizon), 0.5)
    x = np.array([4e5, 3e5, -6e-3, 0.5])
    way, slope = called(made.search.prediction.linearised, x, shares)
    for valve, seat, sample in ((0, 0, 2), (0, 1, 4), (1, 0, 5), (1, 1, 7)):
        moved = shares.copy()
        moved[2 * valve + seat, sample] += 1e-6
        change = (called(made.search.prediction.linearised, x, moved)[0] - way)[:15, 0] / 1e-6

        column = 2 * (valve * horizon + sample) + seat
        assert slope[:15, column] == pytest.approx(change, rel=1e-3, abs=1e-7)


def test_flips_are_every_command_and_every_two_neighbours():
    assert flips(3).tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1]]


def test_it_gives_the_same_answer_twice_and_drives_towards_the_target(made):
    for place_m in (-12e-3, 12e-3):
        first, again = (made.step(made.start(), to(place_m), seen(VENTED)) for _ in range(2))

        assert np.array_equal(first.memory.plan, again.memory.plan)
        assert first.memory.plan[1 if place_m < 0 else 0].any()


def test_at_rest_on_target_nothing_switches(made):
    command = made.start()
    for _ in range(5):
        command = made.step(command, to(0.0), seen([1.013e5, 1.013e5, 5e-5, 0.0]))
        command = made.step(command, to(0.0), seen([1.013e5, 1.013e5, -5e-5, 0.0]))

    assert command.memory.sent == (0, 0)


def test_a_speed_that_may_be_noise_switches_nothing_at_rest(made):
    """Of draw 11 of the study: both valves at the sight of -0.12 m/s at 10 um, and 0.7 mm later."""
    command, noise = made.start(), np.diag([1e3, 1e3, 1.5e-5, 0.064]) ** 2
    for _ in range(20):
        for speed_m_s in (-0.12, 0.1, 0.0):
            estimate = Estimate(STATES, np.array([1.013e5, 1.013e5, 1e-5, speed_m_s]), noise)
            command = made.step(command, to(0.0), estimate)

    assert command.memory.sent == (0, 0)
    sure = Estimate(STATES, np.array([1.013e5, 1.013e5, 1e-5, -0.12]), 1e-2 * noise)
    assert made._seen(sure, 0.0)[3] == -0.12


def test_without_an_answer_the_last_plan_goes_on(made):
    before = made.step(made.start(), to(12e-3), seen(VENTED))
    lost = made.step(before, to(12e-3), seen([np.nan] * 4))

    assert lost.notes["fallback"] == 1.0
    assert np.array_equal(lost.memory.plan[:, :-1], before.memory.plan[:, 1:])


def test_a_new_target_waits_for_an_estimate(made):
    lost, blind = seen([np.nan] * 4), made.start()
    for _ in range(3):
        blind = made.step(blind, to(12e-3), lost)
    assert blind.memory.sent == (0, 0) and blind.memory.target_m is None

    found = made.step(blind, to(12e-3), seen(VENTED))
    assert found.memory.target_m == 12e-3
    assert np.array_equal(
        found.memory.plan, made.step(made.start(), to(12e-3), seen(VENTED)).memory.plan
    )

    turned = made.step(found, to(-12e-3), lost)
    assert turned.memory.target_m == 12e-3
    assert np.array_equal(turned.memory.plan[:, :-1], found.memory.plan[:, 1:])


@pytest.mark.parametrize("end_m", [-12e-3, 12e-3])
def test_a_shift_that_is_called_back_ends_where_it_began(made, end_m):
    """The sensor sees the piston 20 um past its stop: that is no way to the other one."""
    beyond_m = end_m + np.sign(end_m) * 2e-5
    assert query(end_m, beyond_m, beyond_m)[1] == np.sign(end_m)
    step = one_sample(softened(gearbox()), half_stroke_m(gearbox()), 1e-3, stops=True)
    x, command = np.array([1.013e5, 1.013e5, end_m, 0.0]), made.start()
    command = made.step(command, to(end_m), seen(x))
    for k in range(80):
        noise = np.array([0.0, 0.0, np.sign(end_m) * 2e-5, 0.0])
        command = made.step(command, to(0.0 if k < 4 else end_m), seen(x + noise))
        pairs = zip(made.search.responses, command.memory.sent, strict=True)
        shares = [r.ahead(s >> 1, np.array([s & 1]))[0] for r, s in pairs]
        x = step(x, np.concatenate(shares))[0].full().ravel()

    assert x[2] == pytest.approx(end_m, abs=3e-4)


@pytest.mark.parametrize("number", [{"horizon": 16, "hold_s": 1.6e-2}, {"hold_s": 2e-2}])
def test_a_hold_that_no_pulse_ends_in_is_refused(number):
    with pytest.raises(InputError, match="hold_s"):
        design("hybrid-mpc", gearbox(), number)


def test_a_place_between_the_dedicated_ones_is_refused(made):
    with pytest.raises(InputError, match="cannot hold the main piston at 5 mm; expected -12 or 0"):
        made.step(made.start(), to(5e-3), seen(VENTED))


def test_a_plant_without_switching_valves_is_refused():
    with pytest.raises(KeyError, match="no modes to shift gears with for servo_drive"):
        design("hybrid-mpc", servo_drive())


def test_more_to_judge_than_there_is_is_refused():
    with pytest.raises(InputError, match=r"hybrid-mpc\.judged: is 400"):
        design("hybrid-mpc", gearbox(), {"judged": 400, "hold_s": 1.9e-2})


def test_a_shift_from_low_to_neutral_lands_softly_where_driving_overshoots(tmp_path):
    path = tmp_path / "design.toml"
    write_design(design("hybrid-mpc", gearbox()), path)
    found = check_shifts(gearbox(), {"mpc": read_design(path).controller}, ["l-n"])
    (row,), (record,) = found.rows, found.records
    commands = record.recording.rows(COMMANDS)[:, ::4]

    assert row.reached and row.overshoot_m < OVERSHOT_M
    for valve in commands:
        assert (np.diff(np.flatnonzero(np.diff(valve))) >= HOLD).all()
    assert set(np.unique(commands)) <= {0.0, 1.0}


@pytest.mark.slow
@pytest.mark.parametrize("supply_bar", [7, 8, 9, 10])
def test_all_four_shifts_are_fast_and_soft_at_any_supply_without_retuning(supply_bar):
    plant = gearbox().with_values({"supply.pressure_pa": 1e5 * supply_bar})
    found = check_shifts(plant, {"mpc": design("hybrid-mpc", plant).controller}, SHIFTS)

    assert [row.scenario for row in found.rows if not row.reached] == []


def test_the_commands_design_and_check_a_gearbox(tmp_path):
    rig, made = tmp_path / "g.toml", tmp_path / "d.toml"
    rig.write_text('plant = "gearbox"\n')
    answer = call("design", rig, "--controller", "hybrid-mpc", "-o", made)
    assert answer.exit_code == 0, answer.output
    assert "commands 1, 1 lead to 0 mm" in answer.stdout
    answer = call("check", rig, made, "--scenario", "n-h", "--json", tmp_path / "j.json")
    assert answer.exit_code == 0, answer.output
    answer = call("check", rig, made, "--scenario", "step")
    assert answer.exit_code == 2
    answer = call("check", rig, made, "--estimator", "ekf")
    assert answer.exit_code == 2
    assert "leave --estimator out" in answer.stderr


@pytest.mark.parametrize("scenario", [pytest.param("h-n", marks=pytest.mark.slow), "l-n"])
def test_shifts_to_neutral_are_made_behind_a_network_that_is_known(scenario):
    """3 ms late, the piston would go 2.6 mm past Neutral and land with 1.1 m/s and more."""
    late = {f"command_delay@valve_{k}.delay_s": 3e-3 for k in (1, 2)}
    plant = gearbox().with_values(late)
    hybrid = standard_modes(plant)
    found = check_shifts(plant, {"mpc": hybrid_mpc(hybrid)}, [scenario])

    assert found.rows[0].reached
    assert "command_delay@valve_1" in [each.what for each in hybrid.model.left_out]
