"""A vessel whose windows last longer than any manoeuvre: advice in words, not a crash."""

import numpy as np
import pytest

from workbench.diagnosis.next_recording import next_recording
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.problem import staged
from workbench.fitting.unknowns import nominal_unknowns
from workbench.fitting.window_length import window_length_s
from workbench.fitting.windows import cut_windows
from workbench.manoeuvres.limits import limits_of
from workbench.recording import Recording
from workbench.rig import default_rig

PRESSURE = "reservoir.pressure_pa"
NOISE = {PRESSURE: 500.0}


@pytest.fixture(scope="module")
def slow():
    """A fit to a decay over 40 s in one window."""
    rng, t = np.random.default_rng(1), 0.02 * np.arange(2000)
    pressure = 5e5 * np.exp(-t / 400.0) + 500.0 * rng.standard_normal(len(t))
    channels = {"valve.command_v": np.full(len(t), 5.0), PRESSURE: pressure}
    decay = Recording("decay", 0.02, channels, NOISE)
    plant = staged(default_rig("servo_reservoir").fit_for(decay))
    windows = cut_windows(plant, [decay], NOISE, window_length_s(plant, [decay]))
    return fit_windows(windows, nominal_unknowns(plant), iterations=1)


def test_no_manoeuvre_is_recommended_that_is_shorter_than_a_window(slow):
    limits = limits_of(slow.plant, slow.windows.recordings)

    assert limits.samples < slow.windows.length
    assert next_recording({"one": slow, "other": slow}) is None
