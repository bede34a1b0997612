"""Stops that a manoeuvre meets: those of a joint are at its rod; where rigs lean on one at rest."""

from dataclasses import replace
from math import inf, isinf, radians

import numpy as np
import pytest
from conftest import PLANT_MODELS
from test_rehearsal import PLACE, fit, limits_between  # noqa: F401

from workbench.diagnosis.manoeuvre_choice import inside
from workbench.linkage import Joint
from workbench.manoeuvres.conduct import conduct
from workbench.manoeuvres.library import LIBRARY, slowly_to_both_ends
from workbench.manoeuvres.limits import DEEP_M, GENTLE, limits_of
from workbench.manoeuvres.stops import stops_of
from workbench.plants.crr_arm import RANGE_RAD, ROD
from workbench.plants.crr_leg import ANGLES, RANGES_RAD
from workbench.recording import Recording

ARM, DRIVE = PLANT_MODELS["crr_arm"], PLANT_MODELS["servo_drive"]
ANGLE = "joint.angle_rad"
ONE_HERE = 1e-6  # rad, of an angle that a table gives


def turned(*angles_rad):
    """An arm that goes from angle to angle at one speed, a second each."""
    return going(ARM, ANGLE, angles_rad)


def going(plant, output, places):
    time_s = np.arange(0.0, len(places) - 1.0, 1e-3)
    signals = (*plant.commands, *plant.measured_inputs)
    rows = {signal.name: np.full(len(time_s), signal.nominal) for signal in signals}
    rows |= {name: np.full(len(time_s), 4e5) for name in plant.measured}
    rows[output] = np.interp(time_s, np.arange(len(places)), places)
    return Recording("made up", 1e-3, rows)


def mirrored_arm():
    """The arm as another one counts its angle: down where this one counts up."""
    plant = ARM.with_values({"rod.datum_rad": -ROD.datum_rad})
    parts = (
        replace(p, initial_angle_rad=-p.initial_angle_rad) if isinstance(p, Joint) else p
        for p in plant.parts
    )
    return replace(plant, parts=tuple(parts))


def test_the_stops_of_a_joint_are_where_its_rod_meets_its_own():
    leg = PLANT_MODELS["crr_leg"]

    assert stops_of(ARM, ANGLE) == pytest.approx(RANGE_RAD, abs=ONE_HERE)
    for angle, ends in zip(ANGLES, RANGES_RAD, strict=True):
        assert stops_of(leg, angle) == pytest.approx(ends, abs=ONE_HERE)
    assert stops_of(ARM, "cap.pressure_pa") == (-inf, inf)


def test_the_stops_of_a_joint_are_found_as_well_where_its_rod_shrinks_with_the_angle():
    low, high = stops_of(mirrored_arm(), ANGLE)

    assert (-high, -low) == pytest.approx(RANGE_RAD, abs=ONE_HERE)


@pytest.mark.parametrize("arm", [ARM, mirrored_arm()], ids=["grows", "shrinks"])
def test_a_stop_that_a_rod_never_comes_to_is_none(arm):
    longest_m = ROD.base_m + ROD.arm_m - ROD.shortest_m
    low, high = stops_of(arm.with_values({"stops.upper_m": longest_m + 1e-3}), ANGLE)

    assert isinf(high if arm is ARM else low) and not isinf(low if arm is ARM else high)


def test_stops_give_way_at_the_rod_and_not_at_the_joint():
    low, high = stops_of(ARM, ANGLE, DEEP_M)
    ends_m = [float(ROD.position_m(angle)) for angle in RANGE_RAD]

    assert float(ROD.position_m(low)) == pytest.approx(ends_m[0] - DEEP_M, abs=1e-8)
    assert float(ROD.position_m(high)) == pytest.approx(ends_m[1] + DEEP_M, abs=1e-8)


def test_an_arm_does_not_meet_its_stops_faster_than_gently():
    """Recorded down to the stop at one speed; 1.25 times that is no breach in the open."""
    stop, middle = RANGE_RAD[0], radians(60.0)
    limits = limits_of(ARM, [turned(middle, stop, middle)])
    deepest, speed = stop - radians(0.2), middle - stop

    def met(share, of=0.0):
        """Down at a share of the recorded speed, and on the stop from then on."""
        down = middle - share * speed * np.arange(0.0, 3.0, 1e-3)
        return replace(turned(0.0, 1.0), channels={ANGLE: np.maximum(down, deepest) + of})

    open_air = met(1.25, of=radians(1.0))
    assert limits.broken_by(open_air, ends=False) == ""
    assert "meets a stop faster" in limits.broken_by(met(1.25), ends=False)
    assert limits.broken_by(met(0.9 * GENTLE), ends=False) == ""
    assert limits.broken_by(met(0.9 * GENTLE), ends=True) == ""


def test_an_arm_is_driven_to_its_stops_and_that_is_told():
    recorded = turned(radians(40.0), radians(60.0))
    limits = limits_of(ARM, [recorded])
    (reference,) = slowly_to_both_ends(limits, 1.0).reference
    met = turned(radians(60.0), *RANGE_RAD)

    contacts = conduct(limits, ARM, [met], [recorded]).contacts

    assert reference.min() < RANGE_RAD[0] and reference.max() > RANGE_RAD[1]
    assert [each.at for each in contacts] == pytest.approx(RANGE_RAD, abs=ONE_HERE)


@pytest.mark.parametrize("start_m", [-5e-6, -1.5e-4], ids=["noise", "pressed into the stop"])
def test_a_rig_whose_recording_begins_on_a_stop_can_be_played(fit, start_m):  # noqa: F811
    limits = limits_between(fit, min(start_m, 0.0), 0.08, start_m)
    ordinary = [m for m in LIBRARY if m.drive is limits.drive and not m.ends]

    found = inside([fit], limits, ordinary)

    assert len(found) == len(ordinary)
    for each in found:
        place_m, speed_m_s = each.recorded[0][PLACE], each.recorded[0]["slide.velocity_m_s"]
        hits = np.flatnonzero((place_m[1:] < 0.0) & (place_m[:-1] >= 0.0))
        assert np.abs(speed_m_s[hits]).max(initial=0.0) < GENTLE * limits.axes[0].speed


def test_a_stop_gives_way_only_to_what_was_recorded_at_it_and_comes_to_it_gently():
    at_stop, short_of_it = going(DRIVE, PLACE, (0.0, 0.1, 0.1)), going(DRIVE, PLACE, (2e-3, 0.1))
    slow, fast = (
        going(DRIVE, PLACE, (0.03, -1e-4, -1e-4)),
        going(DRIVE, PLACE, (0.06, -1e-4, -1e-4)),
    )
    deep = going(DRIVE, PLACE, (0.03, -1.1e-3, -1.1e-3))

    limits = limits_of(DRIVE, [at_stop])
    assert limits.broken_by(slow, ends=False) == ""
    assert "meets a stop faster" in limits.broken_by(fast, ends=False)
    assert "leaves" in limits.broken_by(deep, ends=False)
    assert "leaves 0 to" in limits_of(DRIVE, [short_of_it]).broken_by(slow, ends=False)
