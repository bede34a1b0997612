"""Sensors at an end of their range: told with share and value, and left out of noise and fit."""

import numpy as np
import pytest
from recording_files import read, table, text

from studies.demo import DATA
from workbench.consistency import Weight, trusted
from workbench.fitting.noise import measured_noise
from workbench.fitting.noise_source import NoiseSource, recorded_noise
from workbench.plants.crr_rig import crr_rig
from workbench.reading import RecordingWarning, read_recording
from workbench.reading.plausible import stuck_stretch
from workbench.recording import Recording
from workbench.rig import load_rig
from workbench.saturation import saturated
from workbench.simulation import simulate

COMMAND = "valve.command_v"
PRESSURE, PLACE, SPEED = "chamber_a.pressure_pa", "slide.position_m", "slide.velocity_m_s"
SIZE = {PRESSURE: 1e5, PLACE: 0.01, SPEED: 0.1}


def strokes(n=6000):
    """A signal of six periods that spends much of its time near its ends, of size 1, (n,)."""
    return np.tanh(3.0 * np.sin(2 * np.pi * 6 * np.arange(n) / n))


def noisy(noise, n=6000):
    return strokes(n) + noise * np.random.default_rng(3).standard_normal(n)


@pytest.mark.parametrize("name", SIZE)
@pytest.mark.parametrize("top", [0.5, 0.9, 0.98])
def test_every_sample_of_every_clipped_run_is_saturated(name, top):
    values = noisy(0.01)
    clipped = SIZE[name] * np.clip(values, -top, top)

    assert np.array_equal(saturated(name, clipped), np.abs(values) > top)


@pytest.mark.parametrize("every", [2, 5, 10])
def test_a_slow_sensor_on_a_fast_clock_saturates_and_sticks_as_any_other(every):
    """All samples but every second, fifth or tenth are missing."""
    values = np.full(6000 * every, np.nan)
    values[::every] = np.clip(noisy(0.01), -0.9, 0.9)

    assert np.array_equal(saturated(PRESSURE, 1e5 * values), np.abs(values) == 0.9)

    values[::every] = noisy(0.01)
    values[2000 * every : 3500 * every : every] = 0.1
    assert stuck_stretch(values) == (2000 * every, 1499 * every + 1)


@pytest.mark.parametrize("resolution", [1e-4, 1e-3, 5e-3])
def test_a_saturated_sensor_with_a_resolution_finer_than_its_noise_is_seen(resolution):
    values = resolution * np.round(np.minimum(noisy(0.01), 0.8) / resolution)

    assert np.array_equal(saturated(PLACE, values), values == values.max())


@pytest.mark.parametrize("digits", [4, 6, 10])
@pytest.mark.parametrize(("sample_time_s", "lasts_s"), [(1e-3, 4.0), (1e-2, 4.0), (1e-2, 40.0)])
@pytest.mark.parametrize("noise_pa", [0.0, 30.0])
def test_chambers_that_come_to_their_supply_and_to_ambient_are_not_called_saturated(
    sample_time_s, lasts_s, noise_pa, digits
):
    """They creep there, or are there in a sample or two, and leave with full slope."""
    t = sample_time_s * np.arange(round(lasts_s / sample_time_s))
    command = np.where(np.sin(np.pi * t) >= 0.0, 8.25, 2.25)
    record = simulate(crr_rig().lean(), Recording("square", sample_time_s, {COMMAND: command}))
    rng = np.random.default_rng(4)
    for name in crr_rig().measured:
        values = record[name]
        if name.endswith("pressure_pa"):
            values = 250.0 * np.round((values + noise_pa * rng.normal(size=len(t))) / 250.0)
        written = np.array([float(f"{value:.{digits}g}") for value in values])
        assert not saturated(name, written).any(), name


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("resolution", [0.004, 0.02, 0.1])
@pytest.mark.parametrize("name", SIZE)
def test_a_signal_at_its_natural_end_is_not_called_saturated(name, resolution, noise):
    """A coarse sensor of what comes to rest: at a stop, at the supply's pressure."""
    values = resolution * np.round(noisy(noise) / resolution)

    assert not saturated(name, values).any()


def test_a_body_that_stops_at_its_end_and_stands_is_not_called_saturated():
    steps = np.clip(1.5 * np.sin(2 * np.pi * 6 * np.arange(6000) / 6000), -1.0, 1.0)
    for resolution in (1e-9, 1e-3, 1e-2):
        values = 0.1 * resolution * np.round(steps / resolution)
        assert not saturated(PLACE, values).any()
    speed = np.maximum(noisy(0.01), 0.0)
    assert not saturated(SPEED, speed).any()


def test_the_noise_is_that_of_the_samples_that_are_measured():
    for top in (0.5, 0.9, 0.98):
        values = 1e5 * np.clip(noisy(0.003), -top, top)
        recording = Recording("clipped", 1e-3, {PRESSURE: values})

        assert measured_noise([recording], [PRESSURE])[PRESSURE] == pytest.approx(300.0, rel=0.15)


def test_no_saturated_piece_is_taken_for_a_still_one():
    moving = np.minimum(np.sin(2 * np.pi * 6 * np.arange(6000) / 6000), 0.7)
    values = 1e5 * np.minimum(moving + 1e-3 * np.random.default_rng(1).standard_normal(6000), 0.69)
    recording = Recording("clipped", 1e-3, {PRESSURE: values})

    assert recorded_noise(recording, [PRESSURE])[PRESSURE].source is not NoiseSource.STILL


def test_reading_warns_with_share_and_value(tmp_path):
    rows = table(2000)
    rows[:, 2] = np.minimum(rows[:, 2], 5.5)
    share = np.mean(rows[:, 2] == 5.5)

    told = rf"chamber_a\.pressure: saturated at 5\.5 bar in \d+ samples \({share:.1%}\)"
    with pytest.warns(RecordingWarning, match=told):
        read(tmp_path, text(rows))


def test_all_saturated_samples_are_left_out_of_a_fit():
    rig = load_rig(DATA / "rig.toml")
    train = read_recording(rig, DATA / "train.csv")
    top = float(np.quantile(train[PRESSURE], 0.97))
    clipped = np.minimum(train[PRESSURE], top)
    spoiled = Recording("run", train.sample_time_s, {**train.channels, PRESSURE: clipped})

    ((left,),), (finding,) = trusted(rig, [spoiled])

    assert np.array_equal(np.isnan(left[PRESSURE]), clipped == top)
    assert finding.weight is Weight.DOUBT and finding.channel == "chamber_a.pressure"
    assert "saturated at" in finding.what and "left out" in finding.remedy
