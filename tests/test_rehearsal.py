"""Where rehearsals begin: where the recordings do, which may be far from the plant's own start."""

import numpy as np
import pytest

from studies.demo import DATA
from workbench.filtering import consistent_start
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.noise import measured_noise
from workbench.fitting.unknowns import nominal_unknowns
from workbench.fitting.windows import cut_windows
from workbench.manoeuvres.library import command_ramp, fill_and_hold, position_triangle
from workbench.manoeuvres.limits import limits_of
from workbench.manoeuvres.play import Play
from workbench.manoeuvres.rehearse import rehearse, speed_maps
from workbench.reading import read_recording
from workbench.recording import Recording
from workbench.rig import default_rig, load_rig

PLACE, COMMAND = "slide.position_m", "valve.command_v"
A, B = "chamber_a.pressure_pa", "chamber_b.pressure_pa"
REST_PA = 4e5


@pytest.fixture(scope="module")
def fit():
    """The demo's drive as it comes; of the recordings that a test makes up only limits are read."""
    rig = load_rig(DATA / "rig.toml")
    recording = read_recording(rig, DATA / "train.csv").part(0, 1000)
    plant = rig.fit_for(recording).lean()
    windows = cut_windows(plant, [recording], measured_noise([recording], plant.measured))
    return fit_windows(windows, nominal_unknowns(plant), iterations=1)


def limits_between(fit, low_m, high_m, start_m):
    """Limits of a drive that was recorded between two places, at rest before and after."""
    n = 2000
    rows = {name: np.full(n, REST_PA) for name in (A, B)} | {COMMAND: np.full(n, 4.95)}
    ends = [0, 500, 600, 900, 1000, 1200]
    places = [start_m, start_m, high_m, high_m, low_m, start_m]
    rows[PLACE] = np.interp(np.arange(n), ends, places)
    return limits_of(fit.plant, [Recording("narrow", 1e-3, rows)])


def test_a_rehearsal_begins_where_the_recording_does_and_breaks_no_limit_by_standing_still(fit):
    """Recorded from 20 to 80 mm; the plant's own start is the middle of the stroke, at 145 mm."""
    limits = limits_between(fit, 0.02, 0.08, 0.03)
    (axis,) = limits.axes
    still = Play(np.full((1, limits.samples), 4.95), np.zeros((1, limits.samples)))
    triangle = position_triangle(limits, 1.0, 9.0)
    runs = rehearse(fit, limits, [still, triangle], speed_maps(fit, limits))

    assert axis.start == triangle.reference[0, 0] == pytest.approx(0.03)
    start = consistent_start(fit.plant, {PLACE: 0.03, A: REST_PA, B: REST_PA})
    for run in runs:
        assert run[PLACE][0] == pytest.approx(0.03)
        assert [run[name][0] for name in fit.plant.state_list] == pytest.approx(list(start))
        assert limits.broken_by(run, ends=False) == ""


def test_a_ramp_of_the_command_begins_with_a_rest_and_never_jumps(fit):
    """Then up, through the centre, down and back, twice: at one rate."""
    limits = limits_between(fit, 0.02, 0.08, 0.03)
    (signal,) = limits.commands
    (row,) = command_ramp(limits, 1.0, 0.2).commands
    away = row - signal.nominal
    crossings = np.flatnonzero((away[:-1] > 0) & (away[1:] <= 0))

    assert away[:500] == pytest.approx(0.0, abs=1e-12)
    assert away.max() == pytest.approx(0.2 * (signal.upper - signal.nominal), rel=0.01)
    assert away.min() == pytest.approx(0.2 * (signal.lower - signal.nominal), rel=0.01)
    assert np.abs(np.diff(away)).max() < 0.01 * away.max()
    assert len(crossings) == 2


def test_the_speed_map_goes_both_ways_where_the_recording_begins_at_a_stop(fit):
    (speeds,) = speed_maps(fit, limits_between(fit, 0.0, 0.08, 0.0))

    assert speeds.speed[0] < -0.1 and speeds.speed[-1] > 0.1


def test_a_triangle_slower_than_its_name_says_how_slow_it_is():
    """1 s there and back through 200 mm is 0.4 m/s; recorded were 0.1 m/s."""
    plant = default_rig("servo_drive").plant
    place = 0.15 + 0.1 * np.sin(np.arange(0.0, 6.3, 1e-3))
    channels = {name: np.full(len(place), 4e5) for name in plant.measured}
    channels |= {"slide.position_m": place, "valve.command_v": np.full(len(place), 5.0)}
    limits = limits_of(plant, [Recording("slow", 1e-3, channels)])
    fast, slow = (position_triangle(limits, 1.0, period_s) for period_s in (1.0, 9.0))

    assert fast.words == "a triangle as fast as was recorded, 6.3 s there and back"
    assert not slow.words


@pytest.mark.parametrize("sample_time_s", [1e-3, 2.5e-4])
def test_what_fills_and_vents_does_both_where_samples_make_it_short(sample_time_s):
    """Twenty thousand samples at 4 kHz are 5 s."""
    plant = default_rig("servo_reservoir").plant
    names = (*plant.measured, *(s.name for s in (*plant.commands, *plant.measured_inputs)))
    channels = {name: np.linspace(1.0, 5.0, 4000) for name in names}
    limits = limits_of(plant, [Recording("fast", sample_time_s, channels)])
    (command,) = fill_and_hold(limits, 1.0).commands

    assert (command.min(), command.max()) == (limits.commands[0].lower, limits.commands[0].upper)
    assert command[0] == command[-1] == limits.commands[0].nominal
