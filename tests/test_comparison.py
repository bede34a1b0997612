"""Comparison of a plant with its recordings: errors by horizon, regimes, worst windows."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.comparison import compare
from workbench.comparison.compare import FREE_RUN, ONE_STEP, PLAIN, WINDOW, signal_error
from workbench.comparison.regimes import regimes, shares
from workbench.comparison.run import run
from workbench.errors import InputError
from workbench.recording import Recording
from workbench.rig import default_rig

DT = 1e-3
POSITION, PRESSURE = "slide.position_m", "chamber_a.pressure_pa"
NOISE = {POSITION: 5e-6, PRESSURE: 400.0, "chamber_b.pressure_pa": 400.0}


def commands(n=600):
    """Out, a rest with the valve closed, and back."""
    command = np.full(n, 4.95)
    command[50:200], command[400:550] = 6.0, 3.9
    return Recording("manoeuvre", DT, {"valve.command_v": command})


def measured(rig):
    """The rig's outputs under the commands with seeded noise, as a recording."""
    clean, rng = run(rig, commands()), np.random.default_rng(3)
    noisy = {n: clean[n] + s * rng.standard_normal(len(clean)) for n, s in NOISE.items()}
    kept = {"valve.command_v": clean["valve.command_v"], **noisy}
    return replace(clean, channels=kept, noise=NOISE)


@pytest.fixture(scope="module")
def drive():
    return default_rig("servo_drive")


@pytest.fixture(scope="module")
def recording(drive):
    return measured(drive)


@pytest.fixture(scope="module")
def heavy(drive):
    """The same rig, believed to be twice as heavy."""
    return replace(drive, plant=drive.plant.with_values({"slide.mass_kg": 4.44}))


@pytest.fixture(scope="module")
def good(drive, recording):
    return compare(drive, [recording]).recordings[0]


@pytest.fixture(scope="module")
def bad(heavy, recording):
    return compare(heavy, [recording]).recordings[0]


def test_the_plant_that_made_a_recording_explains_it_but_for_noise(good):
    for horizon in (ONE_STEP, WINDOW, FREE_RUN):
        assert good.errors[horizon][PRESSURE].rmse < 3 * NOISE[PRESSURE]


def test_a_wrong_mass_shows_at_every_horizon_and_most_in_the_free_run(good, bad):
    for horizon in (ONE_STEP, WINDOW, FREE_RUN):
        assert bad.errors[horizon][PRESSURE].rmse > 1.2 * good.errors[horizon][PRESSURE].rmse

    assert bad.errors[FREE_RUN][POSITION].rmse > bad.errors[ONE_STEP][POSITION].rmse


def test_a_friction_that_is_too_large_shows_where_the_slide_moves(drive, recording):
    slow = replace(drive, plant=drive.plant.with_values({"friction.viscous_n_s_m": 150.0}))
    found = compare(slow, [recording]).recordings[0]
    share = {regime.name: regime for regime in found.by_regime}

    assert share["moving forward"].share_of_error > share["moving forward"].share_of_time


def test_the_worst_windows_lie_inside_the_recording_worst_first(bad):
    found = [span.share_of_error for span in bad.worst]

    assert found == sorted(found, reverse=True)
    assert all(0.0 <= span.start_s < span.end_s <= 0.6 + 1e-9 for span in bad.worst)


def test_traces_have_the_length_of_the_recording(good):
    assert {len(row) for rows in good.simulated.values() for row in rows.values()} == {600}


def test_the_fit_percent_is_that_of_system_identification():
    y, yhat = np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 2.0, 3.0, 5.0])

    found = signal_error(y, yhat, 0.1)

    assert found.fit_percent == pytest.approx(100.0 * (1.0 - 1.0 / np.sqrt(5.0)))
    assert found.rmse == pytest.approx(0.5)


def test_missing_samples_count_for_nothing():
    y = np.array([1.0, np.nan, 3.0])

    assert signal_error(y, np.array([1.0, 9.0, 3.0]), 0.1).rmse == 0.0
    assert np.isnan(signal_error(np.full(3, np.nan), y, 0.1).rmse)


def test_the_valve_is_closed_inside_its_dead_zone(drive, recording):
    plant = drive.fit_for(recording).lean()

    found = regimes(plant, recording)

    closed = found["valve closed"]
    assert closed[:50].all() and closed[210:390].all()
    assert not closed[60:190].any()
    assert found["valve open above 4.95 V"][60:190].all()


def test_valve_sides_and_directions_part_the_time(drive, recording):
    found = regimes(drive.fit_for(recording).lean(), recording)

    sides = sum(mask.astype(int) for name, mask in found.items() if name.startswith("valve"))
    ways = sum(found[n].astype(int) for n in ("at rest", "moving forward", "moving backward"))
    assert (sides == 1).all() and (ways == 1).all()


def test_a_change_of_direction_is_a_reversal(drive, recording):
    found = regimes(drive.fit_for(recording).lean(), recording)

    assert "reversal" in found
    assert not found["reversal"][:60].any()


def test_shares_of_regimes_come_largest_first():
    chosen = {"a": np.array([True, False, False]), "b": np.array([False, True, True])}

    assert shares(chosen, np.array([1.0, 3.0, np.nan])) == {"b": 0.75, "a": 0.25}


def test_pieces_of_a_split_recording_start_anew(drive, recording):
    split = replace(recording, starts=(0, 300))

    found = compare(drive, [split]).recordings[0]

    assert found.errors[FREE_RUN][PRESSURE].rmse < 10 * NOISE[PRESSURE]


def test_a_recording_shorter_than_a_window_says_so(drive, recording):
    found = compare(drive, [recording.part(0, 60)]).recordings[0]

    assert WINDOW not in found.errors
    assert "window" in found.notes[0]


def test_a_plant_without_states_is_compared_sample_by_sample():
    bench = default_rig("cylinder_bench")
    t = DT * np.arange(400)
    channels = {
        "chamber.pressure_pa": np.full(400, 3e5),
        "rod.position_m": 0.02 + 0.01 * np.sin(9 * t),
        "rod.velocity_m_s": 0.09 * np.cos(9 * t),
        "rod.force_n": 20.0 + np.random.default_rng(1).standard_normal(400),
    }

    found = compare(bench, [Recording("bench", DT, channels)]).recordings[0]

    assert set(found.errors) == {PLAIN}


def test_a_run_without_the_command_is_refused(drive):
    with pytest.raises(InputError, match=r"servo_drive needs valve\.command"):
        run(drive, Recording("empty", DT, {"supply.pressure_pa": np.full(10, 7e5)}))
