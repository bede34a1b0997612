"""What is wrong in a specification: all of it at once, by line, with what was expected."""

import pytest

from studies.specification import read_specification
from workbench.errors import InputError
from workbench.rig import default_rig

DRIVE = default_rig("servo_drive")


def said(text, rig=DRIVE, scenarios=()):
    """The lines of the refusal."""
    with pytest.raises(InputError) as refusal:
        read_specification(text + "\n", rig, scenarios)
    return [str(message) for message in refusal.value.messages]


def test_a_line_that_no_chosen_scenario_judges_is_refused():
    (line,) = said('air = "1 g"\nrise_time = "1 s"', scenarios=["sine"])

    assert line == "spec:2: rise_time: is not judged in sine; expected a scenario among step"


def test_an_unknown_scenario_is_named_with_the_nearest():
    (line,) = said('air = "1 g"', scenarios=["sinus"])

    assert "sinus" in line and "sine" in line


BAD = """\
rise_tme = "150 ms"
overshoot = "2 V"
air = 3
switches = 2.5
final_error = "-1 mm"
settling_time = "inf s"
impact_speed = "1 m/s"
horizon = 3
[mpc]
horizn = 3
horizon = 0
positioning.band_m = -1
[limits]
"slide.positon" = "1 m"
slide.velocity = ["2 m/s", "1 m/s"]
"chamber_a.pressure" = ["1 bar"]
"chamber_b.pressure" = true
"""


SAID = (
    ("rise_tme", "did you mean 'rise_time'?"),
    ("overshoot", "expected mm or m or %"),
    ("air", 'expected "3 kg"'),
    ("switches", "expected a whole number from 0"),
    ("final_error", "expected a quantity from 0"),
    ("settling_time", "expected a finite quantity"),
    ("impact_speed", "servo_drive is not judged by it; expected one of rise_time"),
    ("horizon", "did you mean 'mpc.horizon'?"),
    ("mpc.horizn", "did you mean 'horizon'?"),
    ("mpc.horizon", "a whole number from 1 to 500"),
    ("mpc.positioning.band_m", "a number from 0"),
    ("slide.positon", "did you mean 'slide.position'?"),
    ("slide.velocity", "the lower one first"),
    ("chamber_a.pressure", "a list of from and to"),
    ("chamber_b.pressure", 'expected "1.5 bar"'),
)


def test_all_that_is_wrong_is_said_at_once_by_line_with_what_was_expected_and_the_nearest():
    lines = said(BAD)

    assert [int(line.split(":")[1]) for line in lines] == [*range(1, 9), *range(10, 13),
                                                          *range(14, 18)]  # fmt: skip
    for line, (name, rest) in zip(lines, SAID, strict=True):
        assert f": {name}: " in line
        assert rest in line


@pytest.mark.parametrize(
    ("typed", "numbers"),
    [
        ("bandwidth_hz", "axis-pid.tuning.bandwidth_hz, cascade.bandwidth_hz"),
        ("phase_margin", "axis-pid.tuning.phase_margin_rad"),
    ],
)
def test_a_number_of_a_controller_above_the_tables_is_told_where_it_stands(typed, numbers):
    (line,) = said(f"{typed} = 1.0")

    assert sorted(numbers.split(", ")) == sorted(
        line.partition("in its table: ")[2].partition(";")[0].split(", ")
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('air = "1 g"\nair = "2 g"', "spec:2: air: stands here a second time"),
        ("air = 1 g", "spec:1: "),
        ("mpc = 3", "spec:1: mpc: 3 is no table"),
        ("limits = 3", "spec:1: limits: 3 is of the wrong type; expected a table"),
    ],
)
def test_a_file_of_another_shape_is_refused_with_its_line(text, expected):
    (line,) = said(text)

    assert line.startswith(expected)
