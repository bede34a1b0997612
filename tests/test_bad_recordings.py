"""Bad recordings: one clear message each, with the place and what was expected."""

import numpy as np
import pytest
from recording_files import NAMES, RIG, N, read, refused, table, text

from workbench.errors import InputError
from workbench.reading import RecordingWarning, read_recording
from workbench.rig import load_rig

ON_OFF = """"valve_1.command" = { column = "command_V", unit = "" }
"valve_2.command" = { column = "command_2", unit = "" }"""


def _cell(row: int, column: int, value: str):
    def change(content: str) -> str:
        lines = content.splitlines()
        cells = lines[row].split(",")
        lines[row] = ",".join([*cells[:column], value, *cells[column + 1 :]])
        return "\n".join(lines)

    return change


BAD = {
    "empty file": (lambda s: " \n", "", "run.csv: the file is empty"),
    "no text": (lambda s: "PK\3\4\0\0" + s, "", "is no text; expected a CSV, MAT or MDF file"),
    "picture": (lambda s: "\x89PNG\r\n\x1a\n\x01\x02IHDR" + s, "", "is no text; expected a CSV"),
    "spoiled cell": (_cell(9, 2, "\x00\x07" * 50), "", "'\\x00\\x07"),
    "names only": (lambda s: s.split("\n")[0], "", "no rows of numbers"),
    "no names": (lambda s: s.split("\n", 1)[1], "", "run.csv:1: the first row holds numbers"),
    "missing column": (
        lambda s: s.replace("position_mm", "positionmm"),
        "",
        "slide.position: no column 'position_mm'; expected one of time_s, command_V, "
        "pressure_a_bar, positionmm; did you mean 'positionmm'?",
    ),
    "column twice": (lambda s: s.replace("position_mm", "command_V"), "", "2 columns are called"),
    "another plant": (
        lambda s: s.replace("_", "-").replace("time-s", "time_s"),
        "",
        "is it a recording of another plant?",
    ),
    "text": (
        _cell(9, 2, "#OVL"),
        "",
        "run.csv:10: pressure_a_bar: '#OVL' in column 3 is not a number; expected an empty cell "
        "where nothing was measured",
    ),
    "text for a time": (_cell(9, 0, "x"), "", "'x' in column 1 is not a number; expected numbers"),
    "date for a time": (
        _cell(1, 0, "2024-05-02 10:11:12.000"),
        "",
        "run.csv:2: time_s: '2024-05-02 10:11:12.000' in column 1 is a date and time; expected "
        'numbers in s, or the time between rows, time = { step = "1 ms" } in [recording]',
    ),
    "clock for a time": (_cell(1, 0, "10:11:12.5Z"), "", "is a time of day; expected numbers"),
    "day for a time": (_cell(1, 0, "2.5.24"), "", "is a date; expected numbers in s, or the time"),
    "time for a pressure": (_cell(1, 2, "10:11"), "", "is a time of day; expected numbers"),
    "unclear comma": (
        _cell(9, 2, '"1,234"'),
        "",
        "'1,234' in column 3 is not a number; expected decimal or thousands = \",\" in [recording]",
    ),
    "short row": (lambda s: s.replace("\n0.1,", "\n0.1\n0.1,"), "", "this row has 1 columns"),
    "backwards": (_cell(9, 0, "0.003"), "", "runs backwards at line 10: 0.003 s after 0.007 s"),
    "standing": (_cell(9, 0, "0.007"), "", "time stands still at line 10"),
    "no time": (_cell(9, 0, "nan"), "", "no time at line 10"),
    "input missing": (_cell(9, 1, "nan"), "", "1 samples are missing from line 10 on"),
    "beyond skip": (lambda s: s, "skip = 1000", "no rows after the first 1000"),
}  # fmt: skip


def test_a_comma_that_the_rig_does_not_expect_is_told_as_one(tmp_path):
    """Beside ``an empty cell where nothing was measured`` one would have deleted what is there."""
    content = text(table()).replace(",", ";").replace(".", ",").replace("_s,", "_s.")

    said = refused(tmp_path, content, 'decimal = "."')

    assert 'is not a number; expected decimal = "," in [recording]' in said


@pytest.mark.parametrize("case", BAD)
def test_bad_files_get_one_clear_message(tmp_path, case):
    change, section, message = BAD[case]

    assert message in refused(tmp_path, change(text(table())), section)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bar": "Pa"}, "chamber_a.pressure: values between 3.998 and 6 look like bar"),
        ({"mm": "m"}, "slide.position: values between 140 and 230 look like mm"),
        ({"bar": "bar_gauge"}, None),
        ({"bar": "Pa_gauge"}, "look like bar"),
    ],
)
def test_a_unit_that_cannot_be_is_refused(tmp_path, change, message):
    ((old, new),) = change.items()
    rig = RIG.replace(f'unit = "{old}"', f'unit = "{new}"')
    content = text(table())

    if message is None:
        assert len(read(tmp_path, content, rig=rig)) == N
    else:
        assert message in refused(tmp_path, content, rig=rig)


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (10.0, "look ten times too large or psi; expected another unit than 'bar', or another"),
        (0.1, "values between 0.2748 and 0.475 look like MPa; expected another unit than 'bar'"),
        (100.0, "look like kPa"),
    ],
)
def test_pressures_that_are_ten_times_too_large_are_told_so(tmp_path, factor, said):
    rows = table()
    rows[:, 2] = factor * (rows[:, 2] - (1.25 if factor < 1 else 0.0))

    assert said in refused(tmp_path, text(rows))


@pytest.mark.parametrize(
    ("unit", "low", "high", "said"),
    [
        ("bar", 10.0, 55.0, "look ten times too large or psi"),
        ("bar_gauge", 0.0, 55.0, "look ten times too large or psi"),
        ("bar_gauge", 2.0, 55.0, "look ten times too large or psi"),
        ("bar", 0.12, 0.2, "look like MPa"),
        ("psi", 3.0, 7.0, "look ten times too small or bar"),
        ("bar_gauge", 0.001, 0.008, "look ten times too small;"),
        ("bar_gauge", 0.0001, 0.0009, "cannot be"),
    ],
)
def test_ten_times_is_of_what_the_sensor_sees_which_ambient_is_no_part_of(
    tmp_path, unit, low, high, said
):
    rows = table()
    rows[:, 2] = np.linspace(low, high, N)
    rig = RIG.replace('unit = "bar"', f'unit = "{unit}"')

    assert said in refused(tmp_path, text(rows), rig=rig)


def test_gauge_pressures_read_as_absolute_are_refused(tmp_path):
    rows = table()
    rows[:, 2] -= 5.0

    assert "cannot be; expected 'bar_gauge'" in refused(tmp_path, text(rows))


def test_an_output_that_never_changes_is_refused(tmp_path):
    rows = table()
    rows[:, 3] = 145.0

    assert "slide.position: is 145 mm in all 400 samples" in refused(tmp_path, text(rows))
    rows[:3, 3] = np.nan
    assert "slide.position: is 145 mm in all 397 samples" in refused(tmp_path, text(rows))


def test_a_sensor_that_sticks_or_saturates_is_warned_of(tmp_path):
    rows = table()
    rows[100:200, 2] = rows[:, 2].max()

    with pytest.warns(RecordingWarning, match=r"chamber_a\.pressure: saturated at 6\.0"):
        read(tmp_path, text(rows))


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (7.0, "valve_1.command: is 7 in sample 12; expected 0 or 1"),
        (0.5, "valve_1.command: is 0.5 in sample 12; expected 0 or 1"),
        (1.0, None),
    ],
)
def test_a_switched_command_is_at_one_of_its_levels(tmp_path, value, said):
    rig = RIG.replace("servo_drive", "gearbox").replace("slide", "main_piston")
    rig = rig.replace('"valve.command" = { column = "command_V", unit = "V" }', ON_OFF)
    rig = rig.replace("chamber_a", "chamber_1")
    rows = table()
    rows[:, 1] = np.arange(N) % 100 < 50
    rows = np.column_stack([rows, rows[:, 1]])
    rows[11, 1] = value
    content = text(rows, head=",".join([*NAMES, "command_2"]))

    if said is None:
        assert len(read(tmp_path, content, rig=rig)) == N
    else:
        assert said in refused(tmp_path, content, rig=rig)


def test_a_column_read_by_name_and_by_number_feeds_one_signal(tmp_path):
    rig = RIG.replace('"position_mm"', "3").replace('unit = "mm"', 'unit = "cm"')

    said = refused(tmp_path, text(table()), rig=rig)
    assert "slide.position: column 3 is that of chamber_a.pressure already; expected a" in said


@pytest.mark.parametrize(
    ("factor", "unit", "said"),
    [
        (1.0, "ms", r"400 samples 1e-06 s apart, 0\.000399 s long, look like times in s; expected"),
        (1e4, "s", r"10 s apart, 3990 s long, look like times in ms; expected "),
        (1e7, "ms", "look like times in us; expected"),
    ],
)
def test_times_in_another_unit_than_the_rig_says_are_warned_of(tmp_path, factor, unit, said):
    rows = table()
    rows[:, 0] = np.round(factor * rows[:, 0], 9)
    rig = RIG.replace('unit = "s"', f'unit = "{unit}"')

    with pytest.warns(RecordingWarning, match=said):
        read(tmp_path, text(rows), rig=rig)


def test_sample_numbers_read_as_seconds_are_warned_of(tmp_path):
    rows = table(3000)
    rows[:, 0] = np.arange(len(rows))

    with pytest.warns(RecordingWarning, match=r"or sample numbers; expected .* or step = ") as told:
        read(tmp_path, text(rows))
    assert "3000 samples 1 s apart, 2999 s long" in str(told[0].message)


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1.0, "s"), (1e3, "ms"), (100.0, "s"), (0.1, "s"), (200.0, "s")],
)
@pytest.mark.filterwarnings("error")
def test_an_ordinary_clock_is_not_warned_of(tmp_path, factor, unit):
    rows = table()
    rows[:, 0] = np.round(factor * rows[:, 0], 9)

    read(tmp_path, text(rows), rig=RIG.replace('unit = "s"', f'unit = "{unit}"'))


def _numbered(content: str) -> str:
    """Row numbers in front without a name above them, as R writes a table."""
    head, *rows = content.splitlines()
    return "\n".join([head, *(f"{k},{row}" for k, row in enumerate(rows))])


def _spaced(content: str) -> str:
    """Spaces between columns, and one within the first name."""
    return content.replace(",", " ").replace("command_V", "valve command_V")


@pytest.mark.parametrize(
    ("change", "counts"), [(_numbered, (4, 5)), (_spaced, (5, 4))], ids=["row numbers", "spaces"]
)
def test_names_that_do_not_stand_above_their_columns_are_refused(tmp_path, change, counts):
    """All channels would be read from the column beside their own."""
    said = refused(tmp_path, change(text(table())))

    told = "{} names of columns stand above {} columns".format(*counts)
    assert f"run.csv:1: {told}; expected a name above each column" in said
    assert len(said.splitlines()) == 1


def test_columns_by_number_and_separators_at_the_end_of_rows_need_no_names(tmp_path):
    content = text(table())
    rig = RIG
    for number, name in enumerate(NAMES, start=2):
        rig = rig.replace(f'"{name}"', str(number))

    plain = read(tmp_path, content)
    counted = read(tmp_path, _numbered(content), rig=rig)
    ended = read(tmp_path, content.replace("\n", ",\n").replace(",\n", "\n", 1))

    for name, values in plain.channels.items():
        assert np.array_equal(counted[name], values) and np.array_equal(ended[name], values)


def test_a_file_that_is_not_there_names_its_neighbour(tmp_path):
    (tmp_path / "run1.csv").write_text("x")

    with pytest.raises(InputError, match=r"no such file; did you mean 'run1\.csv'"):
        read_recording(load_rig(RIG), tmp_path / "run2.csv")
