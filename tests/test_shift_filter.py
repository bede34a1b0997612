"""The filter of gear shifts: what it learns of two valves from the full nonlinear plant."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from estimators.shift_filter import NAMES, ShiftFilter
from linearize.shifting import POSITION, PRESSURES, STATES, VELOCITY
from linearize.valve_spread import FLOW_GAINS, STRENGTHS, valve_spread
from studies.gear_shift_study import _truth
from studies.shift_check import NOISE, PROCESS, run, shift_filter, valves_off
from studies.shift_check import Drive as Held
from workbench.filtering import consistent_start
from workbench.plants.gearbox import FINGER_M, gearbox
from workbench.rig import default_rig

SEEDS = range(40, 48)


@pytest.fixture(scope="module")
def filter_():
    return shift_filter(gearbox().lean(), 1e-3)


def estimates(plant, commands, scenario, seed, filter_):
    """By name at each sample of the filter."""
    record = run(plant.lean(), Held(commands), filter_, scenario, seed)
    return {name: row[::4] for name, row in record.estimates.items()}


def strength(plant, valve):
    """Of a drawn plant: how far it is off in the direction that counts, in standard deviations."""
    nominal = gearbox()
    stronger, _ = valve_spread(nominal, valve, 1e-3)[0]
    total = 0.0
    for name, value in nominal.values.items():
        sd = nominal.parameters[name].standard_deviation(value)
        if name.startswith(f"{valve}.") and sd:
            step = (stronger.values[name] - value) / sd
            total += step * (plant.values[name] - value) / sd
    return total


def test_the_strength_of_both_valves_is_learned_before_a_shift_has_to_brake(filter_):
    """Valves, masses, friction, volumes and supply drawn; both valves open at once.

    8 ms after the command the piston is 1 to 2 mm off Low, and a brake takes effect 5 ms later.
    """
    errors, spread = [], []
    for seed in SEEDS:
        plant = _truth(seed)
        found = estimates(plant, (1, 1), "l-n", seed, filter_)
        known = [strength(plant, valve) for valve in ("valve_1", "valve_2")]
        errors.append([found[name][8] for name in STRENGTHS] - np.array(known))
        spread.append(known)

    error, before = (np.sqrt(np.mean(np.square(each))) for each in (errors, spread))
    assert error < 0.6 * before


def test_a_stronger_valve_is_found_and_the_other_is_not_blamed(filter_):
    """Chamber 2 fills half as fast: 10 ms tell less of its valve, and noise keeps it near none."""
    for valve, (name, least) in enumerate(zip(STRENGTHS, (0.5, 0.1), strict=True)):
        stronger, weaker = valve_spread(gearbox(), f"valve_{valve + 1}", 1e-3)[0]
        found = [estimates(p, (1, 1), "l-n", 0, filter_) for p in (stronger, weaker)]
        own = [each[name][10] for each in found]
        other = [each[STRENGTHS[1 - valve]][10] for each in found]

        assert least < own[0] < 1.3 and -1.3 < own[1] < -least
        assert np.abs(other).max() < 0.35


def test_a_leaner_flow_is_no_late_valve(filter_):
    lean = gearbox().with_values({f"valve_{k}.discharge_coefficient": 0.9 * 0.72 for k in (1, 2)})
    found = estimates(lean, (1, 1), "l-n", 0, filter_)

    assert found[FLOW_GAINS[0]][10] == pytest.approx(-0.1, abs=0.03)
    assert abs(found[STRENGTHS[0]][10]) < 0.45


def test_what_nothing_has_shown_stays_as_it_was_believed(filter_):
    """From Neutral to High only valve 1 moves: of the other one the deviation stays, too."""
    truth = run(gearbox().lean(), Held((1, 0)), filter_, "n-h", 0).measured[:, ::4]
    estimate, command = filter_.start(truth[:, 0]), np.zeros(2)
    for seen in truth.T:
        estimate, command = filter_.update(estimate, command, seen), np.array([1.0, 0.0])
    deviations = dict(zip(NAMES, np.sqrt(np.diag(estimate.covariance)), strict=True))

    assert abs(estimate.pick([STRENGTHS[1]])[0]) < 0.05
    assert abs(estimate.pick([FLOW_GAINS[1]])[0]) < 0.07  # it vents what the piston pushes
    assert deviations[STRENGTHS[1]] > 0.95 and deviations[FLOW_GAINS[1]] > 0.06
    assert deviations[STRENGTHS[0]] < 0.8 and deviations[FLOW_GAINS[0]] < 0.04


@pytest.mark.parametrize("supply_bar", [8.0, 9.0, 10.0])
@pytest.mark.parametrize(("scenario", "commands"), [("l-n", (1, 1)), ("h-n", (1, 1))])
def test_a_supply_that_is_off_by_a_bar_upsets_no_estimate(filter_, scenario, commands, supply_bar):
    plant = gearbox().with_values({"supply.pressure_pa": 1e5 * supply_bar})
    record = run(plant.lean(), Held(commands), filter_, scenario, 1)
    place, truth = record.estimates[POSITION][::4], record.recording[POSITION][::4]
    arrived = int(np.argmax(np.abs(truth) < 1e-4))
    error = record.estimates[VELOCITY][::4] - record.recording[VELOCITY][::4]

    assert np.sqrt(np.mean((place - truth)[:arrived] ** 2)) < 3.5e-5
    assert np.sqrt(np.mean(error[:arrived] ** 2)) < 0.07
    gains = np.array([record.estimates[name][4 * arrived] for name in FLOW_GAINS])
    assert gains == pytest.approx(supply_bar / 9.0 - 1.0, abs=0.06)


@pytest.mark.parametrize("supply_bar", [8.0, 8.7, 9.0, 10.0])
def test_chambers_that_stand_at_their_supply_say_nothing_of_valves(filter_, supply_bar):
    """0.3 s at Neutral with both valves energised, whatever the supply: then the next shift."""
    plant = gearbox().with_values({"supply.pressure_pa": 1e5 * supply_bar}).lean()
    step, f = plant.model.compiled_step(1e-3), plant.model.f
    places = {POSITION: 12e-3, "floating_piston.position_m": 12e-3}
    places["finger.angle_rad"] = 12e-3 / FINGER_M
    x, (_, d, p) = consistent_start(plant, places), plant.nominal
    rng, estimate, errors = np.random.default_rng(3), None, []
    noise = np.array([NOISE[name] for name in plant.measured])
    for k in range(325):
        u = np.array([1.0, 1.0] if k < 300 else [1.0, 0.0])
        y = f(x, u, d, p)[1].full().ravel() + noise * rng.standard_normal(3)
        estimate = estimate or filter_.start(y)
        estimate = filter_.update(estimate, u if k else np.zeros(2), y)
        if k == 300:
            rest = estimate
        if k >= 300:
            errors.append(
                estimate.pick([PRESSURES[1]])[0] - x[plant.model.states.index(PRESSURES[1])]
            )
        x = step(x, u, d, p).full().ravel()

    assert np.abs(rest.pick(FLOW_GAINS)).max() < 0.2
    assert np.abs(rest.pick(STRENGTHS)).max() < 1.0
    assert np.sqrt(np.mean(np.square(errors))) < 1.6e3


def test_place_and_speed_follow_the_whole_plant_through_a_shift(filter_):
    record = run(gearbox().lean(), Held((1, 1)), filter_, "l-n", 1)
    rows = slice(None, 60, 4)  # to Neutral
    place = record.estimates[POSITION] - record.recording[POSITION]
    speed = record.estimates[VELOCITY] - record.recording[VELOCITY]

    assert np.sqrt(np.mean(place[rows] ** 2)) < 3e-5
    assert np.sqrt(np.mean(speed[rows] ** 2)) < 0.05


def test_valves_may_switch_at_every_sample(filter_):
    """No table bounds it: PWM of a millisecond, which moves no armature to its end."""
    estimate = filter_.start(np.array([1.013e5, 1.013e5, 0.0]))
    for k in range(30):
        command = np.array([k % 2, (k // 2) % 2], dtype=float)
        estimate = filter_.update(estimate, command, np.array([1.013e5, 1.013e5, 0.0]))

    size = np.sqrt(np.diag(estimate.covariance))
    assert np.isfinite(estimate.state).all()
    assert np.linalg.eigvalsh(estimate.covariance / np.outer(size, size)).min() > 0.1


@pytest.mark.parametrize(
    "values", [{"supply_droop.resistance_pa_s_kg": 5e7}, {"valve_1.leak_area_m2": 3e-7}]
)
def test_a_plant_with_more_effects_is_filtered_too(values):
    plant = gearbox().with_values(values).lean()
    record = run(plant, Held((1, 1)), shift_filter(plant, 1e-3), "l-n", 1)
    place = (record.estimates[POSITION] - record.recording[POSITION])[:60:4]

    assert np.sqrt(np.mean(place**2)) < 5e-5


def test_a_fitted_rig_says_how_far_its_valves_may_be_off():
    rig = default_rig(gearbox())
    fitted = {
        name: 0.5 * rig.standard_deviation(name)
        for name in rig.plant.values
        if name.startswith("valve_")
    }

    assert valves_off(rig) == pytest.approx(1.0)
    assert valves_off(replace(rig, deviations=fitted)) == pytest.approx(0.5)


def test_a_filter_that_knows_its_valves_learns_nothing_of_them():
    weak = gearbox().with_values({"valve_1.supply_voltage_v": 22.8}).lean()
    sure = shift_filter(gearbox().lean(), 1e-3, 0.0)
    found = estimates(weak, (1, 1), "l-n", 0, sure)

    assert (np.array([found[name] for name in STRENGTHS]) == 0.0).all()


@pytest.mark.parametrize("lost", [*PRESSURES, POSITION])
def test_a_filter_starts_without_a_measurement_and_finds_it_afterwards(filter_, lost):
    truth = gearbox().lean()
    start = consistent_start(truth, {})
    states = list(truth.state_list)
    y = np.array([start[states.index(name)] for name in truth.measured])
    first = np.where([name == lost for name in truth.measured], np.nan, y + 0.3 * abs(y))
    found = filter_.start(first)
    row = NAMES.index(lost)

    assert np.isfinite(found.state).all()
    assert found.covariance[row, row] > (50.0 * NOISE[lost]) ** 2
    for _ in range(5):
        found = filter_.update(found, np.zeros(2), y)
    assert found.state[row] == pytest.approx(
        y[list(truth.measured).index(lost)], abs=3 * NOISE[lost]
    )


def test_a_filter_travels_to_another_process():
    made = ShiftFilter(
        plant=gearbox().lean(),
        sample_time_s=1e-3,
        measurement_noise=NOISE,
        process_noise=PROCESS,
    )
    seen, still = np.array([1.013e5, 1.013e5, 0.0]), np.zeros(2)
    first = made.update(made.start(seen), still, seen)
    again = pickle.loads(pickle.dumps(made))

    assert np.array_equal(again.update(again.start(seen), still, seen).state, first.state)
    assert first.names[: len(STATES)] == STATES
