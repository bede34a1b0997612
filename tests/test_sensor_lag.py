"""Sensors that read late: by one time, and with the whole of their reading."""

import numpy as np
import pytest
from test_valve_effects import DT, TANK, VOLTS, run, tank

from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.simulation import simulate


def test_a_sensor_that_lags_follows_with_its_time_constant():
    name = "sensor_lag@reservoir.pressure"
    plant = PLANTS["servo_reservoir"]().with_values({f"{name}.time_constant_s": 0.05})
    plant = plant.lean()
    result = simulate(plant, Recording("fill", DT, {VOLTS: np.full(1000, 6.0)}))
    true, read = run(tank(), np.full(1000, 6.0), VOLTS)[TANK], result[f"{name}.lagged"] * 1e5

    assert result[TANK][1:] == pytest.approx(read[1:])
    slope = np.gradient(read, DT)
    assert (slope * 0.05 + read)[10:-10] == pytest.approx(true[10:-10], rel=2e-3)


@pytest.mark.parametrize("late_s", [0.0, 3e-5, 2e-3])
def test_a_sensor_lag_is_late_by_its_time_whether_short_or_long(late_s):
    """On a ramp a first-order lag reads what was there its time ago; no share is left to fit."""
    name = "sensor_lag@reservoir.pressure"
    plant = PLANTS["servo_reservoir"]().with_values({f"{name}.time_constant_s": late_s})
    plant = plant.lean([name])
    result = simulate(plant, Recording("fill", DT, {VOLTS: np.full(300, 5.6)}))
    true = run(tank(), np.full(300, 5.6), VOLTS)[TANK]
    late = ((true - result[TANK]) / np.gradient(true, DT))[50:-10]

    assert late == pytest.approx(late_s, rel=0.05, abs=0.0 if late_s else 1e-300)
