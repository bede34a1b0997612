"""Regimes of constructed recordings whose answer is known: valve, flow, motion, gear shift."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.comparison.course import course_of
from workbench.comparison.gear_shift import phases
from workbench.comparison.regimes import regimes
from workbench.comparison.shifts import shifts, unfinished
from workbench.plants import PLANTS
from workbench.recording import Recording

DT = 1e-3
AMBIENT_PA = 1.013e5
NOZZLE_RATIO = 0.5283  # Anderson, Modern Compressible Flow: sonic pressure ratio of air


def held(*pieces):
    """Values held for so many samples each."""
    return np.concatenate([np.full(count, float(value)) for value, count in pieces])


def drive(command_v, position_m):
    """A recording of the servo drive with both pressures at rest."""
    n = len(command_v)
    channels = {
        "valve.command_v": command_v,
        "slide.position_m": position_m,
        "chamber_a.pressure_pa": np.full(n, 5.6e5),
        "chamber_b.pressure_pa": np.full(n, 5.6e5),
    }
    noise = {"slide.position_m": 5e-6, **dict.fromkeys([*channels][2:], 500.0)}
    return Recording("drive", DT, channels, noise)


@pytest.fixture(scope="module")
def stroke():
    """0.3 s rest, 0.3 s forward at 0.2 m/s, 0.1 s rest, 0.3 s back; commands come in four sizes."""
    speed = held((0, 300), (0.2, 300), (0, 100), (-0.2, 300))
    command = held((4.95, 300), (5.45, 300), (4.35, 100), (3.5, 300))
    return regimes(PLANTS["servo_drive"](), drive(command, 0.1 + DT * np.cumsum(speed)))


def test_directions_and_rest_are_those_of_the_stroke(stroke):
    assert stroke["at rest"][:285].all() and stroke["at rest"][615:685].all()
    assert stroke["moving forward"][315:585].all() and stroke["moving backward"][715:].all()


def test_after_rest_are_the_first_two_tenths_behind_a_long_rest(stroke):
    """The second rest lasts a tenth of a second only."""
    after = np.flatnonzero(stroke["after rest"])

    assert after[0] == pytest.approx(300, abs=8)
    assert len(after) == 200 and after[-1] - after[0] == 199


def test_near_null_is_just_outside_the_dead_zone(stroke):
    """The zone is 4.53 to 5.37 V: 5.45 V and 4.35 V lie just outside, 4.95 V inside."""
    assert np.array_equal(np.flatnonzero(stroke["valve near null"]), np.arange(300, 700))
    assert stroke["valve closed"][:300].all() and not stroke["valve closed"][300:].any()


def test_what_a_recording_does_not_show_is_left_out():
    found = regimes(PLANTS["servo_drive"](), drive(np.full(400, 4.95), np.full(400, 0.1)))

    assert found["at rest"].all() and found["valve closed"].all()
    for absent in ("after rest", "reversal", "valve near null", "moving forward", "near the ends"):
        assert absent not in found


def test_a_leak_is_choked_above_the_critical_pressure():
    """A chamber sinks from 4 to 1.2 bar through a hole to the air."""
    plant = PLANTS["closed_chamber"]().with_values({"chamber_leak.area_m2": 3e-7})
    pressure_pa = np.linspace(4e5, 1.2e5, 600)
    recording = Recording("leak", DT, {"chamber.pressure_pa": pressure_pa})

    found = regimes(plant, recording)

    choked, subsonic = (
        found[f"chamber leak out of chamber {state}"] for state in ("choked", "subsonic")
    )
    assert pressure_pa[choked].min() == pytest.approx(AMBIENT_PA / NOZZLE_RATIO, rel=5e-3)
    assert pressure_pa[subsonic].max() == pytest.approx(AMBIENT_PA / NOZZLE_RATIO, rel=5e-3)
    assert not any(name.startswith("chamber leak into") for name in found)


def test_a_valve_carries_flow_one_way_at_a_time():
    """A spool leaks into and out of a chamber at once; of small openings that is a large share."""
    command = held((4.95, 300), (5.45, 300), (4.45, 300))
    found = regimes(PLANTS["servo_drive"](), drive(command, np.full(900, 0.1)))

    def carries(way):
        return sum(each for name, each in found.items() if name.startswith(f"valve {way}"))

    for chamber in ("chamber a", "chamber b"):
        assert not np.any((carries(f"into {chamber}") > 0) & (carries(f"out of {chamber}") > 0))
    assert found["valve into chamber a subsonic"][300:600].all()
    assert found["valve out of chamber b choked"][300:600].all()
    assert not np.any(carries("into chamber a")[:300])


def test_a_valve_without_limits_is_not_always_near_null():
    plant = PLANTS["servo_drive"]()
    (valve,) = plant.commands
    boundless = replace(plant, commands=(replace(valve, lower=-np.inf, upper=np.inf),))
    found = regimes(boundless, drive(held((4.95, 300), (8.0, 300)), np.full(600, 0.1)))

    assert found["valve open above 4.95 V"][300:].all()
    assert "valve near null" not in found


def test_a_path_of_the_iso_law_is_choked_below_its_own_critical_ratio():
    """A tank is filled from 7 bar through the valve with b = 0.35."""
    pressure_pa = np.linspace(1.1e5, 6.5e5, 600)
    channels = {"valve.command_v": np.full(600, 9.0), "reservoir.pressure_pa": pressure_pa}

    found = regimes(PLANTS["servo_reservoir"](), Recording("fill", DT, channels))

    choked = found["valve into reservoir choked"]
    assert pressure_pa[choked].max() == pytest.approx(0.35 * 7e5, rel=0.01)
    assert found["valve into reservoir subsonic"][300]


def test_a_joint_moves_forward_and_backward_as_a_body_does():
    n, t = 1200, DT * np.arange(1200)
    rest_pa = np.full(n, 3.76e5)
    channels = {
        "valve.command_v": np.full(n, 5.25),
        "joint.angle_rad": 0.9 + 0.5 * np.sin(2 * np.pi * t / 1.2),
        "cap.pressure_pa": rest_pa,
        "rod_side.pressure_pa": rest_pa,
    }
    noise = {"joint.angle_rad": 9e-4}

    found = regimes(PLANTS["crr_arm"](), Recording("arm", DT, channels, noise))

    assert found["moving forward"][20:280].all() and found["moving backward"][320:880].all()
    assert found["reversal"][300] and found["reversal"][900]
    assert found["near the ends"][900] and not found["near the ends"][0]


def test_several_joints_are_told_apart_by_name():
    n = 300
    plant = PLANTS["crr_leg"]()
    start = dict(zip(plant.model.states, plant.initial, strict=True))
    channels = {s.name: np.full(n, s.nominal) for s in plant.commands}
    channels |= {name: np.full(n, start[name]) for name in plant.measured}
    channels["joint_2.angle_rad"] = channels["joint_2.angle_rad"] + 0.5 * DT * np.arange(n)

    found = regimes(plant, Recording("leg", DT, channels))

    assert found["joint 2 moving forward"].all() and found["joint 1 at rest"].all()
    assert "joint 1 moving forward" not in found


@pytest.fixture(scope="module")
def shifting():
    """N to H with a standstill of 50 ms at 6 mm, 0.2 s held, and back without one.

    0.10 s rest, 6 mm in 30 ms, 50 ms, 6 mm in 30 ms, 0.24 s rest; 12 mm in 60 ms, 0.19 s rest.
    """
    speed = held((0, 100), (0.2, 30), (0, 50), (0.2, 30), (0, 240), (-0.2, 60), (0, 190))
    n = len(speed)
    channels = {
        "valve_1.command": held((0, 90), (1, 200), (0, 140), (1, 100), (0, n - 530)),
        "valve_2.command": held((0, 430), (1, 100), (0, n - 530)),
        "main_piston.position_m": DT * np.cumsum(speed),
        "chamber_1.pressure_pa": np.full(n, 2e5),
        "chamber_2.pressure_pa": np.full(n, 2e5),
    }
    recording = Recording("shifts", DT, channels, {"main_piston.position_m": 2e-5})
    return course_of(PLANTS["gearbox"](), recording)


def test_the_phases_of_a_gear_shift_follow_each_other(shifting):
    """Reach of a notch 3 mm, synchroniser from 5 to 7 mm; slopes are known to 8 samples."""
    found = phases(shifting)
    names = np.array([*found])[np.argmax([*found.values()], axis=0)]
    changes = [0, *(np.flatnonzero(names[1:] != names[:-1]) + 1)]

    expected = [
        ("in neutral", 0),
        ("release", 100),
        ("travel", 115),
        ("synchronising", 125),
        ("travel", 185),
        ("engaging", 195),
        ("in gear", 210),
        ("release", 450),
        ("travel", 465),
        ("engaging", 495),
        ("in neutral", 510),
    ]
    assert [str(names[k]) for k in changes] == [name for name, _ in expected]
    assert changes == pytest.approx([k for _, k in expected], abs=9)
    assert (np.sum([*found.values()], axis=0) == 1).all()


def test_a_shift_runs_from_its_command_to_the_gear_it_reaches(shifting):
    """Half a millimetre before its end a stroke of 0.2 m/s counts as over."""
    found = shifts(shifting)

    assert [shift.case for shift in found] == ["N to H", "H to N"]
    assert [shift.first for shift in found] == [90, 430]
    assert [shift.last for shift in found] == pytest.approx([207, 507], abs=2)


def test_a_command_that_moves_nothing_is_no_shift(shifting):
    still = {**shifting.recording.channels}
    still["main_piston.position_m"] = np.zeros(len(shifting.recording))

    course = course_of(shifting.whole, replace(shifting.recording, channels=still))
    assert shifts(course) == () and unfinished(course) == ()


def test_a_shift_that_stays_between_two_gears_reached_none(shifting):
    """It stands 8 mm from Neutral, High is at 12 mm, and a notch reaches 3 mm."""
    speed = held((0, 100), (0.2, 40), (0, 300))
    n = len(speed)
    channels = {
        **{name: values[:n] for name, values in shifting.recording.channels.items()},
        "valve_1.command": held((0, 90), (1, 200), (0, n - 290)),
        "valve_2.command": np.zeros(n),
        "main_piston.position_m": DT * np.cumsum(speed),
    }

    course = course_of(shifting.whole, replace(shifting.recording, channels=channels))
    assert shifts(course) == () and unfinished(course) == (90,)


@pytest.mark.parametrize("later", [439, 445, 470], ids=["at once", "before it moves", "moving"])
def test_valves_that_open_one_after_the_other_begin_one_shift(shifting, later):
    """Whichever comes first: what moves by it moves the lever before the other one acts."""
    n = len(shifting.recording)
    second = held((0, later), (1, 530 - later), (0, n - 530))
    channels = {**shifting.recording.channels, "valve_2.command": second}
    found = shifts(course_of(shifting.whole, replace(shifting.recording, channels=channels)))

    assert [(shift.case, shift.first) for shift in found] == [("N to H", 90), ("H to N", 430)]


def test_a_valve_that_has_held_the_gear_for_long_begins_no_shift(shifting):
    n = len(shifting.recording)
    first = held((0, 90), (1, 200), (0, 50), (1, 190), (0, n - 530))
    channels = {**shifting.recording.channels, "valve_1.command": first}
    course = course_of(shifting.whole, replace(shifting.recording, channels=channels))

    assert [shift.first for shift in shifts(course)] == [90, 430]
    assert unfinished(course) == ()


def test_a_pulse_that_moved_nothing_is_not_where_the_next_shift_began(shifting):
    n = len(shifting.recording)
    second = held((0, 380), (1, 10), (0, 40), (1, 100), (0, n - 530))
    channels = {**shifting.recording.channels, "valve_2.command": second}
    found = shifts(course_of(shifting.whole, replace(shifting.recording, channels=channels)))

    assert [shift.first for shift in found] == [90, 430]


def test_a_plant_without_gears_has_no_phases(stroke):
    assert not {"in neutral", "travel", "engaging"} & set(stroke)
