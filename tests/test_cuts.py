"""Wrong cuts are refused with one clear line for each mistake, before anything is linearised."""

from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest
from slide_controllers import SLIDE_CONTROLLERS

import linearize
from linearize.analysis import require_controllable
from linearize.cuts import Guard, Interval, Level, Wording, checked
from linearize.equilibrium import operating_point
from linearize.modes import hybrid_modes, placed_at
from linearize.reduction import design_model
from linearize.shifting import switched_shift_model
from linearize.standard import POSITION, VELOCITY, slide_modes, standard_modes
from workbench.errors import InputError
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import servo_drive

SWITCHES = ("valve_1.command", "valve_2.command")
BOTH = (Level("off", 0.0), Level("on", 1.0))


@pytest.fixture(scope="module")
def plant():
    return servo_drive()


def said(plant, cuts, model=None):
    """The lines of the refusal."""
    with pytest.raises(InputError) as refusal:
        hybrid_modes(plant, cuts, model=model)
    return [str(message) for message in refusal.value.messages]


def near(lower, upper, point, label="near"):
    return Interval(label, lower, upper, point)


def test_an_unknown_signal_is_named_with_the_nearest_known_one(plant):
    (line,) = said(plant, {"slide.postion_m": [near(0.0, 0.1, 0.05)]})

    assert line.startswith("slide.postion_m: servo_drive has no such signal to cut; expected ")
    assert line.endswith("did you mean 'slide.position_m'?")


@pytest.mark.parametrize(("lower", "upper"), [(0.1, 0.1), (0.2, 0.1), (nan, 0.1), (0.1, nan)])
def test_an_empty_interval_is_refused(plant, lower, upper):
    (line,) = said(plant, {POSITION: [near(lower, upper, 0.1)]})

    assert line == f"{POSITION}: 'near', {lower:g} to {upper:g}, is empty; expected lower < upper"


@pytest.mark.parametrize("point", [-0.01, 0.1, inf, nan])
def test_a_point_outside_its_interval_is_refused(plant, point):
    (line,) = said(plant, {POSITION: [near(0.0, 0.1, point)]})

    assert line == (
        f"{POSITION}: the point {point:g} lies outside 'near', 0 to 0.1; "
        "expected lower <= point < upper"
    )


def test_intervals_that_overlap_are_refused_with_what_they_share(plant):
    (line,) = said(plant, {POSITION: [near(0.0, 0.2, 0.1, "a"), near(0.15, inf, 0.2, "b")]})

    assert line == f"{POSITION}: 'a' and 'b' overlap from 0.15 to 0.2"


def test_intervals_that_leave_a_gap_are_refused_with_what_is_missing(plant):
    (line,) = said(plant, {POSITION: [near(0.2, inf, 0.25, "b"), near(-inf, 0.1, 0.0, "a")]})

    assert line == f"{POSITION}: nothing covers 0.1 to 0.2, between 'a' and 'b'"


def test_a_border_calls_signals_and_values_by_its_own_words(plant):
    words = Wording(lambda name: name.upper(), lambda signal, value: f"{1e3 * value:g} mm")
    cuts = {POSITION: [near(0.0, 0.2, 0.1, "a"), near(0.15, inf, 0.1, "b")]}

    with pytest.raises(InputError) as refusal:
        checked(design_model(plant), cuts, words)
    outside, overlap = map(str, refusal.value.messages)

    assert outside.startswith(f"{POSITION.upper()}: the point 100 mm lies outside 'b', 150 mm to ")
    assert overlap == f"{POSITION.upper()}: 'a' and 'b' overlap from 150 mm to 200 mm"


def test_a_cut_into_nothing_and_a_label_twice_are_refused(plant):
    lines = said(plant, {POSITION: [], VELOCITY: [near(-inf, 0.0, -0.1), near(0.0, inf, 0.1)]})

    assert lines == [
        f"{POSITION}: is cut into nothing; expected at least one interval or level",
        f"{VELOCITY}: 2 regions are called 'near'",
    ]


def test_a_state_that_is_held_must_exist(plant):
    held = Interval("stick", -inf, inf, 0.0, holds=("slide.positon_m",))

    (line,) = said(plant, {VELOCITY: [held]})

    assert "'stick' holds slide.positon_m, which is no state" in line
    assert line.endswith("did you mean 'slide.position_m'?")


def test_everything_wrong_is_said_at_once(plant):
    lines = said(plant, {"slide.x": [], POSITION: [near(0.1, 0.0, 0.5), near(0.0, 1.0, 2.0, "b")]})

    assert len(lines) == 3


def test_infinite_outer_bounds_are_allowed(plant):
    hybrid = hybrid_modes(plant, {POSITION: [near(-inf, inf, 0.1)]})

    assert hybrid.active({POSITION: 1e9}).name == "near"


def test_a_point_that_the_placing_moves_out_of_its_box_is_refused(plant):
    def beside(model, box):
        return operating_point(model, {POSITION: 0.2})

    with pytest.raises(
        InputError, match=f"{POSITION}: the point of mode 'near' is at 0.2, outside"
    ):
        hybrid_modes(plant, {POSITION: [near(0.0, 0.1, 0.05)]}, beside)


def test_an_operating_point_at_an_unknown_name_is_refused(plant):
    with pytest.raises(InputError, match=r"no slide.postion_m; did you mean slide.position_m\?"):
        hybrid_modes(plant, {}, placed_at({"slide.postion_m": 0.1}))


@pytest.mark.parametrize(
    ("regions", "line"),
    [
        ((BOTH[1],), "nothing covers 0; expected a level for each of its values"),
        ((*BOTH, Level("half", 0.5)), "'half' is at 0.5; expected 0 or 1"),
        (
            (Interval("any", -inf, inf, 0.5),),
            "'any': a switched command has no intervals; expected a level for each of its values",
        ),
    ],
)
def test_a_switch_takes_its_levels_and_no_intervals(regions, line):
    model = switched_shift_model(gearbox())

    assert said(gearbox(), {SWITCHES[0]: regions}, model) == [f"{SWITCHES[0]}: {line}"]


def test_two_levels_at_one_value_are_refused():
    model = switched_shift_model(gearbox())
    lines = said(gearbox(), {SWITCHES[0]: (*BOTH, Level("again", 1.0))}, model)

    assert f"{SWITCHES[0]}: 'again' stands at 1 as another one" in lines


def test_a_state_has_no_levels(plant):
    (line,) = said(plant, {POSITION: [Level("here", 0.1)]})

    assert line == (
        f"{POSITION}: a state passes through its values; expected intervals instead of levels"
    )


def test_a_switched_command_chooses_the_mode_and_is_no_input_of_it():
    model = switched_shift_model(gearbox())
    hybrid = hybrid_modes(gearbox(), dict.fromkeys(SWITCHES, BOTH), model=model)

    assert [mode.name for mode in hybrid.modes] == ["off off", "off on", "on off", "on on"]
    assert hybrid.modes[0].command_names == ()
    assert hybrid.modes[0].system.ninputs == 0
    assert hybrid.active({SWITCHES[0]: 1.0, SWITCHES[1]: 0.0}).name == "on off"
    assert hybrid["on off"].sent(model, np.zeros(0)) == pytest.approx([1.0, 0.0])


def test_between_the_levels_of_a_switch_there_is_no_mode():
    model = switched_shift_model(gearbox())
    hybrid = hybrid_modes(gearbox(), {SWITCHES[0]: BOTH}, model=model)

    with pytest.raises(LookupError, match=r"no mode of gearbox covers .*0\.5"):
        hybrid.active({SWITCHES[0]: 0.5})


def test_a_guard_holds_in_its_half_space():
    guard = Guard({"a": 2.0, "b": -1.0}, 1.0)

    assert guard.holds({"a": 0.0, "b": 1.0})
    assert not guard.holds({"a": 0.0, "b": 1.1})


def test_a_mode_out_of_reach_of_its_commands_is_refused_for_a_design():
    hybrid = standard_modes(servo_drive())
    mode = hybrid["charge a slide + middle"]
    deaf = replace(mode, B=0.0 * mode.B)
    half = replace(mode, A=np.diag(np.diag(mode.A)))

    require_controllable(mode)
    with pytest.raises(InputError, match=r"reach 0 of 4 directions .* steer slide.position_m, "):
        require_controllable(deaf)
    with pytest.raises(InputError, match=r"mode 'charge a slide \+ middle': not"):
        require_controllable(half)


def test_no_controller_is_designed_on_modes_out_of_reach():
    hybrid = standard_modes(servo_drive())
    deaf = replace(hybrid, modes=tuple(replace(m, B=0.0 * m.B) for m in hybrid.modes))

    for method in SLIDE_CONTROLLERS.values():
        with pytest.raises(InputError, match="not controllable: its commands reach 0 of 4"):
            method.design(deaf, method.spec())


def test_a_plant_without_a_slide_is_refused_for_positioning():
    with pytest.raises(KeyError, match="no modes to position a slide with for gearbox"):
        slide_modes(gearbox())


def test_the_names_of_the_package_are_those_of_its_modules():
    for name in linearize.__all__:
        assert getattr(linearize, name).__name__ == name
    assert set(linearize.__all__) <= set(dir(linearize))
    with pytest.raises(AttributeError, match="no attribute 'hybrid_mode'"):
        getattr(linearize, "hybrid_mode")  # noqa: B009
