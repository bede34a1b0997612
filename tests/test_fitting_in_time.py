"""Windows see what arrives: delays and pauses act on outputs there as in a simulation."""

import numpy as np
import pytest

from workbench.fitting.windows import cut_windows
from workbench.plants.crr_rig import crr_rig
from workbench.recording import Recording
from workbench.simulation import simulate

DT = 1e-3
NOISE = {"rod.position_m": 5e-5, "cap.pressure_pa": 500.0, "rod_side.pressure_pa": 500.0}


def windows_of(truth, plant):
    """Windows of a run of ``truth``, each started from the true states for ``plant``."""
    time_s = DT * np.arange(2000)
    command = 5.25 + 0.5 * np.sin(2 * np.pi * 2.0 * time_s)
    run = simulate(truth, Recording("run", DT, {"valve.command_v": command}))
    local = truth.with_measured("rod.velocity_m_s")  # which no network delays
    true = simulate(local, Recording("run", DT, {"valve.command_v": command}))
    windows = cut_windows(plant, [run], NOISE)
    firsts = np.array(windows.firsts[0])
    starts = np.array([true[name][firsts] for name in plant.model.states])
    return windows, starts


@pytest.mark.parametrize("redraw_hz", [0.0, 10.0])
def test_a_window_receives_its_outputs_as_late_as_a_simulation(redraw_hz):
    """Redraws at multiples of 0.1 s; windows of 0.2 s begin there, 20 ms may be extrapolated."""
    network = {"packet_pause.redraw_hz": redraw_hz, "command_delay.delay_s": 0.0}
    plant = crr_rig().with_values(network).lean()
    windows, starts = windows_of(crr_rig().with_values(network), plant)
    residual = windows.residuals([plant], starts)[0]
    deaf = windows.residuals([plant.with_values({"sensor_delay.delay_s": 0.0})], starts)[0]

    settled = residual[:, :, 31:]
    assert np.abs(settled).max() < 0.1
    assert np.abs(deaf[:, :, 31:]).max() > 1.0
