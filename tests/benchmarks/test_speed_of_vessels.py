"""Speed and error of the soft joint, the reservoir and the closed chamber, beside scipy.

Run it with ``pytest tests/benchmarks -s --benchmark-enable``; see ``test_speed.py`` for what is
timed.  The errors are those against a tight stiff reference.
"""

import time

import numpy as np
import pytest
from reference_solution import reference
from scipy.integrate import solve_ivp

from workbench.model import run_of
from workbench.plants import PLANTS

DT = 1e-3
TIME_S = DT * np.arange(4001)
STAIRCASE = np.repeat(np.random.default_rng(1).uniform(0.0, 1.0, 40), 100)
SINE_V = 5.0 + 5.0 * np.sin(8 * np.pi * TIME_S)
LEAKING = {"chamber_leak.area_m2": 1e-8, "wall_heat.coefficient_w_m2_k": 20.0}
TENTH_OF_NOISE_PA = {"soft_joint": 100.0, "soft_joint_parametric": 100.0, "servo_reservoir": 50.0}
CASES = {
    "soft_joint": (STAIRCASE, {}),
    "soft_joint_parametric": (STAIRCASE, {}),
    "servo_reservoir": (SINE_V, {}),
    "closed_chamber": (None, LEAKING),
}
PEER_SAMPLES = 200
COMPARED = 300


@pytest.fixture(params=CASES)
def case(request):
    """Plant with its command, None where there is none."""
    command, values = CASES[request.param]
    return PLANTS[request.param]().with_values(values).lean(), command


def ours(plant, block, command, n):
    run = run_of(block, n)
    u = np.zeros((0, n)) if command is None else command[None, :n]
    return lambda: run(plant.initial, u, np.zeros((0, n)), plant.nominal[2])


def exact(plant, command, n):
    """Reference states at n samples behind the first."""
    held = np.zeros((n + 1, 0)) if command is None else command[: n + 1]
    return reference(plant, held, DT)[:, 1:]


@pytest.fixture(params=["virtual machine", "machine code"])
def engine(request):
    return request.param


def step_of(plant, engine):
    return plant.model.compiled_block(DT) if engine == "machine code" else plant.model.block(DT)


@pytest.mark.benchmark(timer=time.process_time)
def test_a_simulation_of_a_vessel(benchmark, case, engine):
    plant, command = case
    n = 4000 if command is None else len(command) - 1
    run = ours(plant, step_of(plant, engine), command, n)
    x = benchmark.pedantic(run, rounds=5, warmup_rounds=1).full()
    if benchmark.enabled:
        speed = DT * n / benchmark.stats.stats.min
        off = np.abs(x - exact(plant, command, n))
        print(f"\n{plant.name}, {engine}: {speed:.0f} times real time, worst {off[0].max():.3g} Pa")

    assert np.isfinite(x).all()


@pytest.mark.parametrize("name", TENTH_OF_NOISE_PA)
def test_the_integrator_errs_by_less_than_a_tenth_of_the_sensor_noise(name):
    """Of 1 kPa on the soft joint and 500 Pa on the reservoir (physics.md 2)."""
    command, values = CASES[name]
    plant = PLANTS[name]().with_values(values).lean()
    x = ours(plant, plant.model.block(DT), command, COMPARED)().full()

    assert np.abs(x - exact(plant, command, COMPARED))[0].max() < TENTH_OF_NOISE_PA[name]


@pytest.mark.benchmark(timer=time.process_time)
@pytest.mark.parametrize("method", ["LSODA", "Radau"])
def test_a_vessel_by_scipy_on_the_same_rates(benchmark, case, method):
    """Sample by sample, as the command demands, with the exact Jacobian."""
    plant, command = case
    if command is None:
        pytest.skip("nothing goes in")
    model, p = plant.model, plant.nominal[2]
    n = PEER_SAMPLES if benchmark.enabled else 5

    def run():
        x = plant.initial
        for u in command[:n]:
            answer = solve_ivp(
                lambda t, x, u=u: model.f(x, u, [], p)[0].full().ravel(),
                (0.0, DT),
                x,
                method,
                jac=lambda t, x, u=u: model.jacobians(x, u, [], p)[0].full(),
                rtol=1e-5,
                atol=1e-7 * plant.scale,
            )
            x = answer.y[:, -1]
        return x

    x = benchmark.pedantic(run, rounds=1)
    end = ours(plant, model.block(DT), command, n)()[:, -1].full().ravel()
    if benchmark.enabled:
        print(f"\n{plant.name}, {method}: {DT * n / benchmark.stats.stats.min:.2f} times real time")

    assert x == pytest.approx(end, rel=1e-3, abs=1e-4)
