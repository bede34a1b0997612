"""Time to linearise a plant with a hundred modes, over that of building its model once.

Run it with ``pytest tests/benchmarks -s --benchmark-enable``.  Process time counts and is printed
as a ratio, which a busy machine changes little; nothing is asserted about it.
"""

import time
from math import inf

import numpy as np
import pytest

from linearize.modes import Interval, hybrid_modes
from linearize.shift_modes import gearbox_modes
from linearize.standard import (
    POSITION,
    regime_modes,
    servo_drive_cuts,
    servo_drive_point,
    standard_modes,
)
from workbench.plants.crr_leg import crr_leg
from workbench.plants.crr_rig import crr_rig
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


def rig_modes():
    """60 modes: valve, flow regimes, friction and stops."""
    return standard_modes(crr_rig())


def leg_modes():
    """216 modes of 12 states in 8 sets of held joints."""
    return standard_modes(crr_leg())


def leg_regimes():
    """1728 modes: the same with the valve of what sticks, and the stops; 27 sets of held joints."""
    return regime_modes(crr_leg())


@pytest.mark.benchmark(timer=time.process_time)
@pytest.mark.parametrize(
    "make",
    [
        servo_drive_modes,
        gearbox_many,
        rig_modes,
        leg_modes,
        pytest.param(leg_regimes, marks=pytest.mark.slow),  # half a minute on a slow machine
    ],
)
def test_a_hundred_modes(benchmark, make):
    hybrid = benchmark.pedantic(make, rounds=3)
    start = time.process_time()
    make()
    taken_s, start = time.process_time() - start, time.process_time()
    _ = hybrid.model.plant.with_effects().model
    built_s = time.process_time() - start
    hundred_s = 100.0 * taken_s / len(hybrid.modes)

    print(f"\n{len(hybrid.modes)} modes in {taken_s:.2f} s of process time, {hundred_s:.2f} s for ")
    print(f"a hundred: {hundred_s / built_s:.1f} times the building of the model, {built_s:.3f} s")
