"""Speed and error of the rescue robot's rig, arm and leg, beside scipy on the same rates.

Run it with ``pytest tests/benchmarks -s --benchmark-enable``; process time counts, see test_speed.
"""

import time

import numpy as np
import pytest
from conftest import PLANT_MODELS
from reference_solution import reference
from test_speed import peer, times_real_time

from workbench.model import run_of

DT = 1e-3
TIME_S = DT * np.arange(2001)
SINE = 5.25 + 0.5 * np.sin(np.pi * TIME_S)
SQUARE = np.where(TIME_S % 0.5 < 0.25 - 1e-9, 6.5, 4.0)
THREE = 5.25 + 0.5 * np.sin(np.pi * TIME_S + np.arange(3)[:, None])
CASES = {
    ("crr_rig", "sine"): SINE[None],
    ("crr_rig", "steps"): SQUARE[None],
    ("crr_arm", "sine"): SINE[None],
    ("crr_arm", "steps into the stops"): SQUARE[None],
    ("crr_leg", "three sines"): THREE,
}
A_TENTH = {"m": 5e-6, "rad": np.radians(0.005), "pa": 50.0}  # of the sensor noise, physics.md 2
PEER_SAMPLES = 101


def ours(plant, block, command):
    n = command.shape[1] - 1
    run = run_of(block, n)
    return lambda: run(plant.initial, command[:, :-1], np.zeros((0, n)), plant.nominal[2])


def errors(plant, x, exact):
    """Error over a tenth of the sensor noise: worst and root mean square over all outputs."""
    found = []
    for name in plant.measured:
        row = plant.model.states.index(name)
        off = x[row] - exact[row]
        found.append(off / A_TENTH[name.rpartition("_")[2]])
    return np.abs(found).max(), np.sqrt(np.mean(np.square(found)))


@pytest.fixture(params=["virtual machine", "machine code"])
def engine(request):
    return request.param


def built(name, engine):
    plant = PLANT_MODELS[name].lean()
    make = plant.model.compiled_block if engine == "machine code" else plant.model.block
    return plant, make(DT)


@pytest.mark.benchmark(timer=time.process_time)
@pytest.mark.parametrize("case", CASES, ids="-".join)
def test_a_simulation(benchmark, engine, case):
    plant, block = built(case[0], engine)
    command = CASES[case]
    x = benchmark.pedantic(ours(plant, block, command), rounds=5, warmup_rounds=1).full()
    if benchmark.enabled:
        speed = times_real_time(benchmark, command.shape[1] - 1)
        exact = reference(plant, command, DT, contact="stops" in case[1])
        worst, mean = errors(plant, x, exact[:, 1:])
        print(
            f"\n{' '.join(case)}, {engine}: {speed:.0f} times real time; error over a tenth of "
            f"the noise: worst {worst:.3f}, root mean square {mean:.3f}"
        )

    assert np.isfinite(x).all()


@pytest.mark.benchmark(timer=time.process_time)
@pytest.mark.parametrize("method", ["LSODA", "Radau"])
def test_the_rig_by_scipy_on_the_same_rates(benchmark, method):
    plant, block = built("crr_rig", "virtual machine")
    command = SINE[: PEER_SAMPLES if benchmark.enabled else 5]
    x = benchmark.pedantic(peer(plant, method, command), rounds=1)
    end = ours(plant, block, command[None])()[:, -1].full().ravel()
    if benchmark.enabled:
        speed = times_real_time(benchmark, len(command) - 1)
        print(f"\ncrr_rig sine, {method}: {speed:.2f} times real time")

    assert x == pytest.approx(end, rel=1e-3, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("case", [key for key in CASES if key[0] != "crr_leg"], ids="-".join)
def test_the_error_is_below_a_tenth_of_the_sensor_noise(case):
    """Against Radau at rtol 1e-9, over the first half second."""
    plant, block = built(case[0], "virtual machine")
    command = CASES[case][:, :501]
    exact = reference(plant, command, DT, contact="stops" in case[1])
    worst, mean = errors(plant, ours(plant, block, command)().full(), exact[:, 1:])

    assert mean < 1.0
    assert worst < 10.0
