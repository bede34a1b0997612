"""When the one-step filter of a comparison has lost the state, and when it follows its noise."""

from dataclasses import replace

import numpy as np
import pytest
from test_comparison import measured

from workbench.comparison import compare, horizons
from workbench.comparison.compare import FREE_RUN, ONE_STEP
from workbench.comparison.course import course_of
from workbench.comparison.run import run
from workbench.recording import Recording
from workbench.rig import default_rig

N = 600


@pytest.fixture(scope="module")
def drive():
    return default_rig("servo_drive")


@pytest.fixture(scope="module")
def recording(drive):
    return measured(drive)


def own_simulation(plant_name, share):
    """A plant's own outputs under pulses, with noise of a share of their range; and its rig."""
    rig, random = default_rig(plant_name), np.random.default_rng(1)
    played = {}
    for signal in (*rig.plant.commands, *rig.plant.measured_inputs):
        values = np.full(N, signal.nominal)
        if signal in rig.plant.commands:
            values[100:300] += 0.2 * (signal.upper - signal.nominal)
            values[400:500] -= 0.2 * (signal.nominal - signal.lower)
        played[signal.name] = values
    clean = run(rig, Recording("its own", 1e-3, played))
    noise = {name: share * float(np.ptp(clean[name])) for name in rig.plant.measured}
    noisy = {name: clean[name] + s * random.standard_normal(N) for name, s in noise.items()}
    return rig, Recording("its own", 1e-3, {**played, **noisy}, noise=noise)


@pytest.mark.parametrize("plant_name", ["servo_reservoir", "soft_joint"])
def test_a_filter_at_the_noise_of_a_good_sensor_has_lost_nothing(plant_name):
    """It is further off than the free run of a plant that is right, as it expects to be."""
    rig, played = own_simulation(plant_name, 3e-4)
    (found,) = compare(rig, [played]).recordings

    (name,) = found.errors[ONE_STEP]
    one_step, free = (found.errors[horizon][name].rmse for horizon in (ONE_STEP, FREE_RUN))
    assert one_step**2 > horizons.FARTHER * free**2
    assert found.notes == ()


def test_a_drive_with_two_of_its_sensors_has_lost_nothing(drive, recording):
    channels = {k: v for k, v in recording.channels.items() if not k.startswith("chamber_b")}
    found = compare(drive, [replace(recording, channels=channels)]).recordings[0]
    assert horizons.ASTRAY not in found.notes


class Passes:
    """Filter passes that are asked one after the other, and with what was considered."""

    def __init__(self, *found):
        self.found, self.considered = list(found), []

    def __call__(self, known, recording, guessed):
        self.considered.append(known.considered)
        return self.found.pop(0)


def followed(rig, recording, monkeypatch, *passes, free_off=0.0):
    """What is followed where the filter gives these passes, and what is asked of it.

    The free run is off by so many deviations of the noise.
    """
    course = course_of(rig.plant, recording)
    asked = Passes(*passes)
    monkeypatch.setattr(horizons, "filter_pass", asked)
    free = {name: recording[name] + free_off * recording.noise[name] for name in rig.plant.measured}
    return *horizons._followed(course, recording.noise, free), asked.considered


def passed(rig, recording, off, likelihood):
    """A pass whose innovations are so many deviations, and that expects one."""
    normalised = np.full((len(rig.plant.measured), len(recording)), float(off))
    noise = np.array([recording.noise[name] for name in rig.plant.measured])
    return type("Pass", (), dict(
        measured=rig.plant.measured, innovations=noise[:, None] * normalised,
        normalised=normalised, log_likelihood=likelihood,
    ))()  # fmt: skip


@pytest.fixture(scope="module")
def shift():
    """A gearbox, where nothing measures the control chamber."""
    rig, n = default_rig("gearbox"), 120
    held = {"valve_1.command": 1.0 * (np.arange(n) < 60), "valve_2.command": np.zeros(n)}
    clean = run(rig, Recording("a shift", 1e-3, held))
    noise = {k: 2e-5 if k.endswith("position_m") else 1e3 for k in rig.plant.measured}
    return rig, replace(clean, noise=noise)


def test_a_filter_that_went_astray_gives_way_to_the_careful_one(shift, monkeypatch):
    lost, well = (passed(*shift, off, likely) for off, likely in ((30.0, -1e6), (1.0, 1e4)))
    found, notes, considered = followed(*shift, monkeypatch, lost, well)

    assert found is well and notes == []
    assert considered[0] == () and "control_chamber.pressure_pa" in considered[1]


def test_the_likelier_of_two_that_went_astray_is_taken_and_it_is_said(shift, monkeypatch):
    lost, worse = (passed(*shift, off, likely) for off, likely in ((30.0, -1e6), (60.0, -1e7)))
    found, notes, _ = followed(*shift, monkeypatch, lost, worse)

    assert found is lost and notes == [horizons.ASTRAY]


def test_what_follows_its_noise_is_asked_once(shift, monkeypatch):
    well = passed(*shift, 1.0, 1e4)
    found, notes, considered = followed(*shift, monkeypatch, well)

    assert found is well and notes == [] and len(considered) == 1


def test_a_filter_no_further_off_than_a_free_run_is_not_at_fault(shift, monkeypatch):
    """The plant is wrong: so is what the filter expects of itself."""
    off = passed(*shift, 30.0, -1e6)
    found, notes, considered = followed(*shift, monkeypatch, off, free_off=29.0)

    assert found is off and notes == [] and len(considered) == 1
