"""The PID of any axis as `design` makes it: its tuner's hints, gains of one's own, its bench."""

import re

import pytest

from controllers.design_file import design
from workbench.errors import InputError
from workbench.plants.crr_arm import crr_arm
from workbench.plants.crr_rig import crr_rig
from workbench.plants.servo_drive import servo_drive


@pytest.mark.parametrize("plant", [crr_arm(), servo_drive()], ids=lambda plant: plant.name)
def test_the_bandwidth_that_a_refusal_names_is_one_that_all_modes_allow(plant):
    """It had been that of the first mode, rounded upwards, and was refused itself."""
    asked = {"phase_margin_rad": 0.7, "overshoot": 0.3}
    with pytest.raises(InputError, match=r"for example [\d.]+ Hz") as refused:
        design("axis-pid", plant, {"tuning": {**asked, "bandwidth_hz": 3.0}})
    hint = float(re.search(r"for example ([\d.]+) Hz", str(refused.value))[1])

    design("axis-pid", plant, {"tuning": {**asked, "bandwidth_hz": hint}})
