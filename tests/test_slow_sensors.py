"""Sensors many times slower than the clock: silent between their samples, and yet not blind."""

from dataclasses import replace

import numpy as np
import pytest
from test_fitting import NOISE, sines

from studies import adversarial as spoil
from studies.demo import DATA
from workbench.consistency import examined
from workbench.consistency.explained import moving, probe
from workbench.diagnosis.rivals import Rehearsed, distances
from workbench.fitting.error_model import OUTLYING, error_model
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.holes import bridging_errors, long_holes, usual_gap
from workbench.fitting.linearised import Point
from workbench.fitting.starts import guessed_states
from workbench.fitting.unknowns import nominal_unknowns
from workbench.fitting.windows import cut_windows
from workbench.plants import servo_drive
from workbench.reading import read_recording
from workbench.rig import load_rig
from workbench.simulation import simulate

A, B, PLACE = spoil.A, spoil.B, spoil.PLACE
FRICTION = "friction.coulomb_force_n"


@pytest.fixture(scope="module")
def plant():
    return servo_drive().lean()


@pytest.fixture(scope="module")
def recording(plant):
    return sines(plant, NOISE)


def slow(recording, every, *names, first=0):
    """The same with so many samples from one value of these channels to the next."""
    channels = dict(recording.channels)
    for name in names:
        channels[name] = np.full(len(recording), np.nan)
        channels[name][first::every] = recording[name][first::every]
    return replace(recording, channels=channels)


def without(recording, name, samples):
    channels = {**recording.channels, name: recording[name].copy()}
    channels[name][samples] = np.nan
    return replace(recording, channels=channels)


def test_a_usual_gap_is_that_of_most_samples():
    every_third = np.arange(90) % 3 == 1
    assert usual_gap(every_third) == 3
    assert usual_gap(np.where(np.arange(90) // 30 == 1, False, every_third)) == 3
    assert usual_gap(np.isin(np.arange(4), [0, 1, 3])) == 1
    assert usual_gap(np.ones(5, dtype=bool)) == usual_gap(np.zeros(5, dtype=bool)) == 1


@pytest.mark.parametrize("every", [16, 17, 40, 100])
def test_between_the_samples_of_a_slow_sensor_there_is_no_hole(plant, recording, every):
    """One of 60 Hz on a clock of 1 kHz made everything unknown, in every channel."""
    assert not long_holes(plant, slow(recording, every, A)).any()


def test_a_hole_of_a_slow_sensor_has_two_of_its_samples_lost(plant, recording):
    sensor = slow(recording, 20, A)
    one, two = (without(sensor, A, range(1000, last, 20)) for last in (1001, 1021))

    assert not long_holes(plant, one).any()
    assert np.flatnonzero(long_holes(plant, two)).tolist() == list(range(981 - 7, 1040 + 7))


def test_a_hole_of_a_fast_sensor_is_longer_than_slopes_can_bridge(plant, recording):
    short, long = (without(recording, A, range(1000, 1000 + n)) for n in (15, 16))

    assert not long_holes(plant, short).any()
    assert np.flatnonzero(long_holes(plant, long)).tolist() == list(range(993, 1023))


def test_a_straight_line_is_off_a_parabola_by_what_the_bend_tells():
    """y = k^2 every 20 samples: s (20 - s) off in between, and 2 s - 20 in slope."""
    k = np.arange(101.0)
    s = k % 20
    values = np.where(s == 0, k**2, np.nan)

    value, rate = bridging_errors(values, (0,))

    assert value == pytest.approx(s * (20 - s))
    assert rate[k < 100] == pytest.approx(np.abs(2 * s - 20)[k < 100])
    assert not bridging_errors(k**2, (0, 40)).any()


def test_a_moving_parabola_bridges_short_gaps_and_its_slope_is_as_good_there():
    """A lost sample amid noise is off by the noise of its neighbours; speeds are smooth anyway."""
    values = np.random.default_rng(1).standard_normal(200)
    values[[50, 120, 121]] = np.nan

    value, rate = bridging_errors(values, (0,))

    assert np.flatnonzero(value).tolist() == [50, 120, 121]
    assert not rate.any()


def test_held_ends_go_on_with_the_slope_and_pieces_have_their_own():
    """Two ramps; the first value of the second is recorded three samples late."""
    values = np.concatenate([0.5 * np.arange(10.0), 100.0 - 2.0 * np.arange(10.0)])
    values[10:13] = np.nan

    value, rate = bridging_errors(values, (0, 10))

    assert value == pytest.approx([0.0] * 10 + [6.0, 4.0, 2.0] + [0.0] * 7)
    assert not rate.any()


@pytest.mark.parametrize("every", [17, 23, 53])
def test_start_states_claim_no_more_than_a_slow_sensor_tells(plant, recording, every):
    """At 53 samples the straight line is off by a millimetre; it claimed 20 micrometres."""
    names = list(plant.state_list)
    guess, deviation = guessed_states(plant, slow(recording, every, *plant.measured))
    whole = guessed_states(plant, recording)[0]
    for name in (PLACE, "slide.velocity_m_s", A, B):
        row = names.index(name)
        off = (guess[row] - whole[row]) / deviation[row]
        assert np.sqrt(np.mean(off**2)) < 1.6, name
    at_samples = deviation[names.index(PLACE), ::every]
    assert np.median(at_samples) == pytest.approx(2e-5)


@pytest.fixture(scope="module")
def rest_then_motion(recording):
    """Four seconds at rest with the noise of the sensors, then four of motion."""
    rng, n = np.random.default_rng(2), 4000
    channels = {}
    for name, values in recording.channels.items():
        still = values[0] + NOISE.get(name, 0.0) * rng.standard_normal(n)
        channels[name] = np.concatenate([still, values, values])
    return replace(recording, channels=channels, starts=(0, n, n + len(recording)))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("every", [1, 10, 23])
def test_the_liveliest_windows_are_found_where_sensors_are_slow(plant, rest_then_motion, every):
    """A window without one sample counted as one at rest, and the first 3.2 s were taken."""
    read = slow(rest_then_motion, every, *plant.measured)
    where = probe(plant, read)

    assert where.firsts[0] >= 4000 and where.length == 200
    assert moving(plant, read, where).all()


@pytest.mark.filterwarnings("error")
def test_an_output_without_a_sample_in_most_windows_has_no_say_in_what_moves(plant, recording):
    read = slow(recording, 700, B, first=100)
    where = probe(plant, read)

    assert len(where.firsts) == 10
    assert moving(plant, read, where).tolist() == [name != B for name in plant.measured]


def test_a_misreading_is_named_where_one_sensor_is_slow():
    rig = load_rig(DATA / "rig.toml")
    train = read_recording(rig, DATA / "train.csv").part(0, 4000)
    read = slow(spoil.SERVO_DRIVE["position times 10"](train), 20, A)

    assert [f"{each.channel} {each.what}"[:29] for each in examined(rig, read)] == [
        "slide.position looks ten time"
    ]


def rivals(plant, recorded):
    """The drive that made a recording, fitted, and one with half as much friction, which is not."""
    known, windows = nominal_unknowns(plant), cut_windows(plant, [recorded], NOISE)
    less = plant.with_values({FRICTION: plant.values[FRICTION] / 2})
    return [
        fit_windows(windows, known, Point(known.scaled(each.values), windows.start), iterations)
        for each, iterations in ((plant, 2), (less, 0))
    ]


@pytest.mark.parametrize("names", [(PLACE, A, B), (A,)], ids=["all", "one"])
def test_rivals_are_as_far_apart_as_the_samples_of_slow_sensors_show(plant, recording, names):
    """A rehearsal has a value at every tick of the clock: ten times as much was promised."""
    fits = rivals(plant, slow(recording, 10, *names))
    begun = guessed_states(plant, recording)[0, :, 0]
    whole = tuple(simulate(fit.plant, recording, begun) for fit in fits)
    taken = tuple(slow(each, 10, *names) for each in whole)
    found, sampled = (distances(fits, [Rehearsed(None, None, r)])[0, 0] for r in (whole, taken))
    windows = fits[0].windows.rescaled(fits[0].residual)
    independent = np.sum((windows.weight > 0).sum(axis=2) / windows.correlation)

    assert found == sampled
    assert 100.0 < found <= OUTLYING**2 * independent


@pytest.mark.parametrize("step", [1, 10, 50, 100, 200])
def test_white_errors_of_a_slow_sensor_are_white_however_few_a_window_has(step):
    """The median of the ratio is 0.455 for many, 0.75 for three and 1 for two."""
    rng = np.random.default_rng(0)
    weight, moves = np.zeros((1, 400, 200)), np.full((1, 400), 100.0)
    weight[:, :, ::step] = 1.0
    white = rng.normal(size=weight.shape) * weight
    alike = rng.normal(size=(1, 400, 1)) * weight

    of_white, of_alike = (error_model(e, weight, moves, np.ones((1, 1))) for e in (white, alike))

    assert of_white.moving_samples == 1.0
    assert of_alike.moving_samples == weight.shape[2] // step
