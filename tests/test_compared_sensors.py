"""Comparisons with sensors that saturate, and with slow ones on a fast clock."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from test_comparison import NOISE, PRESSURE, measured

from studies.documents import comparison_document
from studies.figures.comparison import overlay_figure
from studies.text_of_comparison import comparison_text
from workbench.comparison import compare, horizons
from workbench.comparison.compare import FREE_RUN, ONE_STEP, WINDOW
from workbench.consistency import examined
from workbench.consistency.findings import Weight
from workbench.reading import RecordingWarning
from workbench.rig import default_rig


@pytest.fixture(scope="module")
def drive():
    return default_rig("servo_drive")


def test_samples_of_a_saturated_sensor_count_in_no_error(drive):
    """The plant that made the recording is up to a bar off where the sensor ends."""
    recording = measured(drive, times=3)
    top = float(np.quantile(recording[PRESSURE], 0.7))
    clipped = {**recording.channels, PRESSURE: np.minimum(recording[PRESSURE], top)}

    with pytest.warns(RecordingWarning, match="saturated at"):
        found = compare(drive, [replace(recording, channels=clipped)]).recordings[0]

    assert np.array_equal(np.isnan(found.measured[PRESSURE]), recording[PRESSURE] >= top)
    for horizon in (ONE_STEP, WINDOW, FREE_RUN):
        assert found.errors[horizon][PRESSURE].rmse < 3 * NOISE[PRESSURE]
    assert "left out of errors" in found.notes[-1]


@pytest.mark.filterwarnings("error")
def test_a_slow_sensor_on_a_fast_clock_is_looked_at_without_a_word(drive):
    """Every other sample is missing: no four neighbours tell its noise."""
    recording = measured(drive)
    pressure_pa = np.where(np.arange(len(recording)) % 2, np.nan, recording[PRESSURE])
    slow = replace(recording, channels={**recording.channels, PRESSURE: pressure_pa})

    assert examined(drive, slow) == ()


def test_time_in_which_nothing_was_recorded_is_told_and_belongs_to_no_regime(drive):
    """Behind the last sample the guessed plant rests: it was told as at rest, 90 % of a time."""
    recording = measured(drive)
    n, outputs = len(recording), drive.plant.measured
    more = {k: np.full(n, np.nan if k in outputs else v[-1]) for k, v in recording.channels.items()}
    both = {k: np.concatenate([v, more[k]]) for k, v in recording.channels.items()}
    silent = replace(recording, channels=both)

    with pytest.warns(RecordingWarning, match="no samples for 50% of the recording"):
        found = compare(drive, [silent]).recordings[0]

    (whole,) = compare(drive, [recording]).recordings
    told, shares = (
        {each.name: each.share_of_time for each in one.by_regime} for one in (whole, found)
    )
    for name in ("at rest", "moving forward", "valve closed", "valve open above 4.95 V"):
        assert shares[name] == pytest.approx(told[name], abs=0.01)
    (told,) = examined(drive, silent)
    assert told.weight is Weight.NOTICE and told.channel.count(", ") == len(outputs) - 1
    assert examined(drive, recording) == ()


@pytest.mark.filterwarnings("error:All-NaN")
def test_a_silent_sensor_has_no_noise_in_table_and_document(drive):
    """It stood there with 1e-17 bar, and its figure warned of a range of nothing."""
    recording = measured(drive)
    channels = {**recording.channels, PRESSURE: np.full(len(recording), np.nan)}
    with pytest.warns(RecordingWarning):
        found = compare(drive, [replace(recording, channels=channels, noise={})])
    silent, other = (f"{part}.pressure" for part in ("chamber_a", "chamber_b"))
    (told,) = comparison_document(found)["recordings"]

    assert f"{silent}_pa" == PRESSURE
    assert told["noise"][silent]["value"] is None and told["noise"][other]["value"] > 0.0
    assert "e-1" not in comparison_text(found)
    assert not any(silent in note and "thousandth" in note for note in found.recordings[0].notes)
    overlay_figure(found.recordings[0]).draw_without_rendering()


def test_a_recording_with_too_many_windows_says_how_many_are_run(drive, monkeypatch):
    recording = measured(drive)
    notes = compare(drive, [recording]).recordings[0].notes
    monkeypatch.setattr(horizons, "cut_windows", partial(horizons.cut_windows, most=2))
    few = compare(drive, [recording]).recordings[0].notes

    assert not any(note.startswith("windows:") for note in notes)
    assert any(note.endswith("are run, evenly over the recording") for note in few)
