"""Estimation where the plant hits something within a sample."""

import numpy as np
import pytest

from estimators.moving_horizon import MovingHorizon, sound
from estimators.unscented_kalman import UnscentedKalman
from workbench.plants.gearbox import COMMANDS, gearbox
from workbench.plants.servo_drive import COMMAND, OUTPUTS, servo_drive
from workbench.plants.vertical_cylinder import vertical_cylinder
from workbench.polytropic import with_polytropic_gas
from workbench.recording import Recording
from workbench.simulation import simulate

NOISE = dict(zip(OUTPUTS, (5e-6, 500.0, 500.0), strict=True))


def followed(estimator, truth, noise):
    """Every estimate over a simulated recording with sensor noise."""
    plant = estimator.plant
    y, u = truth.rows(plant.measured), truth.rows(plant.model.commands)
    y = y + np.array([*noise.values()])[:, None] * np.random.default_rng(1).normal(size=y.shape)
    estimate, found, sent = estimator.start(y[:, 0]), [], plant.nominal[0]
    for k in range(y.shape[1]):
        estimate = estimator.update(estimate, sent, y[:, k])
        found.append(estimate)
        sent = u[:, k]
    return found


@pytest.fixture
def uncompiled(monkeypatch):
    monkeypatch.setenv("WORKBENCH_NO_COMPILER", "1")


def test_a_slide_that_hits_its_stop_is_followed(uncompiled):
    plant = with_polytropic_gas(servo_drive()).with_values({"friction.presliding_share": 0.0})
    plant = plant.lean()
    u = np.r_[np.full(500, 6.5), np.full(100, 3.5)]
    truth = simulate(plant, Recording("truth", 1e-3, {COMMAND: u}))
    noise = {"slide.velocity_m_s": 0.5, **dict.fromkeys(OUTPUTS[1:], 1e4)}
    estimator = MovingHorizon(
        plant=plant, sample_time_s=1e-3, measurement_noise=NOISE, process_noise=noise
    )

    found = followed(estimator, truth, NOISE)
    velocity = np.array([e.pick(["slide.velocity_m_s"])[0] for e in found])

    assert np.abs(truth["slide.velocity_m_s"]).max() > 1.0  # it arrives at full speed
    assert all(sound(e.memory.P) for e in found)
    assert np.std((velocity - truth["slide.velocity_m_s"])[20:]) < 0.05


def test_a_step_that_misses_what_an_impact_did_gives_way_to_the_filter(uncompiled):
    """With next to no process noise a path that went wrong at the stop would be believed."""
    plant = vertical_cylinder().lean()
    (pressure,) = plant.model.measured_inputs
    u = 2.1e5 + 3e4 * np.sin(9e-3 * np.arange(160))
    truth = simulate(plant, Recording("truth", 1e-3, {pressure: u}))
    noise = dict.fromkeys(plant.measured, 2e-5)
    estimator = MovingHorizon(
        plant=plant.with_inputs_commanded(),
        sample_time_s=1e-3,
        measurement_noise=noise,
        process_noise={"rod.velocity_m_s": 1e-3},
        initial_deviation={"rod.position_m": 2e-5, "rod.velocity_m_s": 1e-2},
    )

    found = followed(estimator, truth, noise)
    off = np.array([e.pick(plant.measured)[0] for e in found]) - truth[plant.measured[0]]
    given_way = sum(e.notes["fallback"] for e in found)

    assert np.ptp(np.sign(truth["rod.velocity_m_s"])) == 2.0  # it rebounds
    assert np.abs(off).max() < 3 * 2e-5
    assert 1 <= given_way < 5


def test_points_of_the_unscented_filter_do_not_throw_armatures_against_their_stops(uncompiled):
    """Half of their stroke unknown at the start, and process noise as small as a likelihood finds.

    Armatures follow their command; spread by that much, they would bounce for ever in the mean.
    """
    plant = gearbox().lean()
    u = np.zeros((2, 60))
    u[0, 20:] = 1.0
    truth = simulate(plant, Recording("truth", 1e-3, dict(zip(COMMANDS, u, strict=True))))
    noise = {n: 20e-6 if n.endswith("_m") else 700.0 for n in plant.measured}
    sizes = dict(zip(plant.model.states, plant.scale, strict=True))
    valves = {n: 0.5 * s if n.startswith("valve") else 0.01 * s for n, s in sizes.items()}
    shares = {"velocity_m_s": 0.1, "velocity_rad_s": 0.1, "pressure_pa": 3e-6}
    estimator = UnscentedKalman(
        plant=plant,
        sample_time_s=1e-3,
        measurement_noise=noise,
        process_noise={n: shares.get(n.rpartition(".")[2], 0.0) * s for n, s in sizes.items()},
        initial_deviation=valves,
    )

    found = followed(estimator, truth, noise)

    for name in plant.measured:
        off = np.array([e.pick([name])[0] for e in found]) - truth[name]
        assert np.sqrt(np.mean(off[20:] ** 2)) < noise[name]
    for k in (1, 2):
        name = f"valve_{k}.armature_position_m"
        off = np.array([e.pick([name])[0] for e in found]) - truth[name]
        assert np.abs(off[20:]).max() < 0.1e-3  # of 1.9 mm


@pytest.mark.slow
def test_a_gear_is_shifted_through_its_contacts(uncompiled):
    plant = gearbox().lean()
    u = np.zeros((2, 400))
    u[0, 20:200], u[1, 220:] = 1.0, 1.0
    sent = Recording("truth", 1e-3, dict(zip(plant.model.commands, u, strict=True)))
    truth = simulate(plant, sent)
    noise = {n: 20e-6 if n.endswith("_m") else 1e3 for n in plant.measured}
    shares = {"velocity_m_s": 3.0, "velocity_rad_s": 3.0, "pressure_pa": 1.4}
    sizes = dict(zip(plant.model.states, plant.scale, strict=True))
    estimator = MovingHorizon(
        plant=plant,
        sample_time_s=1e-3,
        measurement_noise=noise,
        process_noise={n: shares.get(n.rpartition(".")[2], 0.0) * s for n, s in sizes.items()},
        initial_deviation={n: 0.01 * s for n, s in sizes.items()},
    )

    found = followed(estimator, truth, noise)
    speed = np.array([e.pick(["main_piston.velocity_m_s"])[0] for e in found])
    true = truth["main_piston.velocity_m_s"]

    assert np.abs(true).max() > 0.1
    assert all(sound(e.memory.P) for e in found)
    assert np.std(speed - true) < 0.2 * np.std(true)


def test_variances_below_zero_or_infinite_are_not_sound():
    assert sound(np.diag([1.0, 0.0]))
    assert not sound(np.diag([1.0, -1e-9]))
    assert not sound(np.diag([1.0, np.inf]))
