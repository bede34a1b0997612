"""Gains for people: name, unit and digits of every number, whatever the method."""

import numpy as np
import pytest

from controllers.design_file import design, write_design
from controllers.gain_text import gain_rows, gains
from controllers.lq import Gain
from controllers.scheduled import constant
from workbench.plants.crr_leg import crr_leg
from workbench.plants.servo_drive import servo_drive


class Loop:
    """A controller with one gain, small where it meets a pressure."""

    gains = constant(
        Gain(
            np.array([224.136, 3.70551, 1.13541e-5, -1.17912e-5]),
            1732.359,
            np.array([-49.3149 + 78.2406j, -49.3149 - 78.2406j, -59.8908, -1.4317]),
        )
    )


def test_every_gain_has_its_state_its_unit_and_four_digits():
    told = [*gains(Loop())]

    assert told[:2] == [
        (
            "forward at 0 m",
            "position 224.1 V/m, velocity 3.706 V s/m, chamber_a.pressure 1.135e-05 V/Pa, "
            "chamber_b.pressure -1.179e-05 V/Pa, integral 1732 V/(m s)",
        ),
        ("forward at 0 m, poles", "-1.432, -49.31±78.24j, -59.89 1/s"),
    ]


def test_a_pole_at_a_negative_z_is_told_once_and_as_what_it_is():
    """At 50 ms a loop of five states had six poles: the one without a partner stood as a pair."""
    (row, *_), (_, (_, told), *_) = (
        [*each(design("lq", servo_drive(), {"sample_time_s": 0.05}).controller)]
        for each in (gain_rows, gains)
    )
    (alone,) = (pole for pole in row.poles if pole.imag == pytest.approx(np.pi / 0.05))
    words = told.removesuffix(" 1/s").split(", ")

    assert len(row.poles) == 5 == len(words) + told.count("±")
    assert words[-1] == f"{alone.real:.4g}+62.83j (alone: alternates each sample)"


@pytest.mark.parametrize(
    ("method", "said"),
    [
        ("pid", ("proportional", "V/m, integral", "V/(m s), derivative", "V s/m")),
        ("cascade", ("force", "V/N, speed", "V s/m, stiffness", "N/m, damping", "N/(m s)")),
    ],
)
def test_gains_of_other_methods_have_units_too(method, said, tmp_path):
    found = design(method, servo_drive())
    (_, text), (_, poles), *_ = gains(found.controller)
    write_design(found, tmp_path / "design.toml")

    assert all(word in text for word in said) and poles.endswith(" 1/s")
    assert f"0.04833 m: {text}\n" in (tmp_path / "design.toml").read_text(encoding="utf-8")


def test_gains_of_a_leg_are_told_joint_by_joint():
    names = [name for name, _ in gains(design("joint-lq", crr_leg()).controller)]

    assert len(names) == 3 * 6 * 2
    assert names[0].startswith("joint_1, forward at ") and names[0].endswith(" rad")
    assert "joint_1, forward at 0 rad" in names  # it had been 7.907e-10 rad
