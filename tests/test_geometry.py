"""Stops and chambers of one body, as a rig file gives them, are of one stroke."""

from dataclasses import replace

import pytest

from workbench.errors import InputError
from workbench.plants import PLANTS
from workbench.plants.servo_drive import STROKE_M
from workbench.rig import load_rig
from workbench.rig_writing import write_rig

CENTRED = {"stops.lower": "-100 mm", "stops.upper": "100 mm"}
MOVED = {"chamber_a.lower": "-100 mm", "chamber_b.lower": "-100 mm"}
SHORT = {"chamber_a.stroke": "200 mm", "chamber_b.stroke": "200 mm"}


def rig(values, plant="servo_drive", more=""):
    """A rig file with these values, the first of them in line 4."""
    lines = "".join(f'"{key}" = "{value}"\n' for key, value in values.items())
    return f'name = "x"\nplant = "{plant}"\n[values]\n{lines}{more}'


def refused(text):
    with pytest.raises(InputError) as caught:
        load_rig(text)
    (message,) = caught.value.messages
    return message


@pytest.mark.parametrize("name", PLANTS)
def test_every_plant_of_the_list_has_room_as_it_comes(name):
    assert load_rig(f'name = "x"\nplant = "{name}"\n').plant.values == PLANTS[name]().values


def test_stops_that_count_from_the_middle_need_chambers_that_do_too():
    """The audit's trap: volumes stopped to shrink, and a search named dead_volume."""
    message = refused(rig(CENTRED))

    assert message.line == 4 and message.name == "stops.lower"
    assert (
        "stops reach from -100 mm to 100 mm, and the stroke of chamber_a from 0 mm to 290 mm"
        in (message.what)
    )
    for key in (*CENTRED, *MOVED, *SHORT, "end_cushion.lower", "spring_force.rest"):
        assert key in message.expected
    assert load_rig(rig(CENTRED | MOVED | SHORT))


@pytest.mark.parametrize("keys", [("chamber_a.stroke",), ("chamber_b.stroke",), tuple(SHORT)])
def test_a_shorter_stroke_needs_stops_that_are_nearer_too(keys):
    values = {key: "150 mm" for key in keys}
    message = refused(rig(values))

    assert message.name == keys[0] and message.line == 4
    assert "stops reach from 0 mm to 290 mm" in message.what and "0 mm to 150 mm" in message.what
    assert load_rig(rig(SHORT | {"stops.upper": "200 mm"}))


def test_the_lower_stop_is_below_the_upper_one():
    message = refused(rig({"stops.upper": "100 mm", "stops.lower": "150 mm"}))

    assert message.what == "stops reach from 150 mm to 100 mm"
    assert message.expected == "the lower end below the upper one"


def test_stops_may_hold_a_body_back_and_give_way_a_little():
    for upper in ("150 mm", "290.9 mm", "292 mm"):
        assert load_rig(rig({"stops.upper": upper}))


@pytest.mark.parametrize("ends", [(0, 294), (-5, 285), (-55, 290), (0, 340)])
def test_stops_may_lie_within_the_dead_volume(ends):
    """There the volumes are right: those of the drive are 63 mm and 113 mm long."""
    lower, upper = (f"{end} mm" for end in ends)

    assert load_rig(rig({"stops.lower": lower, "stops.upper": upper}))


@pytest.mark.parametrize(
    "values",
    [
        {"stops.upper": "360 mm"},
        {"stops.lower": "-62 mm"},
        {"stops.lower": "-30 mm", "chamber_a.dead_volume_change": "-0.6"},
        {"stops.lower": "-30 mm", "chamber_a.dead_volume": "10 cm^3"},
    ],
)
def test_stops_may_not_lie_where_the_volume_no_longer_shrinks(values):
    assert refused(rig(values))


def test_every_place_is_looked_at_and_complaints_come_together():
    values = {"stops@main_piston.upper": "20 mm", "stops@floating_piston.upper": "-3 mm"}
    with pytest.raises(InputError) as caught:
        load_rig(rig(values, "gearbox"))

    main, floating = caught.value.messages
    assert (main.line, floating.line) == (4, 5)
    assert (
        "chamber_1 from -12 mm to 12 mm" in main.what and "control_chamber.lower" in main.expected
    )


@pytest.mark.parametrize(
    ("plant", "values"),
    [
        ("vertical_cylinder", {"stops.upper": "170 mm"}),
        ("crr_arm", {"rod.shortest": "135 mm"}),
        ("servo_drive", {"stops.stiffness": "0 N/m", "stops.upper": "400 mm"}),
    ],
    ids=["no chamber", "stops at the rod", "no stops"],
)
def test_where_stops_and_chambers_do_not_meet_nothing_is_asked(plant, values):
    assert load_rig(rig(values, plant))


def test_a_plant_of_ones_own_is_asked_too_at_the_line_that_names_it(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from workbench.plants import PLANTS\n"
        "def drive():\n"
        "    return PLANTS['servo_drive']().with_values({'stops.upper_m': 0.4})\n"
    )
    path = tmp_path / "rig.toml"
    path.write_text('name = "x"\nplant = "mine.py:drive"\n')
    message = refused(path)

    assert message.line == 2 and "stops reach from 0 mm to 400 mm" in message.what


def test_what_a_fit_moved_within_its_prior_reads_back(tmp_path):
    """A posterior is surer of it than the prior that the fit began with."""
    begun = load_rig(rig({"stops.upper": "290 mm"}, more='[uncertainty]\n"stops.upper" = "2 mm"\n'))
    plant = begun.plant.with_values({"stops.upper_m": STROKE_M + 0.006})
    fitted = replace(begun, plant=plant, deviations={"stops.upper_m": 5e-5})
    write_rig(fitted, tmp_path / "fitted.toml")

    assert load_rig(tmp_path / "fitted.toml").plant.values == plant.values


def test_what_is_uncertain_is_still_no_licence_for_any_number():
    assert refused(rig(CENTRED, more='[uncertainty]\n"stops.upper" = "1 mm"\n'))


def test_draws_are_not_asked():
    plant = load_rig(rig({})).plant

    assert plant.with_values({"stops.upper_m": 0.4}).values["stops.upper_m"] == 0.4


def test_a_value_that_is_wrong_by_itself_is_said_alone():
    message = refused(rig(CENTRED | {"chamber_a.area": "-1 mm^2"}))

    assert message.name == "chamber_a.area"
