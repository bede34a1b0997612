"""One sample that is no measurement is told by its place, and condemns neither unit nor sensor."""

from dataclasses import replace

import numpy as np
import pytest
from recording_files import FULL, N, read, refused, table, text

from studies.demo import DATA
from workbench.consistency.sensors import noisy
from workbench.reading import read_recording
from workbench.reading.outliers import outliers
from workbench.reading.table import RecordingWarning
from workbench.rig import load_rig

PRESSURE = "chamber_a.pressure_pa"


def spoiled(column: int, value: float, *rows: int) -> str:
    found = table()
    found[list(rows or (200,)), column] = value
    return text(found)


@pytest.fixture(scope="module")
def demo():
    """The demo's training recording and the plant that it fits."""
    rig = load_rig(DATA / "rig.toml")
    recording = read_recording(rig, DATA / "train.csv")
    return rig.fit_for(recording), recording


@pytest.mark.parametrize("value", [-9999e5, 9999e5, 3e7])
def test_one_sentinel_does_not_make_a_sensor_noise(demo, value):
    """It was refused, 100 % of it changing at random from sample to sample."""
    plant, recording = demo
    values = recording[PRESSURE].copy()
    values[5000] = value
    sick = replace(recording, channels={**recording.channels, PRESSURE: values})

    assert not noisy(plant, sick, np.full(len(plant.measured), 2.0))


def test_a_sensor_that_is_noise_is_refused_with_a_sentinel_in_it_too(demo):
    plant, recording = demo
    values = 5e5 + 1e5 * np.random.default_rng(3).standard_normal(len(recording))
    values[5000] = -9999e5
    sick = replace(recording, channels={**recording.channels, PRESSURE: values})

    (found,) = noisy(plant, sick, np.full(len(plant.measured), 2.0))

    assert found.what.startswith("is noise")


@pytest.mark.parametrize("value", [-9999.0, 9999.0])
def test_a_sentinel_among_pressures_is_named_instead_of_another_unit(tmp_path, value):
    """Its pressures looked like mbar."""
    said = refused(tmp_path, spoiled(2, value))

    assert f"chamber_a.pressure: is {value:g} bar at line 202, far off all others" in said
    assert "expected an empty cell" in said and len(said.splitlines()) == 1


def test_a_sentinel_that_could_be_a_value_is_warned_of(tmp_path):
    said = r"slide\.position: is -9999 mm at line 202, far off all others, the first of 2 such"

    with pytest.warns(RecordingWarning, match=said):
        read(tmp_path, spoiled(3, -9999.0, 200, 300))


@pytest.mark.parametrize("word", ["inf", "-inf"])
def test_an_infinite_sample_is_missing_with_a_word(tmp_path, word):
    """It made the whole channel another unit's."""
    with pytest.warns(RecordingWarning, match=r"position: is infinite at line 202; taken as miss"):
        found = read(tmp_path, spoiled(3, float(word)))

    assert np.flatnonzero(np.isnan(found[FULL[2]])).tolist() == [200]


@pytest.mark.filterwarnings("ignore:.*infinite")
def test_an_infinite_input_is_refused_as_any_missing_one(tmp_path):
    said = refused(tmp_path, spoiled(1, np.inf))

    assert "valve.command: 1 samples are missing from line 202 on" in said


@pytest.mark.parametrize("factor", [1.0, 1e3])
def test_what_moves_for_a_moment_or_is_noise_or_at_rest_has_no_outliers(factor):
    rng = np.random.default_rng(5)
    noise, t = rng.standard_normal(4000), np.arange(4000)
    stroke = 1e3 * np.exp(-(((t - 2000) / 10.0) ** 2))
    heavy = rng.standard_t(4, 4000)

    for values in (
        noise,
        noise + stroke,
        np.zeros(4000),
        heavy,
        np.full(4000, np.nan),
        t % 2 * 1.0,
    ):
        assert not outliers(factor * values).any()
    assert outliers(np.where(t == 7, 1e4, factor * noise / 1e3)).nonzero()[0].tolist() == [7]


@pytest.mark.filterwarnings("error")
def test_an_ordinary_recording_is_read_without_a_word(tmp_path):
    assert len(read(tmp_path, text(table()))) == N
