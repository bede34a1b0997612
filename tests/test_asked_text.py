"""Lines of a specification as text: what is asked, and what was found."""

from math import inf

import pytest

from studies.specification import read_specification
from workbench.rig import default_rig

DRIVE = default_rig("servo_drive")


@pytest.mark.parametrize(
    ("limit", "text"),
    [
        ('slide.velocity = "1 m/s"', "-1 to 1 m/s"),
        ('slide.velocity = ["-500 mm/s", "1 m/s"]', "-0.5 to 1 m/s"),
        ('slide.position = ["10 mm", "280 mm"]', "10 to 280 mm"),
        ('"chamber_a.pressure" = "7 bar"', "at most 7 bar"),
        ('"chamber_a.pressure" = "6 bar_gauge"', "at most 6 bar_gauge"),
    ],
)
def test_a_limit_of_a_state_with_a_sign_is_told_from_both_sides(limit, text):
    (line,) = read_specification(f"[limits]\n{limit}\n", DRIVE).asked

    assert line.text == text


def test_what_never_settles_is_said_so():
    (line,) = read_specification('settling_time = "150 ms"\n', DRIVE).asked

    assert (line.shown(inf), line.shown(0.12)) == ("never", "120 ms")
