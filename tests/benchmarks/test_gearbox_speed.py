"""Speed of the gearbox actuator: four shifts with their releases in 1.09 s, beside scipy.

Run it with ``pytest tests/benchmarks -s --benchmark-enable``.  Process time of the whole process
counts, because other work on the machine would count in wall time; nothing is asserted about time.

What the time goes into, printed too: one step of the integrator is a fixed sequence of arithmetic,
most samples take one, and the milliseconds in which a valve switches or a piston lands take tens to
hundreds.  The floor is the price of one step for every sample.
"""

import time

import numpy as np
import pytest
from gearbox_shifts import ALL_SHIFTS, POSITION, held
from reference_solution import reference
from scipy.integrate import solve_ivp

from workbench.model import run_of
from workbench.plants.gearbox import gearbox
from workbench.rosenbrock import single_step

DT = 1e-3
PEER_SAMPLES = 61  # the first shift and 10 ms of its release


@pytest.fixture(scope="module")
def actuator():
    return gearbox().lean()


@pytest.fixture(params=["virtual machine", "machine code"])
def engine(request, actuator):
    compiled = request.param == "machine code"
    block = actuator.model.compiled_block(DT) if compiled else actuator.model.block(DT)
    return request.param, block


def ours(plant, block, commands):
    n = commands.shape[1] - 1
    run = run_of(block, n)
    return lambda: run(plant.initial, commands[:, :-1], np.zeros((0, n)), plant.nominal[2])


def peer(plant, method, commands):
    """Scipy, sample by sample, with the exact Jacobian."""
    model, p = plant.model, plant.nominal[2]

    def run():
        x = plant.initial
        for u in commands[:, :-1].T:
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

    return run


@pytest.mark.benchmark(timer=time.process_time)
def test_four_shifts(benchmark, actuator, engine):
    commands, (name, block) = held(ALL_SHIFTS, DT), engine
    x = benchmark.pedantic(ours(actuator, block, commands), rounds=5, warmup_rounds=1).full()
    if benchmark.enabled:
        speed = DT * (commands.shape[1] - 1) / benchmark.stats.stats.min
        exact = reference(actuator, commands, DT, contact=True)[:, 1:]
        off = dict(zip(actuator.model.states, np.abs(x - exact), strict=True))
        place_um = 1e6 * off[POSITION]
        pressure_pa = max(off[f"chamber_{k}.pressure_pa"].max() for k in (1, 2))
        print(
            f"\nfour shifts, {name}: {speed:.1f} times real time, worst {place_um.max():.2f} um, "
            f"mean {place_um.mean():.3f} um, {pressure_pa:.0f} Pa"
        )

    assert np.isfinite(x).all()


def test_where_the_time_goes(benchmark, actuator):
    """Price of one step in the virtual machine, and the floor of one step for every sample."""
    model, (_, _, p) = actuator.model, actuator.nominal
    one = single_step(model.symbols, model.rates)
    steps = 1000
    many = one.map(steps)
    arguments = [np.tile(np.reshape(a, (-1, 1)), (1, steps)) for a in (actuator.initial, [0, 0])]
    arguments += [np.zeros((0, steps)), np.tile(p[:, None], (1, steps)), np.full((1, steps), 1e-5)]
    benchmark.pedantic(lambda: many(*arguments), rounds=5, warmup_rounds=1)
    if benchmark.enabled:
        step_s = benchmark.stats.stats.min / steps
        print(
            f"\none step: {one.n_instructions()} instructions, rates {model.f.n_instructions()}, "
            f"{1e6 * step_s:.0f} us; one per sample would be {DT / step_s:.0f} times real time"
        )

    assert one.n_instructions() < 5000


@pytest.mark.benchmark(timer=time.process_time)
@pytest.mark.parametrize("method", ["LSODA", "Radau"])
def test_a_shift_by_scipy_on_the_same_rates(benchmark, actuator, engine, method):
    name, block = engine
    commands = held(ALL_SHIFTS, DT)[:, : PEER_SAMPLES if benchmark.enabled else 3]
    x = benchmark.pedantic(peer(actuator, method, commands), rounds=1)
    run = ours(actuator, block, commands)
    start = time.process_time()
    for _ in range(5):
        end = run()[:, -1].full().ravel()
    own_s = (time.process_time() - start) / 5
    if benchmark.enabled:
        speed = DT * (commands.shape[1] - 1) / benchmark.stats.stats.min
        ratio = DT * (commands.shape[1] - 1) / own_s / speed
        print(f"\n{method}: {speed:.2f} times real time; our {name} {ratio:.0f} times faster")

    assert x[0] == pytest.approx(end[0], rel=1e-3, abs=1e-5)
