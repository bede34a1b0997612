"""Limits of what is noisy: neither noise nor a glitch is a speed, place or pressure of a rig."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from conftest import PLANT_MODELS

from workbench.manoeuvres.limits import HIGHER, SPEED_S, limits_of
from workbench.recording import Recording

ARM, DRIVE = PLANT_MODELS["crr_arm"], PLANT_MODELS["servo_drive"]
ANGLE, PLACE, A = "joint.angle_rad", "slide.position_m", "chamber_a.pressure_pa"


def recording(plant, output, values, sample_time_s):
    signals = (*plant.commands, *plant.measured_inputs)
    rows = {signal.name: np.full(len(values), signal.nominal) for signal in signals}
    rows |= {name: np.full(len(values), 4e5) for name in plant.measured}
    return Recording("made up", sample_time_s, rows | {output: values})


def there_and_back(low, high, period_s, sample_time_s, seconds=4.0):
    phase = np.arange(0.0, seconds, sample_time_s) / period_s
    return low + (high - low) * (1.0 - np.abs(1.0 - 2.0 * (phase % 1.0)))


def slide(values, sample_time_s=1e-3):
    return recording(DRIVE, PLACE, values, sample_time_s)


def axis(*recordings, plant=DRIVE):
    return limits_of(plant, recordings).axes[0]


@pytest.mark.parametrize(("sample_time_s", "share"), [(1e-4, 0.12), (1e-3, 0.35)])
def test_the_fastest_recorded_speed_is_none_of_sensor_noise(sample_time_s, share):
    """24 deg/s under noise of 0.05 deg: ten samples of 0.1 ms give 400 deg/s."""
    angle = there_and_back(radians(40.0), radians(64.0), 2.0, sample_time_s)
    noise = radians(0.05) * np.random.default_rng(1).standard_normal(len(angle))
    noisy = recording(ARM, ANGLE, angle + noise, sample_time_s)

    assert axis(noisy, plant=ARM).speed == pytest.approx(radians(24.0), rel=share)


@pytest.mark.parametrize("sample_time_s", [1e-4, 1e-3, 5e-3, 0.05])
def test_a_steady_speed_is_what_it_is_on_every_clock(sample_time_s):
    steady = slide(there_and_back(0.05, 0.25, 2.0, sample_time_s), sample_time_s)

    assert axis(steady).speed == pytest.approx(0.2, rel=1e-6)


@pytest.mark.parametrize("at", [0, 1, 700, 1500, 3999], ids="sample {}".format)
@pytest.mark.parametrize("size_m", [0.02, -0.02])
def test_a_single_glitch_changes_neither_speed_nor_places(at, size_m):
    """At 0.4 m/s it would be 2 m/s over ten samples of 1 ms."""
    place_m = there_and_back(0.05, 0.25, 1.0, 1e-3)
    hit = place_m + size_m * (np.arange(len(place_m)) == at)
    clean, found = axis(slide(place_m)), axis(slide(hit))

    assert found.speed == pytest.approx(clean.speed, rel=0.01)
    assert (found.low, found.high) == pytest.approx((clean.low, clean.high), abs=1e-3)


def test_a_glitch_of_a_sensor_slower_than_the_clock_is_one_as_well():
    """Nine of ten samples are missing; bridged, the glitch would last twenty."""
    place_m = np.where(np.arange(4000) % 10, np.nan, there_and_back(0.05, 0.25, 2.0, 1e-3))
    hit = place_m + 0.02 * (np.arange(4000) == 700)

    assert axis(slide(hit)).speed == pytest.approx(0.2, rel=0.01)


def test_a_glitch_of_a_pressure_raises_no_limit():
    still = slide(there_and_back(0.05, 0.25, 2.0, 1e-3))
    hit = still[A] + 30e5 * (np.arange(len(still)) == 700)
    limits = limits_of(DRIVE, [replace(still, channels={**still.channels, A: hit})])

    assert limits.highest_pa == limits_of(DRIVE, [still]).highest_pa
    burst = np.where(np.abs(np.arange(len(still)) - 700) < 20, 30e5, still[A])
    seen = limits_of(DRIVE, [replace(still, channels={**still.channels, A: burst})])
    assert seen.highest_pa == pytest.approx(HIGHER * 30e5)


def test_what_is_no_glitch_stays_a_place_to_the_last_sample():
    """Turns of a triangle, and both ends of what was recorded in motion."""
    ramp_m, turn_m = np.linspace(0.05, 0.25, 500), there_and_back(0.05, 0.25, 0.4, 1e-3)

    for place_m in (ramp_m, turn_m):
        found = axis(slide(place_m))
        assert (found.low, found.high) == (place_m.min(), place_m.max())


def test_a_piece_shorter_than_a_speed_lasts_has_none():
    short = round(0.5 * SPEED_S / 1e-3)

    assert axis(slide(np.linspace(0.05, 0.25, short))).speed == 0.0
