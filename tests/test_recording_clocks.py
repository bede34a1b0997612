"""Clocks of recordings: jitter, rounded stamps, slow sensors and gaps come onto one even grid."""

import numpy as np
import pytest
from recording_files import FACTORS, FULL, N, read, refused, table, text


def test_jitter_is_interpolated_onto_an_even_grid(tmp_path):
    t = 1e-3 * np.arange(N) + 2e-4 * np.random.default_rng(1).uniform(-1, 1, N)
    rows = np.column_stack([t, 5 + np.sin(9 * t), 5 + np.cos(9 * t), 140 + 90 * np.sin(5 * t)])

    recording = read(tmp_path, text(rows))

    even = t[0] + recording.time_s
    assert recording.sample_time_s == pytest.approx(1e-3, rel=1e-2)
    assert recording["valve.command_v"] == pytest.approx(5 + np.sin(9 * even), abs=1e-4)


@pytest.mark.parametrize("round_to", [np.round, np.floor])
@pytest.mark.parametrize("rate_hz", [300.0, 700.0, 128.0])
def test_an_even_clock_with_rounded_stamps_keeps_its_samples(tmp_path, rate_hz, round_to):
    """Stamps in ms of a clock of 300 Hz say that it is uneven by 0.15 of a sample; it is not."""
    rows = table()
    rows[:, 0] = 1e-3 * round_to(1e3 * np.arange(N) / rate_hz + 0.21)
    found = read(tmp_path, text(rows))

    assert found.sample_time_s == pytest.approx(1.0 / rate_hz, rel=1e-4)
    for name, column, factor in zip(FULL, rows.T[1:], FACTORS, strict=True):
        assert found[name] == pytest.approx(factor * column, rel=1e-7)


def test_rounded_stamps_of_an_uneven_clock_are_interpolated(tmp_path):
    """Stamps that lie further off an even grid than half their resolution tell a real jitter."""
    t = 0.01 * np.arange(N) + 2e-3 * np.random.default_rng(1).uniform(-1, 1, N)
    t = np.round(t - t[0], 3)
    rows = np.column_stack([t, 5 + np.sin(t), 5 + np.cos(t), 140 + 90 * np.sin(t)])

    recording = read(tmp_path, text(rows))

    assert recording["valve.command_v"] == pytest.approx(5 + np.sin(recording.time_s), abs=1e-4)


@pytest.mark.parametrize("jitter", [0.01, 0.03, 0.1, 0.4])
def test_a_slow_sensor_keeps_its_samples_on_a_clock_that_jitters(tmp_path, jitter):
    rows = table()
    rng = np.random.default_rng(3)
    rows[:, 0] += 1e-3 * jitter * np.r_[0, rng.uniform(-1, 1, N - 2), 0]
    rows[np.arange(N) % 10 != 3, 2] = np.nan

    recording = read(tmp_path, text(rows).replace("nan", ""))

    seen = np.flatnonzero(np.isfinite(recording[FULL[1]]))
    there = np.interp(recording.time_s, rows[:, 0], 5 + np.cos(9 * rows[:, 0]))
    assert seen.tolist() == list(range(3, N, 10))
    assert recording[FULL[1]][seen] == pytest.approx(1e5 * there[seen], abs=1e3)
    assert np.isfinite(recording[FULL[2]]).all()


def test_a_slow_sensor_keeps_its_samples_where_a_recording_is_resampled(tmp_path):
    rows = table()
    rows[::10, 2] = 5.0 + 0.1 * np.arange(N // 10)
    rows[np.arange(N) % 10 != 0, 2] = np.nan

    recording = read(tmp_path, text(rows).replace("nan", ""), 'resample = "2 ms"')

    seen = np.flatnonzero(np.isfinite(recording[FULL[1]]))
    assert seen.tolist() == list(range(0, N // 2, 5))
    assert recording[FULL[1]][seen] == pytest.approx(1e5 * (5.0 + 0.1 * np.arange(N // 10)))


def test_a_recording_is_resampled_when_asked(tmp_path):
    recording = read(tmp_path, text(table()), 'resample = "4 ms"')

    assert (recording.sample_time_s, len(recording)) == (4e-3, N // 4)


def test_gaps_are_refused_with_their_place_or_split(tmp_path):
    rows = table()
    rows[200:, 0] += 2.0

    said = refused(tmp_path, text(rows))
    split = read(tmp_path, text(rows), 'gaps = "split"')

    assert "1 gap in the time, the longest 2.001 s after line 201" in said
    assert 'gaps = "split"' in said
    assert split.starts == (0, 200)
    assert [len(piece) for piece in split.pieces] == [200, 200]
