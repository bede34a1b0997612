"""Windows of a vessel share the shortest recording out: none of them is lost to rounding."""

import numpy as np
import pytest

from workbench.fitting.window_cuts import window_firsts
from workbench.fitting.window_length import window_length_s
from workbench.recording import Recording
from workbench.rig import default_rig

PRESSURE, STEP_S = "reservoir.pressure_pa", 0.01


def filling(n: int) -> Recording:
    """A vessel that fills through its valve, for many of its time constants."""
    t = STEP_S * np.arange(n)
    pressure = 6e5 - 4e5 * np.exp(-(t % 2.0) / 0.4)
    return Recording("f", STEP_S, {"valve.command_v": np.full(n, 8.0), PRESSURE: pressure})


@pytest.mark.parametrize("n", range(700, 725))
def test_less_than_a_sample_for_each_window_is_left_out(n):
    """A length rounded up lost the last window of every recording: a 24th of all there is."""
    recording = filling(n)
    plant = default_rig("servo_reservoir").fit_for(recording)

    length = round(window_length_s(plant, [recording]) / STEP_S)
    count = len(window_firsts(recording, length))

    assert count > 1
    assert n - count * length < count
