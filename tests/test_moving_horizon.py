"""What the moving-horizon estimator must equal, hold, and say."""

import numpy as np
import pytest
from horizons import (
    COMMAND,
    DT_S,
    FORCE_NOISE,
    JOINT_S,
    NOISE_M,
    NOISE_PA,
    PRESSURE,
    TAU,
    VELOCITY,
    cart_data,
    on_cart,
    on_joint,
    run,
)
from linear_plant import cart
from scipy.optimize import least_squares

import estimators.moving_horizon as moving_horizon
from estimators.moving_horizon import MovingHorizon
from estimators.nearest_inside import OutsideError
from workbench.errors import UnknownNameError
from workbench.plants import PLANTS
from workbench.plants.servo_drive import COMMAND as VALVE
from workbench.plants.servo_drive import OUTPUTS, servo_drive
from workbench.polytropic import with_polytropic_gas
from workbench.recording import Recording
from workbench.simulation import simulate

DRIFT = 5.0


def kalman(u, y, drift):
    """States and covariances of the textbook filter, written out for the step of the cart.

    Where ``drift`` is above 0 there is a third state, an acceleration that wanders.
    """
    plant = cart()
    step, (_, d, p) = plant.model.step(DT_S), plant.nominal
    n = 3 if drift else 2
    at_rest = step([0.0, 0.0], [0.0], d, p).full().ravel()
    F, G = np.eye(n), np.zeros((n, 1))
    for k in range(2):
        F[:2, k] = step(np.eye(2)[k], [0.0], d, p).full().ravel() - at_rest
    G[:2, 0] = step([0.0, 0.0], [1.0], d, p).full().ravel() - at_rest
    if drift:  # an acceleration acts as a force of the mass times as much
        F[:2, 2] = G[:2, 0] * plant.values["cart.mass_kg"]
    half = np.diag([0.0, FORCE_NOISE**2, drift**2][:n]) * DT_S / 2
    H = np.eye(1, n)
    x = np.array([y[0, 0], 0.0, 0.0][:n])
    P = np.diag([*plant.scale**2, drift**2][:n])
    states, covariances = [], []
    for k in range(len(y)):
        x = F @ x + G @ (u[k - 1] if k else np.zeros(1))
        P = F @ (P + half) @ F.T + half
        if np.isfinite(y[k, 0]):
            K = P @ H.T / (H @ P @ H.T + NOISE_M**2)
            x = x + K[:, 0] * (y[k] - H @ x)
            P = (np.eye(n) - K @ H) @ P
        states.append(x)
        covariances.append(P)
    return np.array(states), np.array(covariances)


@pytest.mark.parametrize("horizon", [2, 7])
@pytest.mark.parametrize("drift", [0.0, DRIFT])
def test_on_a_linear_plant_it_is_the_kalman_filter_to_1e_8(horizon, drift):
    """Also with samples missing, and with a random walk in the window."""
    u, y = cart_data(missing=(7, 8, 9, 30))
    states, covariances = kalman(u, y, drift)
    unknown = {VELOCITY: drift} if drift else {}

    found = run(on_cart(horizon=horizon, unknown_inputs=unknown), u, y)

    scale = np.abs(states[:, :2]).max(axis=0)
    off = np.array([e.state for e in found]) - states[:, :2]
    assert np.abs(off / scale).max() < 1e-8
    np.testing.assert_allclose(found[-1].covariance, covariances[-1][:2, :2], rtol=1e-8)
    if drift:
        assert found[-1].notes[f"unknown {VELOCITY}"] == pytest.approx(states[-1, 2], rel=1e-8)
    assert not any(e.notes["fallback"] for e in found)


@pytest.fixture(scope="module")
def joint():
    return PLANTS["soft_joint_parametric"]().lean()


@pytest.fixture(scope="module")
def filling(joint):
    """Commands (60, 1), pressures (60, 1) of a bellows whose time constant is 0.08 s, not 0.05."""
    u = np.repeat([0.62, 0.55, 0.44], 20)
    slow = joint.with_values({TAU: 0.08})
    truth = simulate(slow, Recording("truth", JOINT_S, {COMMAND: u}))[PRESSURE]
    noise = NOISE_PA * np.random.default_rng(5).standard_normal(len(u))
    return u[:, None], (truth + noise)[:, None]


def by_scipy(estimator, window, bound=np.inf):
    """The same problem by scipy, from the prior and the samples of a window: newest (p, tau).

    Unknown are p and tau at the first node and, where there is process noise, its two halves at
    every sample, each in units of its deviation.
    """
    functions, plant = estimator.functions, estimator.plant
    read = {name: functions.part(window.tape, name) for name in functions.sizes}
    scale, M = functions.found.scale, estimator.horizon
    root = np.linalg.cholesky(read["prior"][:, 1:])
    kick = np.sqrt(functions.found.step_covariance[0, 0] / 2.0)
    at = plant.model.parameters.index(TAU)
    step, (_, d, p) = plant.model.step(JOINT_S), plant.nominal

    def path(unknown):
        X = read["prior"][:, 0] + root @ unknown[:2]
        tau = p[at] + scale[1] * X[1]
        values = p.copy()
        values[at] = tau
        pressures = [X[0]]
        for k in range(M - 1):
            a, b = kick * unknown[2 + 2 * k : 4 + 2 * k] if kick else (0.0, 0.0)
            now = scale[0] * (pressures[-1] + a)
            pressures.append(float(step(now, read["u"][:, k], d, values)) / scale[0] + b)
        return scale[0] * np.array(pressures), tau

    def residuals(unknown):
        pressures, tau = path(unknown)
        errors = read["received"][0] * (read["y"][0] - pressures / NOISE_PA)
        beyond = 1e6 * max(tau - bound, 0.0)  # the bound as a wall
        return np.hstack([unknown, errors, beyond])

    start = np.zeros(2 + (2 * (M - 1) if kick else 0))
    found = least_squares(residuals, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=2000)
    pressures, tau = path(found.x)
    return pressures[-1], tau


@pytest.mark.parametrize("process_noise", [{}, {PRESSURE: 2e4}], ids=["none", "some"])
def test_converged_it_is_what_scipy_finds(joint, filling, process_noise):
    """With and without process noise in the window."""
    u, y = filling
    estimator = on_joint(joint, passes=25, process_noise=process_noise)
    found = run(estimator, u[:45], y[:45])[-1]

    pressure_pa, tau_s = by_scipy(estimator, found.memory)

    assert found.state[0] == pytest.approx(pressure_pa, rel=1e-6)
    assert found.notes[f"estimated {TAU}"] == pytest.approx(tau_s, rel=1e-5)


def test_at_a_bound_it_is_still_what_scipy_finds(joint, filling):
    u, y = filling
    estimator = on_joint(joint, passes=25, bounds={TAU: (0.02, 0.06)})
    found = run(estimator, u[:45], y[:45])[-1]

    pressure_pa, tau_s = by_scipy(estimator, found.memory, bound=0.06)

    assert found.notes["bounded"] == 1.0
    assert found.notes[f"estimated {TAU}"] == pytest.approx(0.06, rel=1e-9)
    assert tau_s == pytest.approx(0.06, rel=1e-3)
    assert found.state[0] == pytest.approx(pressure_pa, abs=20.0)


def test_the_time_constant_is_found_within_what_the_noise_leaves(joint, filling):
    found = run(on_joint(joint, horizon=30), *filling)

    assert found[-1].notes[f"estimated {TAU}"] == pytest.approx(0.08, rel=0.03)


def test_the_dearer_a_movement_the_less_a_constant_moves(joint, filling):
    moved = [
        abs(
            run(on_joint(joint, constants={TAU: size}), *filling)[20].notes[f"estimated {TAU}"]
            - 0.05
        )
        for size in (1e-5, 1e-4, 1e-3)
    ]

    assert moved[0] < moved[1] < moved[2]


def test_one_state_and_nothing_unknown_is_the_extended_filter(joint, filling, monkeypatch):
    """One sample of 2.5 ms takes three steps of the integrator."""
    monkeypatch.setenv("WORKBENCH_NO_COMPILER", "1")
    u, y = filling
    estimator = on_joint(joint, constants={}, arrival_noise={}, process_noise={PRESSURE: 2e4})
    found, filtered = (run(each, u[:20], y[:20])[-1] for each in (estimator, estimator.kalman))

    assert found.state == pytest.approx(filtered.state, rel=1e-4)


def test_bounds_hold_at_every_sample(joint, filling):
    u, y = filling
    bounds = {TAU: (0.045, 0.055), PRESSURE: (1.0e5, 1.7e5)}
    found = run(on_joint(joint, bounds=bounds), u, y)
    tau_s = np.array([e.notes[f"estimated {TAU}"] for e in found])
    pressure_pa = np.array([e.state[0] for e in found])

    assert tau_s.min() >= 0.045 - 1e-12 and tau_s.max() <= 0.055 + 1e-12
    assert pressure_pa.max() <= 1.7e5 + 1e-6 and y.max() > 1.71e5
    assert any(e.notes["bounded"] for e in found) and not all(e.notes["bounded"] for e in found)


def test_late_the_estimate_is_that_of_the_kalman_filter_and_says_so(joint, filling):
    u, y = filling
    late = on_joint(joint, deadline_s=0.0)
    found, filtered = run(late, u, y), run(late.kalman, u, y)

    assert all(e.notes["late"] and e.notes["fallback"] for e in found)
    np.testing.assert_allclose(found[-1].state, filtered[-1].state, rtol=1e-12)
    np.testing.assert_allclose(found[-1].covariance, filtered[-1].covariance, rtol=1e-9)


def test_a_solve_that_fails_falls_back_and_goes_on(joint, filling, monkeypatch):
    u, y = filling

    def fails(*_):
        raise OutsideError("no estimate inside the bounds")

    bounds = {TAU: (0.02, 0.06)}
    before = run(on_joint(joint, bounds=bounds), u[:30], y[:30])[-1]
    assert before.notes["bounded"] == 1.0
    estimator = on_joint(joint, bounds=bounds)
    with monkeypatch.context() as patched:
        patched.setattr(moving_horizon, "nearest_inside", fails)
        lost = estimator.update(before, u[29], y[30])
    after = estimator.update(lost, u[30], y[31])

    assert lost.notes["fallback"] == 1.0 and "step" not in lost.notes
    assert np.isfinite(lost.state).all() and after.notes["fallback"] == 0.0
    assert after.state[0] == pytest.approx(y[31, 0], abs=5.0 * NOISE_PA)


def test_a_run_goes_on_from_any_of_its_estimates(joint, filling):
    u, y = filling
    estimator = on_joint(joint)
    whole = run(estimator, u, y)
    again = whole[19]
    for k in range(20, len(y)):
        again = estimator.update(again, u[k - 1], y[k])

    np.testing.assert_array_equal(again.state, whole[-1].state)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"horizon": 1}, "a horizon has 2 samples and 1 pass at least"),
        ({"constants": {TAU: 0.0}}, "moves by 0.0, expected above 0"),
        ({"bounds": {TAU: (0.1, 0.1)}}, "bounds are 0.1 and 0.1, expected lower first"),
    ],
)
def test_a_horizon_without_sense_is_refused(joint, wrong, message):
    with pytest.raises(ValueError, match=message):
        on_joint(joint, **wrong)


@pytest.mark.parametrize(
    "wrong", [{"constants": {"valve.tau": 1.0}}, {"bounds": {"bellows.pressure": (0.0, 1.0)}}]
)
def test_what_the_plant_does_not_have_is_refused_with_the_nearest(joint, wrong):
    with pytest.raises(UnknownNameError, match="has no"):
        on_joint(joint, **wrong)


def test_beside_four_states_of_the_servo_drive_a_parameter_is_found():
    """Viscous friction 40 % larger than believed, 0.2 s of sliding, all sensors with noise."""
    drive = (
        with_polytropic_gas(servo_drive()).with_values({"friction.presliding_share": 0.0}).lean()
    )
    viscous, n = "friction.viscous_n_s_m", 200
    u = 5.9 + 0.3 * np.sin(2.0 * np.pi * 1e-3 * np.arange(n))
    truth = drive.with_values({viscous: 61.7})
    made = simulate(truth, Recording("truth", 1e-3, {VALVE: u}))
    noise = dict(zip(OUTPUTS, (5e-6, 500.0, 500.0), strict=True))
    rng = np.random.default_rng(0)
    y = made.rows(OUTPUTS).T + np.array([*noise.values()]) * rng.standard_normal((n, 3))
    estimator = MovingHorizon(
        plant=drive,
        sample_time_s=1e-3,
        measurement_noise=noise,
        process_noise={"slide.velocity_m_s": 0.05},
        constants={viscous: 1.0},
        horizon=30,
    )

    found = run(estimator, u[:, None], y)

    assert found[-1].notes[f"estimated {viscous}"] == pytest.approx(61.7, rel=0.03)
    velocity = np.array([e.state[1] for e in found[50:]])
    assert np.abs(velocity - made["slide.velocity_m_s"][50:]).max() < 0.01
    assert sum(e.notes["fallback"] for e in found) <= 4
