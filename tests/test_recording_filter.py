"""What the filter of a recording starts from, refuses, and survives."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm

from workbench.comparison.horizons import beside_measured
from workbench.filter_passes import posed, recording_filter, smooth
from workbench.filtering import consistent_start, smoothed, smoothed_covariances_behind
from workbench.plant_filter import transition
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import COMMAND, OUTPUTS, servo_drive
from workbench.recording import Recording
from workbench.simulation import simulate

DT_S = 0.02
VELOCITY = "slide.velocity_m_s"


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


def held_back(mask, N=7, seed=0):
    """A filter of a drawn linear system whose gains are those of ``mask``: what it tells by sample.

    Returns H, S and the arguments of :func:`smoothed_covariances_behind`.
    """
    rng, n, n_y = np.random.default_rng(seed), 3, 2
    F, H = 0.6 * rng.standard_normal((N, n, n)), rng.standard_normal((N, n_y, n))
    H[3] = 0.0  # nothing received
    ahead, Q, told = np.eye(n), np.diag([0.1, 0.2, 0.05]), []
    for k in range(N):
        S = H[k] @ ahead @ H[k].T + np.eye(n_y)
        seen = np.linalg.solve(S, H[k]).T
        K = mask[:, None] * (ahead @ seen)
        left = np.eye(n) - K @ H[k]
        P = left @ ahead @ left.T + K @ K.T
        told.append((S, P, seen @ H[k], left, np.hstack([K, seen])))
        ahead = F[k] @ (P + Q / 2) @ F[k].T + Q / 2
    S, P, weights, left, gains = map(np.array, zip(*told, strict=True))
    return H, S, (gains, P, F, weights, left, Q)


def smoothed_errors(H, S, known, drawn):
    """What the smoother misses, (N, n), where the noise is ``drawn``: start, then by sample."""
    gains, P, F, _, left, Q = known
    N, n = len(P), len(Q)
    kick, v = np.split(drawn[n:].reshape(N, -1), [2 * n], axis=1)
    kick = kick * np.tile(np.sqrt(Q.diagonal() / 2), 2)
    x, ahead, true, filtered, said = drawn[:n], np.zeros(n), [], [], []
    for k in range(N):
        e = (H[k] @ (x - ahead) + v[k]) * H[k].any()
        true.append(x)
        filtered.append(ahead + gains[k, :, :2] @ e)
        said.append(H[k].T @ np.linalg.solve(S[k], e))
        x = F[k] @ (x + kick[k, :n]) + kick[k, n:]
        ahead = F[k] @ filtered[k]
    return smoothed(np.array(filtered), P, F, np.array(said), left) - true


@pytest.mark.parametrize("mask", [(1.0, 1.0, 1.0), (1.0, 1.0, 0.0)])
def test_smoothed_covariances_are_those_of_the_errors_whatever_the_gain(mask):
    """Errors are linear in the noise: the sum over every single one of it is the covariance."""
    H, S, known = held_back(np.array(mask))
    every = [smoothed_errors(H, S, known, drawn) for drawn in np.eye(3 + 7 * 8)]
    true = sum(np.einsum("ki,kj->kij", error, error) for error in every)

    np.testing.assert_allclose(smoothed_covariances_behind(*known), true, rtol=0.0, atol=1e-12)


def test_a_smoothed_state_beside_a_bristle_is_never_certain():
    """Its gain is 0, and what holds behind the best gain made variances that were below zero."""
    plant, n = servo_drive().lean(), 400
    command = 4.95 + 0.8 * np.sin(2.0 * np.pi * 5.0 * 1e-3 * np.arange(n))
    noise = dict(zip(OUTPUTS, (5e-6, 500.0, 500.0), strict=True))
    run, rng = simulate(plant, Recording("run", 1e-3, {COMMAND: command})), np.random.default_rng(0)
    seen = {name: run[name] + size * rng.standard_normal(n) for name, size in noise.items()}
    recording = Recording("run", 1e-3, {COMMAND: command, **seen}, noise=noise)
    gas = dict.fromkeys(OUTPUTS[1:], 1e3)
    walking = recording_filter(plant, recording, {VELOCITY: 5.0}, process_noise=gas)
    found = smooth(walking, recording)
    off = found.unknown[0] / np.maximum(found.unknown_deviation[0], 1e-9)

    assert np.square(off).mean() < 2.0


def test_what_no_state_of_is_measured_stands_beside():
    found = beside_measured(gearbox().lean())

    assert "control_chamber.pressure_pa" in found and "floating_piston.position_m" in found
    assert not any(name.startswith(("main_piston", "chamber_")) for name in found)


def test_where_no_output_is_received_for_long_nothing_is_watched():
    """A walk that nobody watches goes on as it likes: that is no missing term."""
    plant, n, silent, reach = servo_drive().lean(), 100, slice(40, 80), 5
    channels = {COMMAND: np.full(n, 5.0)} | {
        name: np.full(n, value) for name, value in zip(OUTPUTS, (0.05, 3e5, 3e5), strict=True)
    }
    for name in OUTPUTS:
        channels[name][silent] = np.nan
    channels[OUTPUTS[0]][90:] = np.nan  # the pressures are heard there
    noise = dict(zip(OUTPUTS, (1e-5, 500.0, 500.0), strict=True))
    recording = Recording("silent", DT_S, channels)
    known = recording_filter(plant, recording, {VELOCITY: 1.0}, measurement_noise=noise)

    watched = smooth(known, recording).watched(reach)

    expected = np.ones(n, dtype=bool)
    expected[40 + reach : 80 - reach] = False
    assert np.array_equal(watched, expected)
