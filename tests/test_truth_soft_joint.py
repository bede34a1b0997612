"""The true bellows agrees with the model where nothing differs, keeps mass and energy, repeats."""

from dataclasses import replace

import numpy as np
import pytest

from studies.truth import soft_joint as s
from studies.truth import soft_joint_draw as draws
from studies.truth.batch import stack
from studies.truth.cases import read_cases
from studies.truth.plants import SOFT_JOINT
from studies.truth.rule import LARGEST_SHARE
from studies.truth.soft_joint_manoeuvre import SAMPLES, training_command, validation_command
from studies.truth.soft_joint_record import commands, record
from studies.truth.soft_joint_run import SAMPLE_TIME_S, open_loop
from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.simulation import simulate

NOMINAL = s.SoftJoint()
SHUT = replace(NOMINAL, flow_area_m2=0.0, thermal_share=1.0)
RICH = dict(thermal_share=0.1, stiffening_m3=1e-5, creep_m3_pa=1e-11, valve_period_s=0.01)


def run(joint, command, pressure_pa=None, **keywords):
    """Readings of one bellows under commands of shape (n,)."""
    batch = stack([joint])
    return open_loop(batch, np.asarray(command)[:, None], s.at_rest(batch, pressure_pa), **keywords)


STAIRS = np.repeat([0.63, 0.5, 0.44, 0.58, 0.47, 0.3], 50)
SAME = [  # truth and model with the same effects, several at once
    ({}, {}),
    (
        {"chamber_leak_m2": 3e-7, "exhaust_restriction": 0.4, "pressure_offset_pa": 3e4},
        {
            "chamber_leak.area_m2": 3e-7,
            "valve.exhaust_restriction_share": 0.4,
            "sensor_offset@bellows.pressure.offset_pa": 3e4,
        },
    ),
    (
        {"creep_m3_pa": 2e-10, "supply_resistance_pa_s_kg": 5e7, "tank_per_m3": 1e3},
        {
            "bellows_creep.creep_m3_pa": 2e-10,
            "supply_droop.resistance_pa_s_kg": 5e7,
            "supply_droop.refill_time_s": 5e4 / (1.4 * s.GAS_CONSTANT_J_KG_K * 293.15),
        },
    ),
    ({"stuck_band_share": 0.03}, {"valve.stuck_band_share": 0.03}),
]


@pytest.fixture(scope="module")
def on_the_stairs():
    """Readings of all the truths of `SAME`, one column each."""
    batch = stack([replace(NOMINAL, **changes) for changes, _ in SAME])
    command = np.repeat(STAIRS[:, None], len(SAME), axis=1)
    return open_loop(batch, command, s.at_rest(batch))[0]["pressure_pa"]


@pytest.mark.parametrize(("column", "worst_pa"), [(0, 5.0), (1, 5.0), (2, 5.0), (3, 2e3)], ids=str)
def test_without_the_small_differences_it_is_the_model(on_the_stairs, column, worst_pa):
    """To 5 Pa, with 1 kPa of noise; the edge over which a stuck spool comes loose is its own."""
    plant = PLANTS["soft_joint"]().with_values(SAME[column][1]).lean()
    model = simulate(plant, Recording("x", SAMPLE_TIME_S, {"valve.pwm": STAIRS}))
    truth_pa = on_the_stairs[:, column]

    assert np.abs(truth_pa - model["bellows.pressure_pa"]).max() < worst_pa
    assert np.ptp(truth_pa) > 1.8e5


def test_the_step_is_fine_enough():
    rich = replace(NOMINAL, pressure_lag_s=1e-3, **RICH)
    coarse, fine = (run(rich, STAIRS[:150], substeps=n)[0]["pressure_pa"] for n in (5, 10))

    assert np.abs(coarse - fine).max() < 10.0


def test_a_shut_bellows_keeps_its_gas_while_it_creeps():
    """With its own temperature felt and no heat: m constant, and p V^1.4 while it gives way."""
    joint = replace(SHUT, creep_m3_pa=2e-10, stiffening_m3=1e-5, heat_transfer_w_m2_k=0.0)
    batch = stack([joint])
    start = s.at_rest(batch, 4e5)
    start.gas[s.FOLLOWED] = 0.0
    readings, states = open_loop(batch, np.full((200, 1), 0.5), start)
    own, kelvin = readings["true_pressure_pa"][:, 0], readings["temperature_k"][:, 0]
    gauge = own - joint.ambient_pressure_pa
    followed = np.array([each.gas[s.FOLLOWED, 0] for each in states])
    volume = joint.volume_m3 + joint.creep_m3_pa * followed
    volume += joint.stiffening_m3 * (1.0 - np.exp(-gauge / joint.stiffening_pa))

    assert np.ptp(own) > 3e3
    np.testing.assert_allclose(own * volume / kelvin, own[0] * volume[0] / kelvin[0], rtol=1e-9)
    np.testing.assert_allclose(own * volume**1.4, own[0] * volume[0] ** 1.4, rtol=1e-9)


def test_hot_gas_gives_its_heat_to_the_wall():
    """What gas and wall hold together stays, where the wall loses nothing to the room."""
    joint = replace(SHUT, wall_loss_w_k=0.0)
    batch = stack([joint])
    start = s.at_rest(batch, 4e5)
    start.gas[s.TEMPERATURE] = 353.15
    readings, states = open_loop(batch, np.full((400, 1), 0.5), start)
    gas_j = readings["true_pressure_pa"][:, 0] * joint.volume_m3 / (s.KAPPA - 1.0)
    wall_j = joint.wall_j_per_k * np.array([each.gas[s.WALL, 0] for each in states])

    assert gas_j[0] - gas_j[-1] > 5.0
    np.testing.assert_allclose(gas_j + wall_j, gas_j[0] + wall_j[0], atol=1e-4)


def test_the_spool_overshoots_like_a_second_order_one():
    """Overshoot exp(-pi d / sqrt(1 - d^2)) at half a damped period."""
    joint = replace(NOMINAL, valve_period_s=0.01, valve_damping=0.3)
    _, states = run(joint, np.full(60, 0.6))
    travel = np.array([each.spool[0, 0] for each in states]) - 0.5
    root = np.sqrt(1 - 0.3**2)

    assert travel[2] == pytest.approx(0.1 * (1 + np.exp(-np.pi * 0.3 / root)), rel=0.02)
    assert travel[-1] == pytest.approx(0.1, abs=1e-6)


@pytest.mark.parametrize("name", draws.EFFECTS)
def test_every_effect_is_absent_at_its_null(name):
    case = draws.draw(name, 3)
    off, on = draws.joint_of(case, "hidden"), draws.joint_of(case)

    assert off != on
    assert 0.10 <= abs(case.size) / draws.EFFECTS[name].typical <= 0.60
    assert off.tank_per_m3 == 0.0
    nulls = [getattr(draws.NOMINAL, field) for field in draws.EFFECTS[name].fields]
    assert [getattr(off, field) for field in draws.EFFECTS[name].fields] == nulls


def test_an_unknown_effect_is_refused():
    with pytest.raises(KeyError, match="is not a hidden effect"):
        draws.draw("gremlin", 1)


@pytest.mark.parametrize("seed", range(10))
def test_the_manoeuvres_fill_vent_and_pause(seed):
    for manoeuvre in (training_command, validation_command):
        command = manoeuvre(np.random.default_rng(seed))

        assert len(command) == SAMPLES and command.min() >= 0.25 and command.max() <= 0.75
        assert (command > 0.52).mean() > 0.05 and (command < 0.48).mean() > 0.05
        assert (command == 0.5).mean() > 0.1


def test_the_stored_cases_are_those_of_the_draw():
    """What a misfit rule changed is noted: factors of differences, and redraws of the size."""
    stored = read_cases(SOFT_JOINT.stored)

    assert sorted({seed for _, seed in stored}) == [1, 2]
    for (hidden, seed), case in stored.items():
        drawn, factors = draws.draw(hidden, seed), dict(case.shrunk)
        changes = {x.field: x.change * factors.get(x.field, 1.0) for x in drawn.differences}
        assert {x.field: x.change for x in case.differences} == pytest.approx(changes, rel=1e-12)
        assert case.redraws or case.size == drawn.size
        assert len(case.differences) > 10


@pytest.mark.slow
def test_recordings_repeat_and_the_differences_stay_below_a_fifth():
    stored = read_cases(SOFT_JOINT.stored)
    cases = [stored["chamber_leak", 1], stored["supply_droop", 1]]
    tables = record(cases)
    alone = record(cases[:1])
    (found, _) = SOFT_JOINT.misfits(cases)

    for together, single in zip(tables[0], alone[0], strict=True):
        assert all(np.array_equal(together[name], single[name]) for name in single)
    assert "supply_bar" in tables[0][0] and "supply_bar" not in tables[1][0]
    np.testing.assert_array_equal(tables[0][1]["command"], commands(cases[0], "validation"))
    assert max(found.differences.values()) <= LARGEST_SHARE * found.hidden
