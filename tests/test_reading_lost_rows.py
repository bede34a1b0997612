"""A lost row is filled alone: all other samples stay as they were recorded."""

import numpy as np
import pytest
from recording_files import FACTORS, FULL, read, table, text

from workbench.fitting.noise import measured_noise

LONG = 2000
START_S = 0.12345678  # stamps finer than a sample, as most loggers write them


def logged(rate_hz: float = 1000.0, start_s: float = START_S) -> np.ndarray:
    rows = table(LONG)
    rows[:, 0] = start_s + np.arange(LONG) / rate_hz
    return rows


@pytest.mark.parametrize("start_s", [START_S, 0.0], ids=["fine stamps", "stamps in ms"])
@pytest.mark.parametrize("at", [[3], [850], [1000], [1150], [1996], [900, 1200], [7, 10, 1500]])
def test_the_samples_beside_a_lost_row_stay_as_they_were_recorded(tmp_path, at, start_s):
    """One row lost in the middle fifth had every sample interpolated, and the noise halved."""
    rows = logged(start_s=start_s)

    found = read(tmp_path, text(np.delete(rows, at, axis=0)))

    kept = np.delete(np.arange(LONG), at)
    assert (found.sample_time_s, len(found)) == (pytest.approx(1e-3, rel=1e-9), LONG)
    for name, column, factor in zip(FULL, rows.T[1:], FACTORS, strict=True):
        assert found[name][kept] == pytest.approx(factor * column[kept], rel=1e-7)
    position = found["slide.position_m"]
    assert measured_noise([found], ["slide.position_m"])["slide.position_m"] > 0.95e-5
    assert position[at] == pytest.approx(1e-3 * rows[at, 3], abs=1e-3)


@pytest.mark.parametrize("rate_hz", [300.0, 128.0])
def test_a_lost_row_among_rounded_stamps_is_filled_alone(tmp_path, rate_hz):
    rows = logged(rate_hz)
    rows[:, 0] = np.round(rows[:, 0], 3)

    found = read(tmp_path, text(np.delete(rows, 1003, axis=0)))

    kept = np.delete(np.arange(LONG), 1003)
    assert found.sample_time_s == pytest.approx(1.0 / rate_hz, rel=1e-4)
    assert found[FULL[2]][kept] == pytest.approx(1e-3 * rows[kept, 3], rel=1e-7)


def test_a_lost_row_does_not_move_a_switched_command(tmp_path):
    rows = logged()
    rows[:, 1] = 4.0 + (np.arange(LONG) % 100 < 50)

    found = read(tmp_path, text(np.delete(rows, 1020, axis=0)))

    assert np.array_equal(found["valve.command_v"], rows[:, 1])


def test_a_lost_row_does_not_change_the_step_of_a_clock_that_jitters(tmp_path):
    rows = logged()
    rows[:, 0] += 1e-4 * np.random.default_rng(1).uniform(-1, 1, LONG)

    whole, short = (read(tmp_path, text(each)) for each in (rows, np.delete(rows, 1000, axis=0)))

    assert short.sample_time_s == pytest.approx(whole.sample_time_s, rel=5e-5)


@pytest.mark.parametrize("rate_hz", [990.0, 900.0, 700.0])
def test_a_clock_that_skips_a_stamp_now_and_then_lost_nothing(tmp_path, rate_hz):
    rows = logged(rate_hz)
    rows[:, 0] = np.round(rows[:, 0], 3)

    found = read(tmp_path, text(rows))

    assert (found.sample_time_s, len(found)) == (pytest.approx(1.0 / rate_hz, rel=1e-4), LONG)


def test_a_clock_that_wanders_keeps_its_usual_step(tmp_path):
    """As a real logger's: late now and then by part of a sample, which none of them makes up."""
    rng = np.random.default_rng(4)
    steps_s = 1e-3 * rng.choice([10, 11, 20, 14], size=LONG, p=[0.87, 0.1, 0.02, 0.01])
    rows = logged()
    rows[:, 0] = np.cumsum(steps_s)

    assert read(tmp_path, text(rows)).sample_time_s == pytest.approx(0.01, rel=1e-9)
