"""Where windows begin: states guessed from what was recorded, and how well they are known."""

from dataclasses import replace

import numpy as np
import pytest
from test_fitting import NOISE, sines

from studies.commissioning import recorded
from workbench.fitting.starts import guessed_states
from workbench.plants import servo_drive
from workbench.plants.gearbox import gearbox
from workbench.simulation import simulate

MASSES = ("chamber_1.mass_kg", "chamber_2.mass_kg")
VALVES = ("valve_1", "valve_2")
SETTLED = 20  # samples after which it is forgotten that an armature presses on its seat at first


@pytest.fixture(scope="module")
def shifted():
    """A second of shifts of the default gearbox with impacts at up to 2.5 m/s."""
    return recorded(gearbox(), 0).part(0, 1000)


@pytest.fixture(scope="module")
def plant():
    return gearbox().lean()


@pytest.fixture(scope="module")
def truth(plant, shifted):
    return simulate(plant, shifted)


def off(plant, recording, truth, name):
    """Error of a guessed state over its deviation, root mean square, and its deviations (n,)."""
    guess, deviation = guessed_states(plant, recording)[:, list(plant.state_list).index(name)]
    return np.sqrt(np.mean(((guess - truth[name]) / deviation) ** 2)), deviation


def test_a_speed_is_known_less_where_a_piston_hits_something(plant, shifted, truth):
    """A slope over 15 ms is off by half a metre per second there, said to 10 mm/s."""
    error, deviation = off(plant, shifted, truth, "main_piston.velocity_m_s")
    still = np.abs(truth["main_piston.velocity_m_s"]) < 1e-3

    assert error < 1.5
    assert np.median(deviation[still]) == pytest.approx(0.01)
    assert deviation.max() > 0.2


@pytest.mark.parametrize("name", MASSES)
def test_a_mass_is_known_less_where_a_valve_opened(plant, shifted, truth, name):
    error, deviation = off(plant, shifted, truth, name)

    assert error < 3.0
    assert deviation.max() > 5.0 * deviation.min()


@pytest.mark.parametrize("valve", VALVES)
def test_coils_and_armatures_follow_their_commands(plant, shifted, truth, valve):
    """At their own parameters exactly; with a weaker coil a millisecond late."""
    names = list(plant.state_list)
    weaker = plant.with_values({f"{valve}.supply_voltage_v": 20.0})
    for name in ("current_a", "armature_position_m", "armature_velocity_m_s"):
        row, wanted = names.index(f"{valve}.{name}"), truth[f"{valve}.{name}"][SETTLED:]
        guess, late = (guessed_states(p, shifted)[0, row, SETTLED:] for p in (plant, weaker))

        assert guess == pytest.approx(wanted, abs=1e-3 * np.abs(wanted).max())
        assert np.abs(late - wanted).max() > 0.1 * np.abs(wanted).max()


def test_of_smooth_motion_speeds_are_known_as_well_everywhere():
    plant = servo_drive().lean()
    speeds = guessed_states(plant, sines(plant, NOISE))
    row = list(plant.state_list).index("slide.velocity_m_s")

    assert np.quantile(speeds[1, row], 0.9) == pytest.approx(0.01)


def test_a_coarse_sensor_that_mostly_stands_still_does_not_make_motion_rough():
    """A ramp at 0.11 m/s in steps of 50 micrometres, after four times as long at rest."""
    plant, n = servo_drive().lean(), 1000
    place = 0.1 + 1.1e-4 * np.maximum(np.arange(n) - 800.0, 0.0)
    moving = sines(plant, NOISE).part(0, n)
    channels = {**moving.channels, "slide.position_m": 5e-5 * np.round(place / 5e-5)}
    speed = guessed_states(plant, replace(moving, channels=channels))
    row = list(plant.state_list).index("slide.velocity_m_s")

    assert speed[0, row, 820:980] == pytest.approx(0.11, abs=2e-3)
