"""Lines of a specification that make no sense, or stand where they mean something else."""

import pytest

from controllers.design_file import design
from studies.design_text import search_text
from studies.specification import read_specification
from workbench.errors import InputError
from workbench.plants.gearbox import gearbox
from workbench.rig import default_rig

DRIVE = default_rig("servo_drive")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            '[limits]\n"slide.velocity" = "1.2 m/s"\nrise_time = "150 ms"',
            "spec:3: rise_time: stands inside [limits]; move it above the tables",
        ),
        (
            '[mpc]\nhorizon = 20\nrise_time = "150 ms"',
            "spec:3: rise_time: stands inside [mpc]; move it above the tables",
        ),
        (
            '[mpc.positioning]\nair = "1 g"',
            "spec:2: air: stands inside [mpc.positioning]; move it above the tables",
        ),
        (
            "[axis-pid.tuning]\novershoot = -1",
            "spec:2: axis-pid.tuning.overshoot: is -1; expected a number from 0 to 1",
        ),
        ('rise_time = "0 ms"', "spec:1: rise_time: is 0 ms; expected a time above 0, to 3600 s"),
        (
            'settling_time = "1e300 s"',
            "spec:1: settling_time: is 1e300 s; expected a time above 0, to 3600 s",
        ),
        (
            'rise_time = "-150 ms"',
            "spec:1: rise_time: is -150 ms; expected a time above 0, to 3600 s",
        ),
        ("rise_time = nan", "spec:1: rise_time: 'nan' has no unit; expected \"1.5 s\""),
    ],
)
def test_a_line_is_refused_in_one_sentence_that_tells_what_to_do(text, told):
    with pytest.raises(InputError) as refusal:
        read_specification(text + "\n", DRIVE)

    assert str(refusal.value) == told


def test_the_price_of_a_switch_is_less_than_a_shift_takes():
    with pytest.raises(InputError, match=r"switch_s: is 10+\.0; expected .* above 0 to 0\.05"):
        design("hybrid-mpc", gearbox(), {"switch_s": 1e9})


def test_a_command_is_said_to_hold_for_the_whole_samples_that_it_holds_for():
    """5.5 ms were six samples of 1 ms, and told as 5.5."""
    made = design("hybrid-mpc", gearbox(), {"hold_s": 5.5e-3}).controller

    assert "6 ms between switches" in search_text(made)
