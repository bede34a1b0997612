"""Times in another unit than the rig says are told of, or refused where nothing can be told."""

import time
import warnings

import numpy as np
import pytest
from recording_files import RIG, read, refused, table, text

from workbench.plants import PLANTS
from workbench.reading.table import RecordingWarning
from workbench.reading.time_unit import check_time_unit
from workbench.units import scale

VESSEL = """plant = "closed_chamber"
[recording]
time = { column = "time_s", unit = "s" }
[recording.channels]
"chamber.pressure" = { column = "pressure_a_bar", unit = "bar" }
"""


def stamped(factor: float, unit: str = "s") -> tuple[str, str]:
    """A recording whose times are those of a 1 kHz log times ``factor``, and its rig."""
    rows = table()
    rows[:, 0] = factor * rows[:, 0]
    return text(rows), RIG.replace('unit = "s"', f'unit = "{unit}"')


@pytest.mark.parametrize("step_ms", [1.0, 2.0, 4.99])
def test_milliseconds_read_as_seconds_are_warned_of_where_the_plant_moves(tmp_path, step_ms):
    """Steps of 1 to 5 s passed for ordinary: a whole diagnosis ran on a clock 1000 times slow."""
    content, rig = stamped(1e3 * step_ms)

    with pytest.warns(RecordingWarning, match=r'look like times in ms.*; expected unit = "ms"'):
        read(tmp_path, content, rig=rig)


@pytest.mark.parametrize(
    ("unit", "told"),
    [("s", "ms"), ("s", "us"), ("s", "ns"), ("ms", "s"), ("s", "min"), ("s", "h"), ("s", "day")],
)
@pytest.mark.parametrize("step_s", [1e-3, 0.01])
def test_a_clock_in_another_unit_is_never_read_without_a_word(unit, told, step_s):
    raw = step_s * np.arange(400) / scale(told, "time_s").factor
    ordinary = (unit, told, step_s) == ("s", "min", 0.01)  # 0.17 ms: a fast logger in seconds

    said = _said(raw, unit, PLANTS["servo_drive"]())

    assert ordinary or f'unit = "{told}"' in said


@pytest.mark.parametrize(
    ("raw", "unit"),
    [
        (1.7e18 + 1e6 * np.arange(400), "ns"),
        (1e6 * np.arange(400), "ns"),
        (1e3 * np.arange(400), "us"),
        (739000.0 + np.arange(400) * 1e-3 / 86400, "day"),
    ],
    ids=["Unix time in ns", "ns", "us", "datenum"],
)
def test_times_of_which_nothing_can_be_told_are_refused_at_once(tmp_path, raw, unit):
    rows = table()
    rows[:, 0] = raw
    lines = [",".join(f"{x:.17g}" for x in row) for row in rows]
    content = "\n".join([text(rows).splitlines()[0], *lines])
    begun = time.perf_counter()

    said = refused(tmp_path, content)

    assert f'unit = "{unit}"' in said and "in the time of [recording]" in said
    assert len(said.splitlines()) == 1
    assert time.perf_counter() - begun < 5.0


def test_a_step_that_no_unit_makes_ordinary_is_warned_of_too(tmp_path):
    content, rig = stamped(1e12, "ns")

    with pytest.warns(RecordingWarning, match=r"1 s apart, .* look like no times of servo_drive;"):
        read(tmp_path, content, rig=rig)


@pytest.mark.parametrize("step_s", [1e-3, 0.01, 0.1, 1.0, 4.0])
@pytest.mark.filterwarnings("error")
def test_a_vessel_is_sampled_as_slowly_as_every_five_seconds(tmp_path, step_s):
    rows = table()
    rows[:, 0] = step_s * np.arange(len(rows))

    found = read(tmp_path, text(rows), rig=VESSEL)

    assert found.sample_time_s == pytest.approx(step_s)


def _said(raw, unit, plant) -> str:
    """What is warned of, or refused."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            check_time_unit(raw, unit, plant, "run.csv")
        except ValueError as error:
            return str(error)
    return " ".join(str(each.message) for each in told)
