"""How the flow of a tank's valve goes onto a drive: the product was measured, not the fraction."""

from dataclasses import replace
from math import prod

import numpy as np
import pytest

from studies import identification as study
from studies.identification_text import doubts
from studies.truth import dedicated as truth
from workbench.errors import InputError
from workbench.identification import PROCEDURES
from workbench.identification.tank_curves import tank_curves
from workbench.rig import load_rig
from workbench.rig_writing import rig_text

TANK, DRIVE = load_rig(study.WRONG_TANK), load_rig(study.WRONG_DRIVE)
ZONE = {
    "valve_dead_zone.centre_v": 4.95,
    "valve_dead_zone.half_width_v": 0.42,
    "valve.leak_area_m2": 8e-8,
}
AREA, EXPONENT = "valve.flow_area_m2", "valve.area_exponent"
SUPPLY, EXHAUST = "valve.supply_fraction", "valve.exhaust_fraction"
SIZE = (AREA, "valve.discharge_coefficient")


def knowing(rig, values, **changes):
    return replace(rig, plant=rig.plant.with_values(values), **changes)


KNOWN = knowing(TANK, ZONE, deviations={name: 1e-3 * value for name, value in ZONE.items()})


def curves(*command_v):
    return study.named(truth.tank_curves(study.TANK, np.array(command_v), seed=1), "curve")


@pytest.fixture(scope="module")
def charging():
    """Of the supply path alone."""
    return tank_curves(KNOWN, curves(6.0, 8.0, 10.0))


@pytest.fixture(scope="module")
def both():
    return tank_curves(KNOWN, curves(0.0, 2.0, 3.5, 6.0, 8.0, 10.0))


def flow_m2(rig, fraction):
    """C_d A f of a path."""
    return prod(rig.plant.values[name] for name in (*SIZE, fraction))


@pytest.mark.parametrize("other", [{AREA: 2e-5}, {SIZE[1]: 0.7}])
def test_a_drive_that_has_another_area_gets_the_flow_of_the_tank(both, other):
    """It kept its own area, and 29 % of the flow was lost without a word."""
    drive = both.improved(knowing(DRIVE, other))

    for fraction in (SUPPLY, EXHAUST):
        assert flow_m2(drive, fraction) == pytest.approx(flow_m2(both.improved(), fraction))
        true_m2 = true_size_m2(fraction)
        assert flow_m2(drive, fraction) == pytest.approx(true_m2, rel=0.05), fraction
    assert [drive.standard_deviation(name) for name in SIZE] == [0.0, 0.0]


def true_size_m2(fraction):
    valve = study.TANK.valve
    area_m2 = valve.supply_m2 if fraction == SUPPLY else valve.exhaust_m2
    return study.true.DISCHARGE * area_m2


def test_the_area_that_fractions_are_relative_to_is_known_once_they_are(both):
    """Else a later fit would move the measured product by what the area was unknown by."""
    better = both.improved()
    again = load_rig(rig_text(better))

    assert TANK.standard_deviation(AREA) > 0.0
    for rig in (better, again):
        assert rig.standard_deviation(AREA) == 0.0
        assert rig.plant.values[AREA] == TANK.plant.values[AREA]
        assert rig.standard_deviation(SUPPLY) > 0.0


def test_a_path_that_no_curve_shows_keeps_its_flow_and_what_is_not_known_of_it(charging):
    for own in (DRIVE, knowing(DRIVE, {AREA: 2e-5})):
        drive = charging.improved(own)

        assert flow_m2(drive, SUPPLY) == pytest.approx(flow_m2(charging.improved(), SUPPLY))
        assert flow_m2(drive, EXHAUST) == pytest.approx(flow_m2(own, EXHAUST))
        share = drive.standard_deviation(EXHAUST) / drive.plant.values[EXHAUST]
        assert share == pytest.approx(own.standard_deviation(AREA) / own.plant.values[AREA])


def test_what_shapes_the_paths_goes_along(charging):
    """The fit had it as the tank's rig says."""
    rig = knowing(KNOWN, {"valve_dead_zone.full_v": 9.8, "valve.supply_restriction_share": 0.1})
    drive = replace(charging, rig=rig).improved(replace(DRIVE, removed=("valve_underlap",)))

    assert drive.plant.values["valve_dead_zone.full_v"] == 9.8
    assert drive.plant.values["valve.supply_restriction_share"] == 0.1
    assert drive.removed == ("valve_underlap",)


def test_a_dead_zone_that_the_tank_fixes_goes_along_too(charging):
    fixed = replace(KNOWN, deviations={}, fixed=frozenset(ZONE))
    drive = tank_curves(fixed, curves(6.0, 8.0, 10.0)).improved(DRIVE)

    assert all(DRIVE.plant.values[name] != ZONE[name] for name in ZONE)
    for name, value in ZONE.items():
        assert drive.plant.values[name] == value
        assert drive.deviations[name] == 0.0


@pytest.mark.parametrize("name", [AREA, EXHAUST])
def test_a_drive_of_another_area_that_fixes_it_or_a_fraction_of_it_is_refused(charging, name):
    other = knowing(DRIVE, {AREA: 2e-5}, fixed=frozenset({name}))
    with pytest.raises(InputError, match=r"fixes valve\.\w+, and the tank's valve has another a"):
        charging.improved(other)


def test_a_drive_that_fixes_the_area_of_the_tank_takes_the_fractions(charging):
    same = charging.improved(replace(DRIVE, fixed=frozenset({AREA})))

    assert flow_m2(same, SUPPLY) == pytest.approx(flow_m2(charging.improved(), SUPPLY))


def test_curves_at_one_command_are_one():
    """Three gave an exponent of 1.8 +- 170, which the rig took over."""
    with pytest.raises(InputError, match=r"3 charging .*3 or more on one side at different comm"):
        tank_curves(KNOWN, curves(7.0, 7.0, 7.05))


def test_what_the_curves_do_not_tell_stays_and_the_rest_is_fitted_to_it(monkeypatch):
    monkeypatch.setattr("workbench.identification.tank_pieces.APART_V", -1.0)
    found = tank_curves(KNOWN, curves(7.0, 7.0, 7.02))

    assert EXPONENT not in {each.name for each in found.parameters}
    assert any("valve.area_exponent stays 1.6" in said for said in found.doubts)
    assert any("stays 1.6" in said for said in doubts(PROCEDURES["flow"], found))
    assert found[SUPPLY].deviation < 0.05
    assert found.improved().plant.values[EXPONENT] == TANK.plant.values[EXPONENT]
