"""What the filter of a recording starts from, refuses, and survives."""

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm

from workbench.filter_passes import recording_filter
from workbench.filtering import consistent_start
from workbench.plant_filter import transition
from workbench.plants.servo_drive import COMMAND, OUTPUTS, servo_drive
from workbench.recording import Recording

DT_S = 0.02


def test_a_start_keeps_the_gas_at_its_temperature():
    plant = servo_drive().lean()
    x = consistent_start(plant, {"slide.position_m": 0.05, "chamber_a.pressure_pa": 3e5})
    temperature = plant.model.quantities("chamber_a.temperature_k")(x, *plant.nominal)

    assert float(temperature) == pytest.approx(293.15)


def test_a_recording_without_outputs_is_an_error():
    recording = Recording("empty", 1e-3, {COMMAND: np.zeros(5)})
    with pytest.raises(ValueError, match="empty holds no output of servo_drive"):
        recording_filter(servo_drive(), recording)


def test_an_output_without_noise_is_an_error():
    recording = Recording("bare", 1e-3, {COMMAND: np.zeros(5), OUTPUTS[0]: np.zeros(5)})
    with pytest.raises(ValueError, match=r"no measurement noise for slide\.position_m"):
        recording_filter(servo_drive(), recording)


def test_a_slope_that_has_died_away_does_not_spoil_the_transition():
    A = ca.MX.sym("A", 2, 2)
    of = ca.Function("F", [A], [transition(A, DT_S)])
    slopes = np.array([[-1.0, 2.0], [1e-157, -30.0]])

    np.testing.assert_allclose(of(slopes).full(), expm(DT_S * slopes), rtol=0.0, atol=1e-4)
