"""What a reservoir test stands: offsets of sensors, leaks; and what it refuses: a warm tank."""

from dataclasses import replace

import numpy as np
import pytest

from studies import identification as study
from studies.truth import dedicated as truth
from workbench.errors import InputError
from workbench.identification import PROCEDURES
from workbench.identification.dead_volume import dead_volume
from workbench.rig import load_rig

DRIVE = load_rig(study.WRONG_DRIVE)
TANK, CHAMBER, DEAD = "supply.pressure_pa", "chamber_a.pressure_pa", "chamber_a.dead_volume_m3"
TRUE_M3 = study.DRIVE.dead_volume_a_m3


def released(**changes):
    """A release into chamber a of the truth."""
    return study.recording(truth.reservoir_release(study.DRIVE, 0.290, "a", 4, **changes), "r")


@pytest.fixture(scope="module")
def release():
    return released()


def with_sensor(recording, channel, offset_pa=0.0, gain=1.0, falling_pa_s=0.0):
    """The recording as another sensor would have it; what falls has come to rest in 1.3 s."""
    still = falling_pa_s * 1.3 * np.exp(-recording.time_s / 1.3)
    values = gain * recording[channel] + offset_pa + still
    return replace(recording, channels={**recording.channels, channel: values})


@pytest.mark.parametrize("channel", [TANK, CHAMBER])
@pytest.mark.parametrize("offset_pa", [2e3, 4e3, -4e3])
def test_the_offset_of_a_sensor_moves_no_volume(release, channel, offset_pa):
    """The tank's change by its own sensor, the chamber's by its own: 0.04 bar moved it by 8 sd."""
    plain = dead_volume(DRIVE, [release])[DEAD]
    found = dead_volume(DRIVE, [with_sensor(release, channel, offset_pa)])[DEAD]

    assert found.value == pytest.approx(plain.value, abs=0.02 * plain.deviation)


@pytest.mark.parametrize("channel", [TANK, CHAMBER])
def test_what_the_sensors_disagree_by_counts_as_the_error_of_a_gain(release, channel):
    """Half a per cent of the gain moves the volume by two deviations of the readings alone."""
    plain = dead_volume(DRIVE, [release])[DEAD]
    found = dead_volume(DRIVE, [with_sensor(release, channel, gain=1.005)])[DEAD]

    assert abs(found.value - plain.value) > 1.5 * plain.deviation
    assert abs(found.value - TRUE_M3) < 2.0 * found.deviation
    assert found.deviation > 2.0 * plain.deviation


@pytest.mark.parametrize("leak_m2", [3e-9, 1e-8])
def test_a_leak_is_carried_back_as_an_exponential_and_its_start_counts(leak_m2):
    """A straight line made the volume at 0.4 %/s too large by 8 deviations."""
    found = dead_volume(DRIVE, [released(leak_m2=leak_m2)])[DEAD]

    assert abs(found.value - TRUE_M3) < 1.5 * found.deviation
    assert found.deviation < 0.01 * (TRUE_M3 + study.true.PISTON_AREA_M2 * study.true.STROKE_M)


def test_a_leak_of_more_than_half_a_per_cent_in_a_second_is_refused():
    said = r"lose 1\.1\d% of their pressure in a second .*; expected tight fittings"
    with pytest.raises(InputError, match=said):
        dead_volume(DRIVE, [released(leak_m2=3e-8)])


@pytest.mark.parametrize("channel", [TANK, CHAMBER])
def test_a_tank_or_chamber_that_is_still_warm_from_filling_is_refused(release, channel):
    """3 K too warm before the release made the dead volume 11 deviations too large, unseen."""
    warm = with_sensor(release, channel, falling_pa_s=4e3)
    name = "the tank" if channel == TANK else "chamber_a"

    said = rf"{name} falls by 0\.0\d+ bar/s before the release.*filled 20 s or more before"
    with pytest.raises(InputError, match=said):
        dead_volume(DRIVE, [warm])


def test_what_a_pressure_drifts_by_before_the_release_counts_where_it_is_no_noise(release):
    drifting = with_sensor(release, TANK, falling_pa_s=1e3)
    plain, found = (dead_volume(DRIVE, [each])[DEAD] for each in (release, drifting))

    assert found.deviation > 1.3 * plain.deviation


def test_the_guide_says_that_the_tank_has_to_cool_first():
    assert "20 s or more before" in PROCEDURES["dead-volume"].manoeuvre
