"""What every estimator must do, and what ours must equal on a linear plant."""

from dataclasses import replace

import numpy as np
import pytest
from linear_plant import cart
from scipy.linalg import expm

from estimators import ESTIMATORS
from studies.closed_loop_check import standard_estimator
from workbench.filter_likelihoods import log_likelihoods
from workbench.filter_passes import filter_pass, recording_filter, smooth
from workbench.filtering import correct, predict, smoothed, smoothed_covariances
from workbench.plants.servo_drive import COMMAND, OUTPUTS, servo_drive
from workbench.recording import Recording
from workbench.simulation import simulate

DT_S = 0.02
NOISE_M, FORCE_NOISE = 1e-3, 0.3
VELOCITY = "slide.velocity_m_s"
everyone = pytest.mark.parametrize("name", ESTIMATORS)


def on_cart(name, **more):
    return ESTIMATORS[name](
        plant=cart(),
        sample_time_s=DT_S,
        measurement_noise={"cart.position_m": NOISE_M},
        process_noise={"cart.velocity_m_s": FORCE_NOISE},
        **more,
    )


def cart_data(n=60, missing=()):
    """Commands (n, 1) and measurements (n, 1) of a swinging cart."""
    rng = np.random.default_rng(3)
    plant, x = cart(), np.array([0.05, 0.0])
    step, (_, d, p) = plant.model.step(DT_S), plant.nominal
    u, y = rng.normal(0.0, 2.0, (n, 1)), []
    for k in range(n):
        y.append(x[0] + NOISE_M * rng.standard_normal())
        kick = np.array([0.0, FORCE_NOISE * DT_S**0.5 * rng.normal()])
        x = step(x, u[k], d, p).full().ravel() + kick
    y = np.array(y)[:, None]
    y[list(missing)] = np.nan
    return u, y


def kalman(u, y):
    """States, covariances and transition of the textbook filter, step by step."""
    plant = cart()
    A, B, C, _ = (m.full() for m in plant.model.jacobians(plant.initial, *plant.nominal))
    F = expm(A * DT_S)
    G = np.linalg.solve(A, (F - np.eye(2)) @ B)
    noise = np.diag([0.0, FORCE_NOISE**2]) * DT_S / 2
    Q, R = F @ noise @ F.T + noise, np.array([[NOISE_M**2]])
    x, P, states, covariances = np.array([y[0, 0], 0.0]), np.diag(plant.scale**2), [], []
    for k in range(len(y)):
        x, P = predict(x, P, F, Q)
        x = x + G @ (u[k - 1] if k else np.zeros(1))
        x, P = correct(x, P, y[k] - C @ x, C, R)
        states.append(x)
        covariances.append(P)
    return np.array(states), np.array(covariances), F, Q


def run(estimator, u, y):
    estimate = estimator.start(y[0])
    found = []
    for k in range(len(y)):
        estimate = estimator.update(estimate, u[k - 1] if k else np.zeros(1), y[k])
        found.append(estimate)
    return found


@everyone
@pytest.mark.parametrize("missing", [(), (7, 8, 9, 30)])
def test_on_a_linear_plant_every_estimator_is_the_kalman_filter(name, missing):
    u, y = cart_data(missing=missing)
    states, covariances, _, _ = kalman(u, y)

    found = run(on_cart(name), u, y)

    assert np.array([e.state for e in found]) == pytest.approx(states, rel=1e-4, abs=1e-6)
    assert found[-1].covariance == pytest.approx(covariances[-1], rel=1e-3)


def test_a_longer_horizon_and_more_passes_change_nothing_on_a_linear_plant():
    u, y = cart_data()
    short = run(on_cart("mhe"), u, y)
    long = run(on_cart("mhe", horizon=9, passes=3), u, y)

    assert long[-1].state == pytest.approx(short[-1].state, rel=1e-6)


def test_the_filter_equals_filterpy(recwarn):
    from filterpy.kalman import KalmanFilter

    u, y = cart_data()
    states, covariances, F, Q = kalman(u, y)
    other = KalmanFilter(dim_x=2, dim_z=1)
    other.F, other.Q, other.H, other.R = F, Q, np.eye(1, 2), np.array([[NOISE_M**2]])
    other.x, other.P = states[10][:, None], covariances[10]
    x, P = predict(states[10], covariances[10], F, Q)
    x, P = correct(x, P, y[11] - x[:1], np.eye(1, 2), other.R)
    other.predict()
    other.update(y[11])

    assert x == pytest.approx(other.x.ravel())
    assert pytest.approx(other.P) == P


def test_the_smoother_equals_rauch_tung_striebel():
    u, y = cart_data(40)
    x, P, F, Q = kalman(u, y)
    plant = cart()
    step, (_, d, p) = plant.model.step(DT_S), plant.nominal
    wanted = x.copy()
    for k in range(len(x) - 2, -1, -1):
        ahead, forward = F @ P[k] @ F.T + Q, step(x[k], u[k], d, p).full().ravel()
        wanted[k] += P[k] @ F.T @ np.linalg.solve(ahead, wanted[k + 1] - forward)
    C, R = np.eye(1, 2), np.array([[NOISE_M**2]])
    said, weights, left = [], [], []
    for k in range(len(x)):
        before = F @ P[k - 1] @ F.T + Q if k else P[0]
        at = step(x[k - 1], u[k - 1], d, p).full().ravel() if k else x[0]
        S = C @ before @ C.T + R
        said.append(C.T @ np.linalg.solve(S, y[k] - C @ at))
        weights.append(C.T @ np.linalg.solve(S, C))
        left.append(np.eye(2) - before @ C.T @ np.linalg.solve(S, C))
    every = np.broadcast_to(F, (len(x), 2, 2))

    found = smoothed(x, P, every, np.array(said), np.array(left))
    covariances = smoothed_covariances(P, every, np.array(weights), np.array(left))

    assert found == pytest.approx(wanted, rel=1e-5, abs=1e-8)
    assert (covariances[:-1, 0, 0] < P[:-1, 0, 0]).all()


def in_scales(estimate, plant):
    """Covariance of the states that an estimator has, in units of their scales."""
    sizes = dict(zip(plant.model.states, plant.scale, strict=True))
    size = np.array([sizes[name] for name in estimate.names])
    return estimate.covariance / np.outer(size, size)


@everyone
def test_an_estimator_predicts_when_nothing_is_received(name):
    plant = servo_drive().lean()
    estimator = standard_estimator(name, plant, 2e-3)
    begun = estimator.start(np.array([0.145, 5.65e5, 5.65e5]))

    after = estimator.update(begun, plant.nominal[0], np.full(3, np.nan))

    assert after.pick(OUTPUTS) == pytest.approx([0.145, 5.65e5, 5.65e5], rel=1e-3)
    assert np.linalg.eigvalsh(in_scales(after, plant)).min() > -1e-9


@everyone
def test_a_measurement_never_makes_a_state_less_certain(name):
    """But for a bristle in a mixture: which way it is bent follows from the odds of the regimes."""
    plant = servo_drive().lean()
    estimator, at = standard_estimator(name, plant, 2e-3), np.array([0.145, 5.65e5, 5.65e5])
    begun = estimator.start(at)
    blind = estimator.update(begun, plant.nominal[0], np.full(3, np.nan))
    seeing = estimator.update(begun, plant.nominal[0], at)

    gained = (in_scales(blind, plant) - in_scales(seeing, plant)).diagonal()
    mixed = [name == "imm" and state.endswith(".deflection_m") for state in seeing.names]
    assert gained[np.logical_not(mixed)].min() > -1e-9


@everyone
def test_no_combination_of_states_has_a_variance_below_zero(name):
    """Of a drive that starts to slide: its bristle goes with the speed, and is not corrected."""
    plant = servo_drive().lean()
    estimator, x, u = standard_estimator(name, plant, 2e-3), plant.initial, np.array([5.6])
    step, (_, d, p) = plant.model.compiled_step(2e-3), plant.nominal
    estimate, least = estimator.start(x[[0, 2, 4]]), []
    for _ in range(40):
        x = step(x, u, d, p).full().ravel()
        estimate = estimator.update(estimate, u, x[[0, 2, 4]])
        P = in_scales(estimate, plant)
        spread = np.sqrt(np.maximum(P.diagonal(), 1e-20))
        least.append(np.linalg.eigvalsh(P / np.outer(spread, spread)).min())

    assert min(least) > -1e-6


@everyone
def test_an_estimator_gives_the_same_answer_twice(name):
    u, y = cart_data(20)
    first, again = (run(on_cart(name), u, y)[-1] for _ in range(2))

    assert np.array_equal(first.state, again.state)


def test_an_estimate_that_is_not_there_is_an_error():
    u, y = cart_data(2)
    with pytest.raises(KeyError, match=r"no estimate of .*nothing"):
        run(on_cart("ekf"), u, y)[-1].pick(["nothing"])


@pytest.fixture(scope="module")
def recorded():
    """Three seconds of a drive that is 40 % more viscous than believed, with sensor noise."""
    n = 3000
    command = 4.95 + 0.8 * np.sin(np.pi * 1e-3 * np.arange(n))
    truth = servo_drive().lean().with_values({"friction.viscous_n_s_m": 61.7})
    run = simulate(truth, Recording("run", 1e-3, {COMMAND: command}))
    noise = dict(zip(OUTPUTS, (5e-6, 500.0, 500.0), strict=True))
    rng = np.random.default_rng(0)
    seen = {name: run[name] + size * rng.standard_normal(n) for name, size in noise.items()}
    return truth, run, Recording("run", 1e-3, {COMMAND: command, **seen}, noise=noise)


def test_innovations_of_the_true_plant_are_white_and_of_unit_size(recorded):
    truth, _, recording = recorded
    process = {VELOCITY: 0.02}

    known = recording_filter(truth, recording, process_noise=process)
    found = filter_pass(known, recording).normalised[:, 500:]

    assert found.std(axis=1) == pytest.approx([1.0, 1.0, 1.0], abs=0.15)


def test_the_smoothed_unknown_input_is_the_missing_friction(recorded):
    _, run, recording = recorded
    process = {VELOCITY: 0.1, "chamber_a.pressure_pa": 1e3, "chamber_b.pressure_pa": 1e3}

    known = recording_filter(
        servo_drive().lean(), recording, {VELOCITY: 5.0}, process_noise=process, decimate=5
    )
    found = smooth(known, recording)
    true = -(61.7 - 44.095) * run[VELOCITY][::5] / 2.22

    assert np.corrcoef(found.unknown[0], true)[0, 1] > 0.85
    assert np.median(np.abs(found.unknown[0] - true)) < 2.0 * np.median(found.unknown_deviation[0])


def test_missing_samples_and_missing_outputs_are_passed_over(recorded):
    truth, _, recording = recorded
    channels = dict(recording.channels)
    del channels["chamber_b.pressure_pa"]
    channels["slide.position_m"] = channels["slide.position_m"].copy()
    channels["slide.position_m"][200:250] = np.nan
    part = Recording("part", 1e-3, channels, noise=recording.noise).part(0, 600)

    known = recording_filter(truth, part, process_noise={VELOCITY: 0.1}, decimate=2)
    found = filter_pass(known, part)

    assert found.measured == ("slide.position_m", "chamber_a.pressure_pa")
    assert np.isnan(found.innovations[0, 100:125]).all()
    assert np.isfinite(found.states).all() and np.isfinite(found.log_likelihood)


def test_the_true_plant_is_likelier(recorded):
    truth, _, recording = recorded
    part = recording.part(0, 1000)
    process = {VELOCITY: 0.1}
    filters = [
        recording_filter(plant, part, process_noise=process, decimate=4)
        for plant in (truth, servo_drive().lean())
    ]
    likelihoods = [filter_pass(each, part).log_likelihood for each in filters]

    assert likelihoods[0] > likelihoods[1] + 10.0


def test_intensities_side_by_side_are_as_likely_as_one_after_the_other(recorded):
    _, _, recording = recorded
    part = replace(recording.part(0, 600), starts=(0, 250))
    process = {"chamber_a.pressure_pa": 1e3}
    walks = {VELOCITY: 2.0, "chamber_b.pressure_pa": 1e5}
    tried = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 3.0]])

    many = recording_filter(servo_drive(), part, walks, process_noise=process, decimate=4)
    found = log_likelihoods(many, part, tried)

    for likelihood, factors in zip(found, tried.T, strict=True):
        alone = {n: q * f for (n, q), f in zip(walks.items(), factors, strict=True) if f}
        known = recording_filter(servo_drive(), part, alone, process_noise=process, decimate=4)
        assert likelihood == pytest.approx(filter_pass(known, part).log_likelihood, abs=1e-6)


def test_a_run_that_is_lost_leaves_the_others_as_they_are(recorded):
    _, _, recording = recorded
    part = recording.part(0, 600)
    many = recording_filter(servo_drive(), part, {VELOCITY: 2.0}, decimate=4)
    alone = log_likelihoods(many, part, np.array([[1.0]]))

    found = log_likelihoods(many, part, np.array([[1e20, 1.0, 1e6]]))

    assert list(np.isfinite(found)) == [False, True, False]
    assert found[1] == pytest.approx(alone[0], abs=1e-9)
