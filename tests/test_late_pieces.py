"""Delays in recordings of several pieces: nothing arrives in one that was sent in another."""

import numpy as np
import pytest

from workbench.effects.timing import ClockDrift, SensorDelay
from workbench.fitting.windows import cut_windows
from workbench.plants.servo_drive import servo_drive
from workbench.recording import Recording, joined
from workbench.simulation import inputs, simulate

DT, LENGTH = 1e-3, 200
COMMAND = "valve.command_v"
VOLTS = (5.8, 5.0, 4.4)
CAUSES = {
    "late commands": (),
    "late outputs": (SensorDelay(name="late", signals=("slide.position_m",), delay_s=7e-3),),
    "drifting clocks": (ClockDrift(name="apart", signals=("slide.position_m",), drift_share=0.01),),
}


def drive(causes):
    """The drive before what acts on its outputs; late commands where nothing does."""
    delay_s = 0.0 if causes else 1e-2
    return servo_drive().with_values({"command_delay.delay_s": delay_s}).lean()


def late(causes):
    return drive(causes).with_effects(*causes)


def runs():
    return [Recording("run", DT, {COMMAND: np.full(LENGTH, volts)}) for volts in VOLTS]


each_cause = pytest.mark.parametrize("causes", CAUSES.values(), ids=CAUSES)


@each_cause
def test_a_piece_runs_as_it_does_alone(causes):
    plant = late(causes)
    whole = simulate(plant, joined(runs()))
    for piece, run in zip(whole.pieces, runs(), strict=True):
        alone = simulate(plant, run)
        for name in plant.measured:
            np.testing.assert_allclose(piece[name], alone[name], rtol=1e-9)


def test_commands_begin_anew_with_each_piece():
    plant = late(())
    u, _ = inputs(plant, joined(runs()))

    np.testing.assert_array_equal(u, np.repeat(VOLTS, LENGTH)[None, :])


@each_cause
def test_windows_know_nothing_of_the_piece_before(causes):
    """What a plant recorded is met from its own states, as they are and not as they are seen."""
    plant = late(causes)
    record = simulate(plant, joined(runs()))
    windows = cut_windows(plant, [record], dict.fromkeys(plant.measured, 1e-6), 0.1)
    firsts = list(windows.firsts[0])
    seen = simulate(drive(causes), joined(runs()))
    starts = seen.rows(plant.state_list)[:, firsts]
    simulated = windows.simulated([plant], starts)[0]
    # what was sent before a window is extrapolated, so that its first samples are left aside
    for k, name in enumerate(plant.measured):
        expected = np.stack([record[name][i + 20 : i + windows.length] for i in firsts])
        np.testing.assert_allclose(simulated[k, :, 20:], expected, rtol=1e-4, atol=1e-6)
