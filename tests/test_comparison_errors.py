"""Errors of a comparison by themselves: fit percent, chi2/n, missing samples, what fails."""

from types import SimpleNamespace

import numpy as np
import pytest

from workbench.comparison import horizons
from workbench.comparison.compare import _worst, signal_error
from workbench.recording import Recording
from workbench.rig import default_rig

PRESSURE = "bellows.pressure_pa"


def test_the_fit_percent_is_that_of_system_identification():
    y, yhat = np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 2.0, 3.0, 5.0])

    found = signal_error(y, yhat, 0.1)

    assert found.fit_percent == pytest.approx(100.0 * (1.0 - 1.0 / np.sqrt(5.0)))
    assert found.rmse == pytest.approx(0.5)


def test_what_only_noise_is_left_of_has_a_chi2_of_one():
    noise = 0.1 * np.random.default_rng(5).standard_normal(4000)

    assert signal_error(noise, np.zeros(4000), 0.1).chi2_per_sample == pytest.approx(1.0, abs=0.1)


def test_missing_samples_count_for_nothing():
    y = np.array([1.0, np.nan, 3.0])

    assert signal_error(y, np.array([1.0, 9.0, 3.0]), 0.1).rmse == 0.0
    assert np.isnan(signal_error(np.full(3, np.nan), y, 0.1).rmse)


def test_the_worst_stretches_reach_the_end_and_over_no_gap():
    """Windows of 0.2 s in pieces of 0.3 and 0.25 s; errors around the gap and at the very end."""
    squared = np.zeros(550)
    squared[290:300], squared[300:320], squared[540:] = 1.0, 2.0, 3.0
    recording = Recording("two pieces", 1e-3, {PRESSURE: squared}, starts=(0, 300))

    found = [(s.start_s, s.end_s, s.share_of_error) for s in _worst(squared, recording, 0.2)]

    assert np.array(found) == pytest.approx(
        np.array([[0.3, 0.5, 4 / 8], [0.5, 0.55, 3 / 8], [0.2, 0.3, 1 / 8]])
    )


def test_a_stretch_with_next_to_no_error_is_none_of_the_worst():
    squared = np.repeat([1.0, 1e-3, 0.0], 200)
    recording = Recording("three windows", 1e-3, {PRESSURE: squared})

    (span,) = _worst(squared, recording, 0.2)
    assert (span.start_s, span.end_s) == (0.0, 0.2)


def test_what_fails_in_the_windows_is_not_taken_for_a_short_recording(monkeypatch):
    def broken(*_):
        raise ValueError("a bug")

    joint, n = default_rig("soft_joint"), 400
    channels = {"valve.pwm": np.full(n, 0.5), "bellows.pressure_pa": np.linspace(1.2e5, 1.3e5, n)}
    recording = Recording("fill", 2.5e-3, channels)
    plant = joint.fit_for(recording)
    nothing = SimpleNamespace(states=None)
    monkeypatch.setattr(horizons, "_followed", lambda *_: (nothing, []))
    monkeypatch.setattr(horizons, "_one_step", lambda *_: {PRESSURE: np.zeros(n)})
    monkeypatch.setattr(horizons, "_free_run", lambda *_: dict.fromkeys(plant.model.states))
    monkeypatch.setattr(horizons, "_windows", broken)

    with pytest.raises(ValueError, match="a bug"):
        horizons.foretold(SimpleNamespace(plant=plant, recording=recording), {PRESSURE: 1e3})
