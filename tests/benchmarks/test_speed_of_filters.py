"""One sample of a Kalman filter on the servo drive: ours, filterpy's and a floor, in one run.

Run it with ``pytest tests/benchmarks/test_speed_of_filters.py -m "" -s --benchmark-enable``.  The
4-state model has gas at one temperature and friction without a bristle; the full one has gas
masses and the bristle.  The floor is textbook arithmetic on the same rates: one step that nothing
checks, F = I + A h + (A h)^2 / 2 and the plain correction, written as one expression, compiled and
called through buffers.
"""

import time
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from estimators import ESTIMATORS
from workbench.compiled import compiled
from workbench.filter_update import FilterUpdate
from workbench.filtering import consistent_start
from workbench.gas_volume import ConstantTemperatureLevel
from workbench.parts import Chamber
from workbench.plants.servo_drive import OUTPUTS, ROOM_K, servo_drive
from workbench.rosenbrock import single_step

DT = 1e-3
SENSORS = dict(zip(OUTPUTS, (5e-6, 500.0, 500.0), strict=True))
NOISE = {"slide.velocity_m_s": 0.1, **dict.fromkeys(OUTPUTS[1:], 1e3)}
COMMAND, SEEN = np.array([5.6]), np.array([0.1452, 5.66e5, 5.63e5])
COMPILED_US, PLAIN_US = 10.0, 80.0  # the limits for the small model


def small_drive():
    level = ConstantTemperatureLevel(ROOM_K)
    plant = servo_drive().with_values({"friction.presliding_share": 0.0})
    parts = (replace(p, level=level) if isinstance(p, Chamber) else p for p in plant.parts)
    return replace(plant, parts=tuple(parts)).lean()


PLANTS = {"4 states": small_drive, "full": lambda: servo_drive().lean()}


def ours(plant, name="ekf"):
    return ESTIMATORS[name](
        plant=plant, sample_time_s=DT, measurement_noise=SENSORS, process_noise=NOISE
    )


def started(estimator):
    """An estimate that has settled, so that all are asked in the same place."""
    estimate = estimator.start(np.array([0.145, 5.65e5, 5.65e5]))
    for _ in range(20):
        estimate = estimator.update(estimate, COMMAND, SEEN)
    return estimate


def through_buffers(plant, plain):
    """The one function of a sample, with its arguments in place; in the virtual machine or not."""
    estimator = ours(plant)
    X, P = started(estimator).memory
    update = FilterUpdate(estimator.filter)
    if plain:
        update.__dict__["function"] = update.built
    update(X, P, COMMAND, SEEN, np.ones(3))
    return update.run


def floor(plant):
    """One unchecked step, F by two terms of its series and the correction as one expression."""
    model, (_, d, p) = plant.model, plant.nominal
    n, symbols = len(model.states), model.symbols
    x, u, P, y = (ca.SX.sym(k, *s) for k, s in zip("xuPy", ((n,), (1,), (n, n), (3,)), strict=True))
    later, _ = single_step(symbols, model.rates)(x, u, d, p, DT)
    A = ca.Function("A", [*symbols], [ca.jacobian(model.rates, symbols[0])])(x, u, d, p) * DT
    F = ca.SX.eye(n) + A + A @ A / 2
    gained = np.array([NOISE.get(name, 0.0) for name in model.states])
    P1 = F @ P @ F.T + np.diag(gained**2) * DT
    C = np.eye(n)[[model.states.index(name) for name in OUTPUTS]]
    S = C @ P1 @ C.T + np.diag(np.square([*SENSORS.values()]))
    K = P1 @ C.T @ ca.inv(S)
    results = [later + K @ (y - C @ later), P1 - K @ C @ P1]
    results = ca.cse([ca.densify(r) for r in results])
    function = compiled(ca.Function("floor", [x, u, P, y], results))
    filled = [consistent_start(plant, {}), COMMAND, np.diag(plant.scale**2).ravel(), SEEN]
    return buffered(function, filled)


def buffered(function, filled):
    buffer, run = function.buffer()
    kept = [np.ascontiguousarray(each, dtype=float) for each in filled]
    kept += [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
    for i, each in enumerate(kept[: len(filled)]):
        buffer.set_arg(i, memoryview(each))
    for i, each in enumerate(kept[len(filled) :]):
        buffer.set_res(i, memoryview(each))
    run()
    run_and_keep = (run, buffer, kept)
    return lambda: run_and_keep[0]()


def by_filterpy(plant):
    """Its EKF with our compiled step and exact derivative: set F, step, update."""
    from filterpy.kalman import ExtendedKalmanFilter

    estimator = ours(plant)
    (_, d, p), size = plant.nominal, plant.scale
    X, P = started(estimator).memory
    n, predict = len(X), compiled(estimator.filter.predict)
    outputs = compiled(estimator.filter.plant.model.jacobians)
    r = np.array([*SENSORS.values()])
    other = ExtendedKalmanFilter(dim_x=n, dim_z=3)
    other.Q, other.R = estimator.filter.step_covariance, np.eye(3)
    C = outputs(X * size, COMMAND, d, p)[2].full() * size / r[:, None]

    def run():
        later, _, F = predict(X, P, COMMAND, d, p)
        other.F = F.full()
        other.P = P
        other.x = later.full()
        other.P = other.F @ other.P @ other.F.T + other.Q
        other.update((SEEN / r)[:, None], lambda _: C, lambda z: C @ z)

    return run


def fold(name):
    def made(plant):
        estimator = ours(plant, name)
        estimate = started(estimator)
        return lambda: estimator.update(estimate, COMMAND, SEEN)

    return made


WAYS = {
    "floor": floor,
    "ours, machine code": lambda plant: through_buffers(plant, False),
    "ours, virtual machine": lambda plant: through_buffers(plant, True),
    "ours as a fold": fold("ekf"),
    "ours, unscented": fold("ukf"),
    "ours, scheduled modes": fold("kalman"),
    "ours, interacting models": fold("imm"),
    "filterpy, our model": by_filterpy,
}


@pytest.fixture(scope="module")
def took_us():
    """The least time of each way so far, by plant and name: the floor comes first."""
    return {}


@pytest.mark.slow
@pytest.mark.benchmark(timer=time.perf_counter)
@pytest.mark.parametrize("name", WAYS)
@pytest.mark.parametrize("level", PLANTS)
def test_a_sample_of_the_filter(benchmark, took_us, level, name):
    run = WAYS[name](PLANTS[level]())
    benchmark.pedantic(run, rounds=300, iterations=10, warmup_rounds=5)
    if not benchmark.enabled:
        return
    best = took_us[level, name] = 1e6 * benchmark.stats.stats.min
    median = 1e6 * benchmark.stats.stats.median
    ratio = best / took_us[level, "floor"]
    limit = {"ours, machine code": COMPILED_US, "ours, virtual machine": PLAIN_US}.get(name)
    asked = f"; asked for: {limit:g} us" if limit and level == "4 states" else ""
    print(f"\n{level}, {name}: {best:.1f} us at best, median {median:.1f}, "
          f"{ratio:.1f} times the floor{asked}")  # fmt: skip


def test_the_floor_and_ours_mean_the_same_filter():
    """Both integrate the same rates: a sample differs by the error of two integrators."""
    plant = small_drive()
    estimator = ours(plant)
    X, P = started(estimator).memory
    found = estimator.sample(X, P, COMMAND, SEEN, np.ones(3))
    size = plant.scale
    model, (_, d, p) = plant.model, plant.nominal
    later = model.step(DT)(X * size, COMMAND, d, p).full().ravel()
    fine = X * size
    for _ in range(200):
        fine = fine + DT / 200 * model.f(fine, COMMAND, d, p)[0].full().ravel()

    assert later == pytest.approx(fine, rel=2e-4, abs=1e-6)
    assert np.abs(found.X - X).max() < 0.05
