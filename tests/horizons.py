"""Moving-horizon estimators on two small plants, and data for them."""

import numpy as np
from linear_plant import cart

from estimators.moving_horizon import MovingHorizon

DT_S, NOISE_M, FORCE_NOISE = 0.02, 1e-3, 0.3
VELOCITY = "cart.velocity_m_s"
JOINT_S, NOISE_PA = 2.5e-3, 1e3
COMMAND, PRESSURE, TAU = "valve.pwm", "bellows.pressure_pa", "valve.time_constant_s"


def on_cart(**more):
    given = dict(
        plant=cart(),
        sample_time_s=DT_S,
        measurement_noise={"cart.position_m": NOISE_M},
        process_noise={VELOCITY: FORCE_NOISE},
    )
    return MovingHorizon(**given | more)


def cart_data(n=40, missing=(), seed=3):
    """Commands (n, 1) and measurements (n, 1) of a swinging cart."""
    rng = np.random.default_rng(seed)
    plant, x = cart(), np.array([0.05, 0.0])
    step, (_, d, p) = plant.model.step(DT_S), plant.nominal
    u, y = rng.normal(0.0, 2.0, (n, 1)), np.empty((n, 1))
    for k in range(n):
        y[k] = x[0] + NOISE_M * rng.standard_normal()
        kick = np.array([0.0, FORCE_NOISE * DT_S**0.5 * rng.normal()])
        x = step(x, u[k], d, p).full().ravel() + kick
    y[list(missing)] = np.nan
    return u, y


def run(estimator, u, y):
    estimate, found = estimator.start(y[0]), []
    for k in range(len(y)):
        estimate = estimator.update(estimate, u[k - 1] if k else np.zeros(1), y[k])
        found.append(estimate)
    return found


def on_joint(joint, **more):
    """A horizon with one time constant; the arrival cost knows the pressure to a few kPa."""
    given = dict(
        plant=joint,
        sample_time_s=JOINT_S,
        measurement_noise={PRESSURE: NOISE_PA},
        process_noise={},
        constants={TAU: 5e-3},
        arrival_noise={PRESSURE: 5e4},
        horizon=12,
    )
    return MovingHorizon(**given | more)
