"""The PID of any axis as `design` makes it: its tuner's hints, gains of one's own, its bench."""

import re
from math import radians

import numpy as np
import pytest

from controllers.axis import axis_of
from controllers.charging import charging_on
from controllers.design_file import design, read_design, write_design
from controllers.pid_tuning import PAPER_GAINS
from controllers.scheduled import driven_modes
from linearize.reduction import closed_command
from linearize.standard import axis_modes
from studies.closed_loop_check import check
from studies.design_report import design_report
from studies.design_text import design_texts
from studies.following_check import check_followed
from workbench.errors import InputError
from workbench.plants.crr_arm import crr_arm
from workbench.plants.crr_rig import crr_rig
from workbench.plants.servo_drive import servo_drive


@pytest.mark.parametrize(
    "plant",
    [pytest.param(crr_arm(), marks=pytest.mark.slow), servo_drive()],
    ids=lambda plant: plant.name,
)
def test_the_bandwidth_that_a_refusal_names_is_one_that_all_modes_allow(plant):
    """It had been that of the first mode, rounded upwards, and was refused itself."""
    asked = {"phase_margin_rad": 0.7, "overshoot": 0.3}
    with pytest.raises(InputError, match=r"for example [\d.]+ Hz") as refused:
        design("axis-pid", plant, {"tuning": {**asked, "bandwidth_hz": 3.0}})
    hint = float(re.search(r"for example ([\d.]+) Hz", str(refused.value))[1])

    design("axis-pid", plant, {"tuning": {**asked, "bandwidth_hz": hint}})


@pytest.mark.parametrize(
    ("plant", "gains", "stable"),
    [
        pytest.param(crr_rig(), (250.0, 200.0, 8.0), True, id="crr_rig", marks=pytest.mark.slow),
        pytest.param(crr_arm(), (4.0, 4.0, 0.4), False, id="crr_arm"),
    ],
)
def test_the_gains_of_the_papers_are_given_in_a_table_of_the_specification(
    tmp_path, plant, gains, stable
):
    """Stable on all six modes of the rig; on the arm it is dry friction that holds them."""
    names = ("proportional", "integral", "derivative")
    table = dict(zip(names, gains, strict=True))
    path = tmp_path / "design.toml"
    write_design(design("axis-pid", plant, {"gains": table}), path)
    found = read_design(path).controller

    assert set(found.gains.forward + found.gains.backward) == {PAPER_GAINS[plant.name]}
    assert [*stable_modes(read_design(path)).values()] == 6 * [stable]


def stable_modes(found):
    """By mode, whether its loop is stable: as `design` tells it."""
    (laws,) = design_report(found, lambda said: None).laws
    return {each.mode: each.stable for each in laws.margins}


def test_a_pd_of_ones_own_has_a_stable_loop_on_every_mode_of_the_rig():
    """The integral that it lacks stood in its law as a pole at one, and all were unstable."""
    own = {"proportional": 250.0, "derivative": 8.0}
    found = stable_modes(design("axis-pid", crr_rig(), {"gains": own}))

    assert found and all(found.values())


@pytest.mark.parametrize(("sample_time_s", "asked_hz"), [(0.02, 26.0), (0.05, 12.0)])
def test_no_bandwidth_is_taken_or_named_that_the_samples_cannot_show(sample_time_s, asked_hz):
    """Beyond half the sampling rate the design was taken, or 19 Hz named where 10 is the end."""
    with pytest.raises(InputError, match=rf"no PID crosses at {asked_hz:g} Hz") as refused:
        numbers = {"sample_time_s": sample_time_s, "tuning": {"bandwidth_hz": asked_hz}}
        design("axis-pid", crr_rig(), numbers)
    hint = re.search(r"for example ([\d.]+) Hz", str(refused.value))

    assert hint and float(hint[1]) < 0.5 / sample_time_s


def test_gains_without_the_proportional_one_are_refused():
    with pytest.raises(InputError, match=r"axis-pid\.gains: needs the proportional gain too"):
        design("axis-pid", crr_rig(), {"gains": {"integral": 200.0}})
    with pytest.raises(InputError, match="is no table"):
        design("axis-pid", crr_rig(), {"gains": "paper"})


def test_a_setpoint_weight_without_an_integral_gain_is_refused():
    own = {"proportional": 250.0, "derivative": 8.0}
    with pytest.raises(InputError, match=r"axis-pid\.setpoint: takes from every step .* integral"):
        design("axis-pid", crr_rig(), {"gains": own, "setpoint": 0.7})


@pytest.mark.parametrize("plant", [crr_arm(), crr_rig()], ids=lambda plant: plant.name)
def test_the_opening_of_a_wanted_motion_moves_the_mode_so_at_once_and_for_good(plant):
    """A reversal at 1 Hz on the mode itself; a series in its derivatives asked for 27 V there."""
    hybrid = axis_modes(plant)
    axis, mode = axis_of(plant), driven_modes(hybrid)[0][1]
    charging = charging_on(mode, axis, closed_command(plant))
    dt, found = 1e-4, []
    rows = [mode.state_names.index(name) for name in axis.pressures]
    pressures = mode.state[rows].copy()
    for k in range(5000):
        phases = 6.0 * dt * np.array([k, k + 1])
        now, coming = np.column_stack([0.1 * np.sin(phases), 0.6 * np.cos(phases)])
        opening = charging.opening(pressures, now[0], coming, dt)
        pressures = charging.after(pressures, now[0], opening, dt)
        reached = charging.rest + charging.drag * coming[0] + charging.push @ pressures
        found.append((opening, reached - coming[1]))
    openings, missed = np.array(found).T

    assert abs(missed).max() < 1e-6
    assert abs(openings[100:]).max() < 3.0


@pytest.mark.parametrize(
    ("plant", "task", "most"),
    [
        (crr_rig(), "0.25-hz", 1.5e-3),
        (crr_rig(), "1-hz", 1.5e-3),
        (crr_arm(), "2-rad-s", radians(1.5)),
        (crr_arm(), "1-hz", radians(2.6)),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_the_default_design_holds_its_bench_as_well_as_was_measured(plant, task, most):
    """Rig 1.1 mm and 1.3 mm, arm 1.2 and 2.4 deg; it had been 3.9, 7.1 mm and 31, 38 deg."""
    found = check_followed(plant, {"pid": design("axis-pid", plant).controller}, ["raw"], [task])
    (row,) = found.rows
    (name,) = row.asked

    assert row.figures[name] < most


@pytest.mark.parametrize("estimator", ["raw", "ekf"])
def test_a_large_step_of_the_rig_is_quick_although_the_valve_meets_its_limit(estimator):
    """Rise 55 and 51 ms, final error 0.4 and 0.8 mm; it had been 1.6 and 2.0 mm."""
    plant = crr_rig()
    pid = design("axis-pid", plant).controller
    (row,) = check_followed(plant, {"pid": pid}, [estimator], ["step"]).rows

    assert row.figures["rise_s"] < 0.08
    assert row.reached


@pytest.mark.parametrize("estimator", ["raw", "ekf"])
def test_a_step_of_the_arm_ends_where_it_is_asked(estimator):
    """0.5 and 1.0 deg; it had been 7.7 and 7.4."""
    plant = crr_arm()
    pid = design("axis-pid", plant).controller
    (row,) = check_followed(plant, {"pid": pid}, [estimator], ["step"]).rows

    assert row.reached


def test_the_default_design_brings_a_drive_to_its_place_and_does_not_swing():
    """0.10 mm, swinging by 0.08 mm; it had been 12 and 11 mm."""
    plant = servo_drive()
    found = check(plant, {"pid": design("axis-pid", plant).controller}, ["ekf"], ["step"])

    assert found.rows[0].reached


def test_a_setpoint_weight_takes_the_overshoot_from_a_step_and_leaves_its_end():
    """Overshoot 0.05 mm, end 0.14 mm; with 1 the step of the rig overshoots by 3.6 mm."""
    plant = crr_rig()
    numbers = {"setpoint": 0.7, "tuning": {"integral_periods": 8.0}}
    pid = design("axis-pid", plant, numbers).controller
    (row,) = check_followed(plant, {"pid": pid}, ["raw"], ["step"]).rows

    assert row.figures["overshoot_m"] < 5e-4
    assert row.figures["final_error_m"] < 3e-4


@pytest.mark.slow
def test_design_says_that_margins_know_no_dry_friction():
    (text, _) = design_texts(design_report(design("axis-pid", crr_arm()), lambda said: None))

    assert "say nothing of dry friction: `workbench check` is what counts" in text
