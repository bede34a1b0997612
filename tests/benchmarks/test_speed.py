"""Speed of a simulation in the virtual machine and as machine code, beside scipy on model.f.

Run it with ``pytest tests/benchmarks -s --benchmark-enable``.  Process time of the whole process
counts, because other work on the machine would count in wall time; nothing is asserted about time.
"""

import time
from functools import partial

import casadi as ca
import numpy as np
import pytest
from reference_solution import reference
from scipy.integrate import solve_ivp

from workbench.compiled import compiled
from workbench.model import run_of
from workbench.rosenbrock import single_step

DT = 1e-3
CASES = {
    "sine": 4.95 + 0.8 * np.sin(np.pi * DT * np.arange(4001)),
    "stick-slip": np.full(20_001, 5.385),
    "full voltage": np.where(DT * np.arange(4001) % 1.0 < 0.5 - 1e-9, 10.0, 0.0),
}
PEER_SAMPLES = 501  # of the sine; the peer restarts at every one, as the command demands


def ours(drive, block, command):
    n = len(command) - 1
    run = run_of(block, n)
    return lambda: run(drive.initial, command[None, :-1], np.zeros((0, n)), drive.nominal[2])


def peer(drive, method, command):
    """Scipy, sample by sample, with the exact Jacobian, at a tolerance that meets our accuracy."""
    model, p = drive.model, drive.nominal[2]

    def run():
        x = drive.initial
        for u in command[:-1]:
            answer = solve_ivp(
                lambda t, x, u=u: model.f(x, u, [], p)[0].full().ravel(),
                (0.0, DT),
                x,
                method,
                jac=lambda t, x, u=u: model.jacobians(x, u, [], p)[0].full(),
                rtol=1e-5,
                atol=1e-5 * drive.scale * 1e-2,
            )
            x = answer.y[:, -1]
        return x

    return run


def times_real_time(benchmark, samples):
    """Simulated time over process time, the best of the rounds."""
    return DT * samples / benchmark.stats.stats.min


@pytest.fixture(params=["virtual machine", "machine code"])
def engine(request, drive):
    compiled = request.param == "machine code"
    block = drive.model.compiled_block(DT) if compiled else drive.model.block(DT)
    return request.param, block


@pytest.mark.benchmark(timer=time.process_time)
@pytest.mark.parametrize("case", CASES)
def test_a_simulation_of_the_drive(benchmark, drive, engine, case):
    command, (name, block) = CASES[case], engine
    x = benchmark.pedantic(ours(drive, block, command), rounds=5, warmup_rounds=1).full()
    if benchmark.enabled:
        speed = times_real_time(benchmark, len(command) - 1)
        exact = reference(drive, command, DT, contact=case == "full voltage")
        print(f"\n{case}, {name}: {speed:.0f} times real time, {errors(drive, x, exact)}")

    assert np.isfinite(x).all()


@pytest.mark.benchmark(timer=time.process_time)
def test_the_yardstick(benchmark, drive, engine):
    """RODAS3 in two fixed steps per ms, unchecked, as a measure of the machine of the day.

    On the machine of the project's yardsticks (design/tools.md section 5) these steps of the same
    plant ran 90 times faster than real time in the virtual machine and 317 times as machine code.
    """
    command, name = CASES["sine"], engine[0]
    symbols = (ca.MX.sym(k, s.numel()) for k, s in zip("xudp", drive.model.symbols, strict=True))
    x, u, d, p = symbols
    one = single_step(drive.model.symbols, drive.model.rates)
    half = one(x, u, d, p, DT / 2)[0]
    two = ca.Function("two", [x, u, d, p], [one(half, u, d, p, DT / 2)[0]])
    two = compiled(two) if name == "machine code" else two
    n = len(command) - 1
    values = ca.repmat(drive.nominal[2], 1, n)
    run = partial(two.mapaccum(n), drive.initial, command[None, :-1], np.zeros((0, n)), values)
    x = benchmark.pedantic(run, rounds=5, warmup_rounds=1).full()
    if benchmark.enabled:
        there = {"virtual machine": 90, "machine code": 317}[name]
        speed = times_real_time(benchmark, n)
        print(f"\n{name}, two fixed steps per ms: {speed:.0f} times real time, there {there}")

    assert np.isfinite(x).all()


def errors(drive, x, exact):
    """Errors at all samples against the tight reference, as text."""
    off = dict(zip(drive.model.states, np.abs(x - exact[:, 1:]), strict=True))
    position_mm = 1e3 * off["slide.position_m"]
    pressure_pa = max(off[f"chamber_{side}.pressure_pa"].max() for side in "ab")
    return (
        f"worst {position_mm.max():.5f} mm, mean {position_mm.mean():.5f} mm, {pressure_pa:.0f} Pa"
    )


@pytest.mark.benchmark(timer=time.process_time)
@pytest.mark.parametrize("method", ["LSODA", "Radau"])
def test_a_simulation_by_scipy_on_the_same_rates(benchmark, drive, engine, method):
    name, block = engine
    command = CASES["sine"][: PEER_SAMPLES if benchmark.enabled else 5]
    x = benchmark.pedantic(peer(drive, method, command), rounds=1)
    run = ours(drive, block, command)
    start = time.process_time()
    for _ in range(5):
        end = run()[:, -1].full().ravel()
    own_s = (time.process_time() - start) / 5
    if benchmark.enabled:
        speed = times_real_time(benchmark, len(command) - 1)
        ratio = DT * (len(command) - 1) / own_s / speed
        print(f"\nsine, {method}: {speed:.2f} times real time; our {name} {ratio:.0f} times faster")

    assert x == pytest.approx(end, rel=1e-3, abs=1e-4)
