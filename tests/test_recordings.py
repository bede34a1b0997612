"""Recordings from files: every dialect gives the same channels, bad input one clear message."""

import re
from dataclasses import replace

import h5py
import numpy as np
import pytest
import scipy.io
from recording_files import FACTORS, FULL, NAMES, RIG, N, read, table, text

from workbench.differentiator import derivative
from workbench.errors import InputError
from workbench.reading import RecordingWarning, read_recording, text_table, write_recording
from workbench.recording import Recording, joined
from workbench.rig import default_rig, load_rig


def assert_same(recording: Recording, rows: np.ndarray) -> None:
    assert recording.sample_time_s == 1e-3
    for name, column, factor in zip(FULL, rows.T[1:], FACTORS, strict=True):
        assert recording[name] == pytest.approx(factor * column, rel=1e-7)


@pytest.mark.parametrize(
    ("separator", "change"),
    [
        (",", lambda s: s),
        (", ", lambda s: s),
        (";", lambda s: s.replace(".", ",")),
        ("\t", lambda s: s.replace(".", ",")),
        ("  ", lambda s: s.replace(".", ",")),
        (" ", lambda s: s),
        ("|", lambda s: s),
        (",", lambda s: s.replace("\n", "\ns,V,bar,mm\n", 1)),
        (",", lambda s: "# logged by hand\n\n" + s),
        (",", lambda s: "# " + s),
        (",", lambda s: s.replace("\n", "\r\n")),
        (",", lambda s: "\ufeff" + s),
        (",", lambda s: s.replace("time_s", '"time_s"')),
        (",", lambda s: re.sub(r"([-+]?\d+)\.(\d+)", r'"\1,\2"', s)),
    ],
)
def test_every_dialect_of_csv_gives_the_same_channels(tmp_path, separator, change):
    rows = table()

    recording = read(tmp_path, change(text(rows, separator)))

    assert_same(recording, rows)
    assert recording.noise == {"chamber_a.pressure_pa": 400.0}


def test_columns_may_be_numbers_of_a_file_without_names(tmp_path):
    rig = RIG
    for number, name in enumerate(NAMES, start=1):
        rig = rig.replace(f'"{name}"', str(number))
    rows = table()
    content = "logger 3\nsecond line\n" + text(rows, "\t").split("\n", 1)[1]

    assert_same(read(tmp_path, content, "header = false\nskip = 2", rig), rows)


def test_a_thousands_point_beside_a_decimal_point(tmp_path):
    rows = table(2000) * [1e3, 1, 1, 1]
    lines = [f"{t:,.3f}".replace(",", ".") + f";{u:.9g};{p:.9g};{x:.9g}" for t, u, p, x in rows]
    rig = RIG.replace('unit = "s"', 'unit = "ms"')

    recording = read(
        tmp_path, "\n".join([";".join(NAMES), *lines]), 'thousands = "."\ndecimal = "."', rig
    )

    assert "1.234.000;" in "\n".join(lines)
    assert_same(recording, rows)


def test_commas_between_thousands_in_quotes_separate_no_cells(tmp_path):
    rows = table(2000) * [1e3, 1, 1, 1]
    lines = [f'"{t:,.3f}",{u:.9g},{p:.9g},{x:.9g}' for t, u, p, x in rows]
    rig = RIG.replace('unit = "s"', 'unit = "ms"')

    recording = read(tmp_path, "\n".join([",".join(NAMES), *lines]), 'thousands = ","', rig)

    assert '\n"1,234.000",' in "\n".join(lines)
    assert_same(recording, rows)


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_matlab_files_of_both_versions_hold_vectors_and_structures(tmp_path, version):
    rows = table()
    path = tmp_path / "run.mat"
    if version == "5":
        log = {"y": rows[:, 1:3], "x": rows[:, 3:]}
        scipy.io.savemat(path, {"t": rows[:, 0], "log": log, "note": "hello"})
    else:
        with h5py.File(path, "w", userblock_size=512) as file:  # columns first, as MATLAB does
            file["t"], file["log/y"], file["log/x"] = rows[None, :, 0], rows[:, 1:3].T, rows[:, 3]
    rig = RIG.replace("time_s", "t").replace("command_V", "log.y(:,1)")
    rig = rig.replace("pressure_a_bar", "log.y(:,2)").replace("position_mm", "log.x")

    assert_same(read_recording(load_rig(rig), path), rows)


def test_a_matlab_object_is_refused_with_the_way_out(tmp_path):
    path = tmp_path / "run.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["ts"] = np.zeros((1, 6), dtype=np.uint32)
        file["ts"].attrs["MATLAB_class"] = np.bytes_("timeseries")
        file["ts"].attrs["MATLAB_object_decode"] = np.int32(3)

    with pytest.raises(InputError, match=r"s = struct\('t', ts.Time, 'y', ts.Data\)"):
        read_recording(load_rig(RIG), path)


def test_missing_samples_of_an_output_stay_missing(tmp_path):
    lines = text(table()).splitlines()
    for number in range(51, 71):
        cells = lines[number].split(",")
        lines[number] = ",".join([*cells[:3], "" if number % 2 else "NaN"])

    recording = read(tmp_path, "\n".join(lines))

    assert np.flatnonzero(np.isnan(recording["slide.position_m"])).tolist() == list(range(50, 70))


def test_columns_that_the_rig_does_not_read_are_known_by_name(tmp_path):
    lines = text(table()).splitlines()
    more = [",".join((line, str(k))) for k, line in enumerate(lines[1:])]

    assert read(tmp_path, text(table())).unmapped == ()
    assert read(tmp_path, "\n".join([f"{lines[0]},supply_bar", *more])).unmapped == ("supply_bar",)


def test_a_row_that_was_not_finished_is_left_out(tmp_path):
    with pytest.warns(RecordingWarning, match=r"run\.csv:401: unfinished row left out"):
        recording = read(tmp_path, text(table())[:-20])

    assert len(recording) == N - 1


def test_a_written_recording_reads_back(tmp_path):
    rows = table()
    first = read(tmp_path, text(rows))

    write_recording(first, tmp_path / "out.csv", {"slide.position": "m"})
    assert (tmp_path / "out.csv").read_text().splitlines()[:2] == [
        "time,valve.command,chamber_a.pressure,slide.position",
        "s,V,bar,m",
    ]

    write_recording(first, tmp_path / "out.csv")
    assert_same(read_recording(default_rig("servo_drive"), tmp_path / "out.csv"), rows)


def test_a_command_beyond_its_range_is_said(tmp_path):
    """The plant takes its end: 14 V did what 10 V do, without a word."""
    rows = table()
    rows[100:120, 1] = 12.0 / FACTORS[0]
    with pytest.warns(RecordingWarning, match=r"goes to 12 V, beyond 0 V to 10 V, in 20"):
        read(tmp_path, text(rows))


def test_what_the_workbench_wrote_is_read_whatever_columns_the_rig_has(tmp_path):
    """A simulation was refused by the rig that it was simulated with."""
    first = read(tmp_path, text(table()))
    write_recording(first, tmp_path / "out.csv")
    rig = load_rig(
        'plant = "servo_drive"\n[recording]\ndecimal = ","\nseparator = ";"\n'
        'time = {column = "t_ms", unit = "ms"}\n[recording.channels]\n'
        '"valve.command" = {column = "u", unit = "mV"}\n'
        '"slide.position" = {column = "x", unit = "mm", noise = "1 mm"}\n'
    )
    again = read_recording(rig, tmp_path / "out.csv")

    assert_same(again, table())
    assert again.noise == {"slide.position_m": 1e-3}


def test_written_pieces_are_found_again(tmp_path):
    rows = table()
    whole = Recording("r", 1e-3, dict(zip(FULL, (rows[:, 1:] * FACTORS).T, strict=True)))
    cut = replace(whole, starts=(0, 150, 300))

    write_recording(cut, tmp_path / "out.csv")
    rig = load_rig('plant = "servo_drive"\n[recording]\ntime = {column = "time", unit = "s"}\n'
                   'gaps = "split"\n')  # fmt: skip

    assert read_recording(rig, tmp_path / "out.csv").starts == cut.starts


@pytest.mark.parametrize("begins_s", [0.0, 1234.5, 1.7e9])
def test_what_is_written_has_the_clock_of_the_file_that_it_is_from(tmp_path, begins_s):
    """Laid over its recording, a simulation had stood where that one's file began at zero."""
    rows = table(100)
    lines = [f"{begins_s + t:.3f},{u},{p},{y}" for t, u, p, y in rows]
    found = read(tmp_path, "\n".join([",".join(NAMES), *lines]) + "\n")
    write_recording(found.part(20, 60), tmp_path / "out.csv")

    times = np.genfromtxt(tmp_path / "out.csv", delimiter=",", skip_header=2)[:, 0]
    assert found.time_s[0] == 0.0 and found.begins_s == begins_s
    np.testing.assert_allclose(times - begins_s, 1e-3 * np.arange(20, 60), atol=1e-6)
    back = read_recording(default_rig("servo_drive"), tmp_path / "out.csv")
    assert back.sample_time_s == pytest.approx(1e-3) and len(back) == 40


def test_ten_seconds_at_a_kilohertz_are_read_at_once(tmp_path, monkeypatch):
    """By numpy: 0.04 s on an idle machine; cell by cell it takes fifty times that."""
    monkeypatch.setattr(text_table, "_cell_by_cell", lambda *asked: pytest.fail("cell by cell"))

    assert len(read(tmp_path, text(table(10_000)))) == 10_000


def test_the_differentiator_is_exact_on_a_parabola_and_stays_inside_pieces():
    t = 0.01 * np.arange(40)
    position = np.concatenate([3 * t**2, 5 + 0 * t])

    speed = derivative(position, 0.01, starts=(0, 40))

    assert speed == pytest.approx(np.concatenate([6 * t, 0 * t]), abs=1e-10)


def test_recordings_are_joined_as_pieces_of_the_channels_that_all_have():
    gap = Recording("gap", 0.1, {"a": np.arange(5.0), "b": np.zeros(5)}, starts=(0, 2))
    plain = Recording("plain", 0.1, {"a": np.arange(3.0)})
    both = joined([gap, plain])

    assert both.starts == (0, 2, 5)
    assert list(both.channels) == ["a"]
    assert [piece["a"].tolist() for piece in both.pieces] == [[0, 1], [2, 3, 4], [0, 1, 2]]
    assert joined([gap]) is gap


def test_a_row_of_units_that_says_another_one_than_the_rig_is_refused(tmp_path):
    """A unit that is off by a thousand would be read without a word."""
    content = text(table()).replace("\n", "\nms,V,bar_gauge,m\n", 1)

    with pytest.raises(InputError) as error:
        read(tmp_path, content)

    said = str(error.value)
    for told, unit in (("ms", "s"), ("bar_gauge", "bar"), ("m", "mm")):
        assert f"the file says {told}, the rig {unit};" in said
    assert "the file says V" not in said


def test_words_below_the_names_that_are_no_units_say_nothing(tmp_path):
    rows = table()

    with pytest.warns(RecordingWarning, match="the file's unit 'time' is unknown"):
        found = read(tmp_path, text(rows).replace("\n", "\ntime,-,[bar],(mm)\n", 1))
    assert_same(found, rows)


def test_a_gauge_whose_row_of_units_says_bar_is_read_as_the_rig_says(tmp_path):
    content = text(table()).replace("\n", "\ns,V,bar,mm\n", 1)
    gauge = RIG.replace('unit = "bar"', 'unit = "bar_gauge"')
    absolute, above = read(tmp_path, content), read(tmp_path, content, "", gauge)
    pressure = "chamber_a.pressure_pa"

    assert above[pressure] - absolute[pressure] == pytest.approx(1e5)  # what the rig has around it
