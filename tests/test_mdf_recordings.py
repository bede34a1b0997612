"""MDF files of measurement systems: one clock, slower groups beside it, units, no numbers."""

import sys

import numpy as np
import pytest
from recording_files import FACTORS, FULL, NAMES, RIG, table

from workbench.errors import InputError
from workbench.reading import read_recording
from workbench.rig import load_rig

asammdf = pytest.importorskip("asammdf", reason="MDF files need asammdf (extra `automotive`)")

UNITS = dict(zip(NAMES[1:], ("V", "bar", "mm"), strict=True))
RIG_MDF = RIG.replace('"time_s"', '"time"')


def signal(name, values, time_s, **more):
    return asammdf.Signal(np.asarray(values), time_s, name=name, unit=UNITS.get(name, ""), **more)


def written(path, *groups):
    """A file with these signals, group by group."""
    with asammdf.MDF(version="4.10") as file:
        for group in groups:
            file.append([*group])
        file.save(path, overwrite=True)
    return path


def recorded(path, **changed):
    """A file of the usual columns in one group, some of them given anew."""
    rows = table()
    usual = {name: rows[:, k + 1] for k, name in enumerate(NAMES[1:])} | changed
    return written(path, [signal(name, values, rows[:, 0]) for name, values in usual.items()])


def test_all_of_one_group_is_read_to_the_last_bit(tmp_path):
    path, rows = recorded(tmp_path / "run.mf4"), table()

    recording = read_recording(load_rig(RIG_MDF), path)

    assert recording.sample_time_s == 1e-3
    for name, column, factor in zip(FULL, rows.T[1:], FACTORS, strict=True):
        assert recording[name] == pytest.approx(factor * column, rel=1e-12)


def test_a_slower_group_stands_at_the_nearest_samples_of_the_fastest_clock(tmp_path):
    rows = table()
    fast, slow = rows[:, 0], rows[3::10, 0] + 2e-4
    path = written(
        tmp_path / "run.mf4",
        [signal(NAMES[2], rows[3::10, 2], slow)],
        [signal(NAMES[1], rows[:, 1], fast), signal(NAMES[3], rows[:, 3], fast)],
    )

    recording = read_recording(load_rig(RIG_MDF), path)

    seen = np.isfinite(recording[FULL[1]])
    assert np.flatnonzero(seen).tolist() == [*range(3, len(rows), 10)]
    assert recording[FULL[1]][seen] == pytest.approx(FACTORS[1] * rows[3::10, 2], rel=1e-12)
    assert recording[FULL[2]] == pytest.approx(FACTORS[2] * rows[:, 3], rel=1e-12)


def test_what_lies_before_the_clock_is_left_out(tmp_path):
    rows = table()
    early = rows[::20, 0] - 0.1
    path = written(
        tmp_path / "run.mf4",
        [signal(name, rows[:, k + 1], rows[:, 0]) for k, name in enumerate(NAMES[1:]) if k != 1],
        [signal(NAMES[2], rows[::20, 2], early)],
    )

    pressure = read_recording(load_rig(RIG_MDF), path)[FULL[1]]

    kept = early > -5e-4
    assert np.flatnonzero(np.isfinite(pressure)).tolist() == [*range(0, 20 * kept.sum(), 20)]


def test_raw_numbers_are_converted_as_the_file_says(tmp_path):
    rows = table()
    raw = np.round(rows[:, 2] * 1000).astype("u2")
    path = written(
        tmp_path / "run.mf4",
        [
            signal(NAMES[1], rows[:, 1], rows[:, 0]),
            signal(NAMES[2], raw, rows[:, 0], conversion={"a": 1e-3, "b": 0.0}),
            signal(NAMES[3], rows[:, 3], rows[:, 0]),
        ],
    )

    pressure = read_recording(load_rig(RIG_MDF), path)[FULL[1]]

    assert pressure == pytest.approx(FACTORS[1] * rows[:, 2], abs=0.51e-3 * FACTORS[1])


def test_samples_that_the_file_calls_invalid_are_missing(tmp_path):
    rows = table()
    bad = np.zeros(len(rows), dtype=bool)
    bad[5:8] = True
    signals = [signal(name, rows[:, k + 1], rows[:, 0]) for k, name in enumerate(NAMES[1:])]
    signals[1].invalidation_bits = asammdf.signal.InvalidationArray(bad)
    path = written(tmp_path / "run.mf4", signals)

    pressure = read_recording(load_rig(RIG_MDF), path)[FULL[1]]

    assert np.flatnonzero(np.isnan(pressure)).tolist() == [5, 6, 7]


def test_another_unit_in_the_file_than_in_the_rig_is_refused(tmp_path):
    rows = table()
    signals = [signal(name, rows[:, k + 1], rows[:, 0]) for k, name in enumerate(NAMES[1:])]
    signals[2].unit = "m"
    path = written(tmp_path / "run.mf4", signals)

    with pytest.raises(InputError, match="the file says m, the rig mm"):
        read_recording(load_rig(RIG_MDF), path)


def test_a_channel_that_is_not_there_is_refused_with_those_that_are(tmp_path):
    rows = table()
    text = asammdf.Signal(np.full(len(rows), b"on"), rows[:, 0], name="gear", encoding="utf-8")
    signals = [signal(name, rows[:, k + 1], rows[:, 0]) for k, name in enumerate(NAMES[1:])]
    path = written(tmp_path / "run.mf4", signals, [text])
    rig = load_rig(RIG_MDF.replace(NAMES[3], "gear"))

    with pytest.raises(InputError, match=f"no column 'gear'.*time, {', '.join(NAMES[1:])}"):
        read_recording(rig, path)


@pytest.mark.filterwarnings("error")  # what is left half-open complains, where nobody lets go of it
def test_a_broken_file_and_one_without_numbers_are_refused(tmp_path):
    broken, cut, empty = (tmp_path / f"{name}.mf4" for name in ("broken", "cut", "text"))
    broken.write_bytes(b"MDF     4.10 and no more")
    cut.write_bytes(recorded(tmp_path / "run.mf4").read_bytes()[:3000])
    on = asammdf.Signal(np.full(3, b"on"), np.arange(3.0), name="gear", encoding="utf-8")
    written(empty, [on])

    unread = "is no MDF file that can be read"
    for path, said in ((broken, unread), (cut, unread), (empty, "no channel of numbers")):
        with pytest.raises(InputError, match=said) as caught:
            read_recording(load_rig(RIG_MDF), path)
        assert str(path) in str(caught.value)


def test_without_asammdf_the_way_to_get_it_is_told(tmp_path, monkeypatch):
    path = recorded(tmp_path / "run.mf4")
    monkeypatch.setitem(sys.modules, "asammdf", None)

    with pytest.raises(InputError, match=r"workbench\[automotive\]"):
        read_recording(load_rig(RIG_MDF), path)
