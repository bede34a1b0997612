"""What the filter of a recording starts from, refuses, and survives."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm

from workbench.comparison.horizons import beside_measured
from workbench.filter_passes import posed, recording_filter
from workbench.filtering import consistent_start
from workbench.plant_filter import transition
from workbench.plants.gearbox import gearbox
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


def test_what_is_considered_is_not_corrected_but_its_uncertainty_counts():
    """Of the drive, whose pressures say much of its valve: only the others are corrected."""
    plant, n = servo_drive().lean(), 3
    channels = {COMMAND: np.full(n, 5.5)} | {
        name: np.full(n, value) for name, value in zip(OUTPUTS, (0.05, 3e5, 3e5), strict=True)
    }
    recording = Recording("still", 1e-3, channels)
    noise = dict(zip(OUTPUTS, (1e-5, 500.0, 500.0), strict=True))
    masses = ("chamber_a.mass_kg", "chamber_b.mass_kg")
    plain = recording_filter(plant, recording, measurement_noise=noise)
    held = replace(plain, considered=masses)
    rows = [plain.plant.model.states.index(name) for name in masses]
    start, columns = posed(plain, recording)
    P = plain.start_covariance + 0.3 * np.outer(*[np.diag(plain.start_covariance) ** 0.5] * 2)
    u, d, p, y, received = (each[:, 0] for each in columns)
    y = y + 5.0 * np.array([*noise.values()])
    free, kept = (f.correct(start, P, u, d, p, y, received) for f in (plain, held))

    assert np.abs(free[0].full().ravel() - start)[rows].min() > 0.0
    np.testing.assert_array_equal(kept[0].full().ravel()[rows], start[rows])
    np.testing.assert_allclose(kept[1].full()[rows, rows], P[rows, rows])
    np.testing.assert_allclose(free[2].full(), kept[2].full())


def test_what_no_state_of_is_measured_stands_beside():
    found = beside_measured(gearbox().lean())

    assert "control_chamber.pressure_pa" in found and "floating_piston.position_m" in found
    assert not any(name.startswith(("main_piston", "chamber_")) for name in found)
