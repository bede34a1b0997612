"""Unknown forces, flows and parameters among the states of a plant, for every estimator alike."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from linear_plant import MASS_KG, cart
from test_estimators import DT_S, NOISE_M, run
from test_kalman_family import SENSORS, SLIDING_NOISE, on_drive

from estimators import ESTIMATORS
from estimators.augmentation import Unknown, augmented
from estimators.foreseen import Foresight
from workbench.effects.sensor_offset import PositionSensorOffset
from workbench.plants.servo_drive import servo_drive


@pytest.mark.parametrize("name", ESTIMATORS)
def test_an_unknown_force_is_found_by_every_estimator(name):
    unknown = Unknown("cart.velocity_m_s", deviation=2.0, per_root_second=0.05)
    plant = augmented(cart(), [unknown])
    estimator = ESTIMATORS[name](
        plant=plant,
        sample_time_s=DT_S,
        measurement_noise={"cart.position_m": NOISE_M},
        process_noise={"cart.velocity_m_s": 1e-3, **plant.process_noise},
    )
    step, rng, x = cart().model.step(DT_S), np.random.default_rng(1), np.zeros(2)
    _, d, p = cart().nominal
    y = []
    for _ in range(300):
        y.append([x[0] + NOISE_M * rng.standard_normal()])
        x = step(x, [1.6 * MASS_KG], d, p).full().ravel()
    found = run(estimator, np.zeros((300, 1)), np.array(y))[-1]
    (at,) = found.pick([unknown.state])
    deviation = np.sqrt(found.covariance[2, 2])

    assert at == pytest.approx(1.6, abs=3.0 * deviation)
    assert deviation < 0.3


def test_coloured_noise_keeps_its_size():
    unknown = Unknown("cart.velocity_m_s", deviation=2.0, time_constant_s=0.05)
    plant = augmented(cart(), [unknown])
    estimator = ESTIMATORS["ekf"](
        plant=plant,
        sample_time_s=5e-4,
        measurement_noise={"cart.position_m": NOISE_M},
        process_noise=plant.process_noise,
    )
    estimate = estimator.start(np.zeros(1))
    for _ in range(400):
        estimate = Foresight(estimator).blind(estimate, np.zeros(1))

    assert np.sqrt(estimate.covariance[2, 2]) == pytest.approx(2.0, rel=1e-3)


def test_an_unknown_parameter_is_found():
    plant = servo_drive().lean()
    name = "friction.viscous_n_s_m"
    unknown = augmented(plant, [Unknown(name, deviation=20.0, per_root_second=1.0)])
    noise = SLIDING_NOISE | unknown.process_noise
    estimator = on_drive("ekf", unknown, process_noise=noise)
    truth = plant.with_values({name: plant.values[name] + 15.0})
    step, (_, d, p) = truth.model.compiled_step(1e-3), truth.nominal
    rng, x, estimate, sent = np.random.default_rng(5), plant.initial, None, plant.nominal[0]
    for k in range(1500):
        y = x[[0, 2, 4]] + rng.standard_normal(3) * list(SENSORS.values())
        u = np.array([4.95 + 0.9 * np.sin(8.0 * k * 1e-3)])
        estimate = estimate or estimator.start(y)
        estimate = estimator.update(estimate, sent, y)
        x, sent = step(x, u, d, p).full().ravel(), u

    assert estimate.pick([f"unknown {name}"])[0] == pytest.approx(15.0, abs=4.0)


def with_an_offset():
    """A cart whose sensor reads 30 mm too much, its plant, commands and measurements."""
    offset, truth = PositionSensorOffset(name="tilt", signal="cart.position_m"), cart()
    step, rng, x = truth.model.step(DT_S), np.random.default_rng(0), np.zeros(2)
    _, d, p = truth.nominal
    u, y = rng.normal(0.0, 2.0, (200, 1)), []
    for command in u:
        y.append([x[0] + 0.03 + NOISE_M * rng.standard_normal()])
        x = step(x, command, d, p).full().ravel()
    return replace(truth, effects=(*truth.effects, offset)), u, np.array(y)


@pytest.mark.parametrize("name", ["ekf", "ukf", "mhe"])
def test_an_unknown_offset_of_a_sensor_is_found_as_if_it_were_a_state(name):
    """It is in no rate: the outputs alone tell of it."""
    (plant, u, y), unknown = with_an_offset(), "tilt.offset_m"
    told = dict(sample_time_s=DT_S, measurement_noise={"cart.position_m": NOISE_M})
    noise = {"cart.velocity_m_s": 1e-2}
    state = augmented(plant, [Unknown(unknown, deviation=1e-2, per_root_second=1e-2)])
    as_input = ESTIMATORS[name](
        plant=plant, process_noise=noise, unknown_inputs={unknown: 1e-2}, **told
    )
    as_state = ESTIMATORS["ekf"](plant=state, process_noise=noise | state.process_noise, **told)
    found, known = (run(each, u, y)[-1] for each in (as_input, as_state))

    assert found.notes[f"unknown {unknown}"] == pytest.approx(0.03, abs=2e-3)
    assert found.notes[f"unknown {unknown}"] == pytest.approx(known.state[2], rel=1e-5)
    assert found.state == pytest.approx(known.state[:2], rel=1e-5)
    assert found.covariance == pytest.approx(known.covariance[:2, :2], rel=1e-3)


@pytest.mark.parametrize(
    ("name", "how"),
    [
        *product(("ekf", "ukf"), [{"unknown_inputs": {"tilt.offset_m": 1e-2}}]),
        ("mhe", {"constants": {"tilt.offset_m": 1e-3}}),
    ],
)
def test_a_gate_foresees_a_sensor_with_the_offset_that_was_estimated(name, how):
    plant, u, y = with_an_offset()
    estimator = ESTIMATORS[name](
        plant=plant,
        sample_time_s=DT_S,
        measurement_noise={"cart.position_m": NOISE_M},
        process_noise={"cart.velocity_m_s": 1e-2},
        **how,
    )
    sight, last = Foresight(estimator), run(estimator, u[:-1], y[:-1])[-1]
    expected, _ = sight.outputs(sight.blind(last, u[-2]), u[-2])

    assert expected == pytest.approx(y[-1], abs=5.0 * NOISE_M)


def test_what_is_unknown_must_be_a_state_or_a_parameter():
    with pytest.raises(Exception, match=r"cart has no cart\.velocity_m; did you mean"):
        augmented(cart(), [Unknown("cart.velocity_m", deviation=1.0)])
    with pytest.raises(ValueError, match="deviation and time constant above zero"):
        Unknown("cart.velocity_m_s", deviation=0.0)
