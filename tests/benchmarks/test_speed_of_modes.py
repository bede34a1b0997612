"""Time to linearise a plant with a hundred modes, beside that of building its model once.

Run it with ``pytest tests/benchmarks -s --benchmark-enable``.  Process time counts; nothing is
asserted about it.
"""

import time
from math import inf

import numpy as np
import pytest

from linearize.modes import Interval, hybrid_modes
from linearize.shift_modes import gearbox_modes
from linearize.standard import POSITION, servo_drive_cuts, servo_drive_point
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import servo_drive


def servo_drive_modes():
    """99 modes: 3 of the valve, 3 of friction, 11 places, each point a Newton search."""
    plant, edges = servo_drive(), [-inf, *np.linspace(0.02, 0.27, 10), inf]
    points = np.linspace(0.005, 0.28, 11)
    parts = [Interval(f"{k}", edges[k], edges[k + 1], points[k]) for k in range(11)]
    return hybrid_modes(plant, servo_drive_cuts(plant) | {POSITION: parts}, servo_drive_point)


def gearbox_many():
    """105 modes: 2 sides of 13 pieces, 2 x 2 valves, and Neutral."""
    return gearbox_modes(gearbox(), pieces=13)


@pytest.mark.benchmark(timer=time.process_time)
@pytest.mark.parametrize("make", [servo_drive_modes, gearbox_many])
def test_a_hundred_modes(benchmark, make):
    hybrid = benchmark.pedantic(make, rounds=3)
    start = time.process_time()
    _ = hybrid.model.plant.with_effects().model
    built_s = time.process_time() - start

    print(f"\n{len(hybrid.modes)} modes; the model alone takes {built_s:.3f} s of process time")
