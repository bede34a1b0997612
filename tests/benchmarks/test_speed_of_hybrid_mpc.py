"""Speed of the hybrid MPC of the gearbox, beside DAQP with as many binaries.

The same shift from Low to Neutral, whole calls from Python, on the states that the plant passes.
Ours: 484 pairs of plans of two valves over 26 ms, ranked on affine modes, 31 judged by the
nonlinear model.  Rival: ten moves of each valve over 40 ms as 20 binaries, a convex quadratic cost
on the same affine modes at one operating point; it knows neither landing nor stops.

Run it with ``pytest tests/benchmarks -s --benchmark-enable``.  Process time counts, because other
work on the machine would count in wall time; nothing is asserted about it.
"""

import time

import daqp
import numpy as np
import pytest

from controllers.design_file import design
from linearize.discrete import sampled
from linearize.shift_modes import gearbox_modes, valve_flows
from linearize.shifting import STATES
from studies.shift_check import run, shift_filter
from workbench.contracts import Estimate
from workbench.plants.gearbox import gearbox

BLOCKS, BLOCK, BINARY = 10, 4, 16
TO = np.array([[0.0]])


@pytest.fixture(scope="module")
def made():
    return design("hybrid-mpc", gearbox()).controller


@pytest.fixture(scope="module")
def record(made):
    plant = gearbox().lean()
    return run(plant, made, shift_filter(plant, 1e-3), "l-n", 0)


def states(record):
    return record.recording.rows(STATES)[:, ::4].T[:60]


def ours(made, places):
    command, times = made.start(), []
    for x in places:
        begun = time.process_time()
        command = made.step(command, TO, Estimate(STATES, x, np.eye(4)))
        times.append(time.process_time() - begun)
    return np.array(times)


def binary_program():
    """Stacked prediction of ten blocks of two valves: H of the binaries, and g(x)."""
    plant = gearbox()
    mode = gearbox_modes(plant)["Low side 1 charges 2 charges"]
    step, flows = sampled(mode, 1e-3), valve_flows(plant)
    off, on = flows(0.0, 3e5), flows(1.0, 3e5)
    x_free, G = np.eye(4), np.zeros((4, 2 * BLOCKS))
    free, forced, drift, constant = [], [], [], np.zeros(4)
    for k in range(BLOCKS * BLOCK):
        G = step.F @ G
        for valve in (0, 1):
            G[:, 2 * (k // BLOCK) + valve] += step.G[:, valve] * (on - off)[valve]
        constant = step.F @ constant + step.offset + step.G @ off
        x_free = step.F @ x_free
        free.append(x_free)
        forced.append(G.copy())
        drift.append(constant)
    free, forced, drift = np.array(free), np.array(forced), np.array(drift)
    weight = np.array([0.0, 0.0, 1e6, 1e2])
    H = np.einsum("kir,i,kis->rs", forced, weight, forced) + 1e-3 * np.eye(2 * BLOCKS)

    def g(x):
        return np.einsum("kir,i,ki->r", forced, weight, free @ x + drift)

    return 0.5 * (H + H.T), g


def rival(places):
    H, g = binary_program()
    sense = np.full(2 * BLOCKS, BINARY, dtype=np.int32)
    low, high, A = np.zeros(2 * BLOCKS), np.ones(2 * BLOCKS), np.zeros((0, 2 * BLOCKS))
    times, found = [], []
    for x in places:
        begun = time.process_time()
        z, _, flag, _ = daqp.solve(H, g(x), A, high, low, sense)
        times.append(time.process_time() - begun)
        found.append((z, flag))
    return np.array(times), found


def test_a_step_of_the_hybrid_mpc_beside_binaries(benchmark, made, record):
    places = states(record)
    times = benchmark.pedantic(ours, (made, places), rounds=3 if benchmark.enabled else 1)
    theirs, found = rival(places)
    if benchmark.enabled:
        for name, row in (("ours", times), ("20 binaries by DAQP", theirs)):
            median, p99 = 1e3 * np.median(row), 1e3 * np.percentile(row, 99)
            print(
                f"\n{name}: median {median:.2f} ms, p99 {p99:.2f} ms, worst {1e3 * row.max():.2f}"
            )

    assert all(flag == 1 for _, flag in found)
    assert all(np.minimum(abs(z), abs(z - 1.0)).max() < 1e-6 for z, _ in found)
