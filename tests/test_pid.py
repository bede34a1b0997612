"""The PID of a drive: gains from the loop as it is run, and what they do on the whole plant."""

import numpy as np
import pytest

from controllers.design_file import design
from controllers.margins import closed, margins
from controllers.pid import PidSpec, pid_gain
from controllers.scheduled import driven_modes
from linearize.standard import standard_modes
from studies.closed_loop_check import check
from workbench.errors import InputError
from workbench.plants.servo_drive import servo_drive


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


@pytest.mark.parametrize("spec", [PidSpec(), PidSpec(sample_time_s=2e-3, filter_s=2e-3)])
def test_the_proportional_gain_is_a_share_of_where_the_sampled_loop_begins_to_swing(hybrid, spec):
    """Routh's limit knows neither sampling nor filter: all modes were unstable under its share."""
    dt = spec.sample_time_s
    for mode in (mode for side in driven_modes(hybrid) for mode in side):
        found = pid_gain(mode, spec)

        def radius(factor, found=found, mode=mode):
            kp = factor * found.proportional / spec.share_of_limit
            gain = type(found)(kp, kp / spec.integral_time_s, found.derivative, found.poles)
            return np.abs(np.linalg.eigvals(closed(mode, gain.law(dt, spec.filter_s), dt))).max()

        assert radius(0.99) < 1.0 < radius(1.01)


def test_a_bandwidth_is_refused_with_the_method_that_is_tuned_to_one():
    with pytest.raises(InputError, match=r"pid\.bandwidth_hz: .*; `axis-pid` is tuned"):
        design("pid", servo_drive(), {"bandwidth_hz": 3.0})


def test_a_design_file_of_before_has_a_stable_loop_in_every_mode():
    numbers = {"sample_time_s": 2e-3, "filter_s": 2e-3, "share_of_limit": 0.4}
    found = design("pid", servo_drive(), numbers)

    assert all(each.stable for each in margins(found.hybrid, found.controller.laws, 2e-3))


def test_the_default_comes_nearer_to_its_place_and_its_sine_than_the_unstable_one_did():
    """0.038 mm and 0.53 mm RMSE; they had been 0.051 mm and 1.66 mm."""
    plant = servo_drive()
    step, sine = check(
        plant, {"pid": design("pid", plant).controller}, ["ekf"], ["step", "sine"]
    ).rows

    assert step.reached and step.final_error_m < 5e-5
    assert sine.rmse_m < 1e-3
