"""Where a run ends its reference goes on: no controller that looks ahead sees a sine stop."""

import numpy as np
import pytest

from controllers.design_file import design
from studies.following_check import followed, observer_of, tasks_of
from studies.scenarios import SCENARIOS
from workbench.plants import PLANTS


def goes_on(run, after):
    """True where no third difference across the end is larger than those within the run."""
    jerk = np.abs(np.diff(np.append(run, after), 3))
    return jerk[len(run) - 4 : len(run) + 2].max() <= 1.01 * jerk[4 : len(run) - 4].max()


@pytest.mark.parametrize("name", ["crr_rig", "crr_arm", "crr_leg"])
def test_a_moving_reference_goes_on_after_its_run_as_smoothly_as_in_it(name):
    for task in tasks_of(PLANTS[name]()).values():
        for key, run in task.reference.items():
            assert goes_on(run, task.afterwards.get(key, run[-1:].repeat(4)))


def test_the_sine_of_the_drive_goes_on():
    sine = SCENARIOS["sine"](0.3)

    assert goes_on(sine.reference_m, sine.afterwards_m)


def test_no_command_jumps_at_the_end_of_a_sine():
    """Before, the rig's sine stopped at full speed, and the valve braked it."""
    plant = PLANTS["crr_rig"]().lean()
    made = design("axis-lq", plant).controller
    task, observer = tasks_of(plant)["1-hz"], observer_of("ekf", plant, made.sample_time_s)
    steps = np.abs(np.diff(followed(plant, made, observer, task, 0).recording["valve.command_v"]))

    assert steps[-10:].max() < steps[round(1e3 * task.judged_s) : -10].max()
