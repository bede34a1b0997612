"""How the next recording is played: where it starts, which stops it comes to, in which loop."""

import json
from dataclasses import replace

import numpy as np
import pytest
from conftest import PLANT_MODELS

from studies.plain import plain
from studies.text_of_next_recording import conduct_document, conduct_lines, instructions
from workbench.diagnosis.result import NextRecording
from workbench.manoeuvres.conduct import conduct
from workbench.manoeuvres.library import LIBRARY
from workbench.manoeuvres.limits import Drive, limits_of
from workbench.manoeuvres.rehearse import BANDWIDTH_RAD_S, SpeedMap, _loop
from workbench.recording import Recording

PLACE, A = "slide.position_m", "chamber_a.pressure_pa"
DRIVE, TANK = PLANT_MODELS["servo_drive"], PLANT_MODELS["servo_reservoir"]
ROD_M = "rod.position_m"
LOW_M, HIGH_M = 0.0, 0.290


def going(*places_m, sample_time_s=1e-3):
    """A slide that goes from place to place at one speed, a second each."""
    at_s = np.arange(len(places_m))
    time_s = np.arange(0.0, at_s[-1], sample_time_s)
    rows = {PLACE: np.interp(time_s, at_s, places_m)}
    return Recording("made up", sample_time_s, constants(DRIVE, len(time_s)) | rows)


def without_first(recording):
    """The same with the first sample of the position missing, which comes 0.06 mm later."""
    place_m = np.where(np.arange(len(recording)) == 0, np.nan, recording[PLACE])
    return replace(recording, channels={**recording.channels, PLACE: place_m})


def constants(plant, n):
    names = (*plant.commands, *plant.measured_inputs)
    rows = {signal.name: np.full(n, signal.nominal) for signal in names}
    return rows | {name: np.full(n, 5e5) for name in plant.measured}


@pytest.fixture(scope="module")
def known():
    recorded = [without_first(going(0.06, 0.12)), going(0.07, 0.20)]
    limits = limits_of(DRIVE, recorded)
    (axis,) = limits.axes
    assert axis.stops == (LOW_M, HIGH_M)
    predicted = [going(0.145, LOW_M, LOW_M, HIGH_M), going(0.15, 0.07, LOW_M, 0.2)]
    speeds = SpeedMap(np.array([-0.5, 0.0, 0.5]), np.array([4.0, 4.95, 6.0]))
    return conduct(limits, DRIVE, predicted, recorded, [speeds])


def test_it_starts_where_predictions_do_and_meets_stops_as_fast_as_any_rival(known):
    assert known.starts[PLACE].at == 0.145
    assert known.starts[PLACE].recorded == pytest.approx((0.06006, 0.07))
    assert [each.at for each in known.contacts] == [LOW_M, HIGH_M]
    assert known.contacts[0].speed == pytest.approx(0.145, rel=1e-6)
    assert known.contacts[1].speed == pytest.approx(0.290, rel=1e-6)
    assert known.loop.bandwidth_rad_s == BANDWIDTH_RAD_S


def test_start_stops_and_loop_are_told(known):
    asked = NextRecording("go", ("one", "other"), 9.0, commands=("valve.command_v",), conduct=known)
    start, stops, loop = conduct_lines(asked)

    assert start == "it starts with slide.position at 145 mm (recordings start at 60.06 mm, 70 mm)"
    assert stops == (
        "it comes to stops: slide.position to or within 0.87 mm of 0 mm at up to 0.15 m/s and "
        "slide.position to or within 0.87 mm of 290 mm at up to 0.29 m/s, as predicted"
    )
    assert loop == (
        "its loop gives the command that moves the plant at dr/dt + w (r - y), w = 6 rad/s, "
        "renewed every 20 ms, slide.position limited to ±0.13 m/s, at rest within 0.7 mm of a "
        "resting reference, where it gives the resting command; the commands of the file alone, "
        "played without that loop, drift away"
    )
    assert loop in instructions(asked).splitlines()
    table = instructions(asked).splitlines()[-4:]
    assert table[0].split("  ")[0] == "valve.command (V)"
    assert [line.split() for line in table[1:]] == [["4", "-0.5"], ["4.95", "0"], ["6", "0.5"]]
    assert conduct_lines(replace(asked, conduct=None)) == []


def test_how_it_is_played_stands_in_the_document_in_si(known):
    told = json.loads(json.dumps(conduct_document(known), allow_nan=False))

    assert told["starts"]["slide.position"] == {
        "at": 0.145,
        "recordings": pytest.approx([0.06006, 0.07]),
        "unit": "m",
    }
    assert [each["speed_unit"] for each in told["contacts"]] == ["m/s", "m/s"]
    assert [each["within"] for each in told["contacts"]] == pytest.approx([0.87e-3, 0.87e-3])
    assert told["loop"]["bandwidth_rad_s"] == plain(BANDWIDTH_RAD_S)
    assert told["loop"]["update_s"] == 0.02
    assert told["loop"]["axes"]["slide.position"] == {
        "fastest": pytest.approx(0.13),
        "speed_unit": "m/s",
        "rest_within": pytest.approx(0.7e-3, rel=2e-3),
        "unit": "m",
    }
    assert "limited to plus and minus `fastest`" in told["loop"]["law"]
    assert told["loop"]["speed_maps"]["slide.position"]["command"] == [4.0, 4.95, 6.0]


def test_commands_that_move_no_position_have_starts_of_all_outputs_and_no_loop():
    recorded = Recording("made up", 1e-3, constants(TANK, 2000))
    known = conduct(limits_of(TANK, [recorded]), TANK, [recorded], [recorded])

    assert list(known.starts) == list(TANK.measured)
    assert (known.contacts, known.loop) == ((), None)
    told = conduct_lines(NextRecording("go", ("one", "other"), 9.0, conduct=known))
    assert told == ["it starts with reservoir.pressure at 5 bar"]


def test_the_loop_that_is_told_is_the_one_that_was_rehearsed():
    """Resting references 1 m away, a little more than ``rest_within`` and a little less."""
    recorded = going(0.06, 0.20)
    limits = limits_of(DRIVE, [recorded])
    (axis,) = limits.axes
    speeds = SpeedMap(np.array([-0.5, 0.0, 0.5]), np.array([4.0, 4.9, 6.0]))
    loop = conduct(limits, DRIVE, [recorded], [recorded], [speeds]).loop
    errors_m = np.array([-1.0, 1.01 * loop.rest_within[PLACE], 0.99 * loop.rest_within[PLACE]])

    given = _loop(limits, axis, speeds, np.zeros((3, 100)), -errors_m, 0)

    wanted = np.array([-loop.fastest[PLACE], loop.bandwidth_rad_s * errors_m[1]])
    assert given[:2] == pytest.approx(speeds.command_for(wanted))
    assert given[2] == limits.commands[0].nominal


@pytest.mark.parametrize(
    ("name", "output", "stops"),
    [
        ("vertical_cylinder", ROD_M, (0.0, 0.1078)),
        ("gearbox", "main_piston.position_m", (-12e-3, 12e-3)),
    ],
)
def test_stops_of_a_plant_whose_commands_move_no_position_are_told_as_well(name, output, stops):
    plant = PLANT_MODELS[name]
    way_m = np.interp(np.arange(2000), (0, 900, 1900), (sum(stops) / 2, *stops))
    recorded = Recording("made up", 1e-3, constants(plant, 2000) | {output: way_m})
    limits = limits_of(plant, [recorded])

    known = conduct(limits, plant, [recorded], [recorded])

    assert not limits.axes
    assert [(each.output, each.at) for each in known.contacts] == [(output, stop) for stop in stops]


def test_a_body_that_stops_short_of_a_stop_is_not_said_to_run_into_it():
    short = going(0.145, 0.8e-3, 0.8e-3)
    near, far = (
        conduct(limits_of(DRIVE, [short]), DRIVE, [each], [short])
        for each in (short, going(0.145, 0.9e-3, 0.9e-3))
    )

    (told,) = conduct_lines(NextRecording("go", ("one", "other"), 9.0, conduct=near))[1:]
    assert told.startswith("it comes to stops: slide.position to or within 0.87 mm of 0 mm at")
    assert not far.contacts


def test_a_recording_without_values_has_no_start_in_words_and_null_in_the_document():
    nowhere = {PLACE: np.full(1000, np.nan)}
    blank = Recording("made up", 1e-3, constants(DRIVE, 1000) | nowhere)
    recorded = [blank, going(0.05, 0.2)]
    known = conduct(limits_of(DRIVE, recorded[1:]), DRIVE, [going(0.145, 0.2)], recorded)
    alone = replace(known, starts={PLACE: replace(known.starts[PLACE], recorded=(np.nan,))})

    first, only = (
        conduct_lines(NextRecording("go", ("one", "other"), 9.0, conduct=each))[0]
        for each in (known, alone)
    )
    assert first == "it starts with slide.position at 145 mm (recordings start at 50 mm)"
    assert only == "it starts with slide.position at 145 mm"
    assert conduct_document(known)["starts"]["slide.position"]["recordings"] == [None, 0.05]


def test_what_is_not_finite_is_null_in_the_document(known):
    """Else the file could not be written, after all the work."""
    odd = replace(
        known,
        starts={PLACE: replace(known.starts[PLACE], at=np.nan)},
        contacts=(replace(known.contacts[0], speed=np.nan),),
        loop=replace(known.loop, maps={PLACE: SpeedMap(np.array([np.nan]), np.array([np.nan]))}),
    )

    told = json.loads(json.dumps(conduct_document(odd), allow_nan=False))

    assert told["starts"]["slide.position"]["at"] is told["contacts"][0]["speed"] is None
    assert told["loop"]["speed_maps"]["slide.position"] == {"command": [None], "speed": [None]}


@pytest.mark.parametrize(
    ("name", "recorded"),
    [("servo_drive", (A,)), ("crr_leg", ("joint_1.angle_rad", "cap_1.pressure_pa"))],
)
def test_nothing_is_played_where_what_moves_is_not_recorded(name, recorded):
    """Steps of the command, meant for a tank, drive the slide into its stops at 3.5 m/s."""
    plant = PLANT_MODELS[name].with_measured(*recorded)
    made_up = Recording("made up", 1e-3, constants(plant, 2000))
    found = limits_of(plant, [made_up])

    assert found.drive is Drive.UNSEEN
    assert not [each for each in LIBRARY if each.drive is found.drive]
