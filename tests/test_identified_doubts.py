"""What identification doubts: values far from the rig's, and those at the end of their range."""

import json
from dataclasses import replace
from math import inf

import numpy as np
import pytest
from commands import call

from studies import identification as study
from studies.identification_text import doubts, identification_document, identified_text
from studies.truth import dedicated as truth
from workbench.effect import Parameter
from workbench.errors import likest_first
from workbench.identification import PROCEDURES
from workbench.identification.estimate import Estimate, end_reached
from workbench.identification.result import Curve, Identified
from workbench.identification.tank_curves import FlowFit, TankCurve
from workbench.rig import default_rig

VOLUME, RATIO = "chamber_a.dead_volume_m3", "valve.supply_critical_ratio"
LINE = np.zeros(2)


def identified(name, value, plant="servo_drive"):
    rig = default_rig(plant)
    found = Estimate(name, value, 0.01 * abs(value))
    return Identified(rig=rig, estimates=(), parameters=(found,), curves=())


def test_a_range_ends_a_thousandth_of_its_width_early_and_open_ranges_by_their_typical_size():
    narrow, wide = Parameter(None, 0.35, 0.05, 0.6), Parameter(None, 2.0, 0.0, inf)

    assert end_reached(narrow, 0.0501) == 0.05 and end_reached(narrow, 0.61) == 0.6
    assert np.isnan(end_reached(narrow, 0.052))
    assert end_reached(wide, 1e-3) == 0.0 and np.isnan(end_reached(wide, 1e9))


@pytest.mark.parametrize(("off", "warned"), [(4.9, False), (5.1, True), (-5.1, True)])
def test_a_value_is_doubted_beyond_five_prior_deviations(off, warned):
    rig = default_rig("servo_drive")
    value = rig.plant.values[VOLUME] + off * rig.standard_deviation(VOLUME)
    found = identified(VOLUME, value)

    document = identification_document(PROCEDURES["dead-volume"], found)

    assert bool(document["warnings"]) is warned
    told = document["parameters"]["chamber_a.dead_volume"]
    assert told["prior_deviations_off"] == pytest.approx(abs(off)) and not told["at_bound"]
    text = identified_text(PROCEDURES["dead-volume"], found)
    assert ("warning: chamber_a.dead_volume" in text) is warned
    assert not doubts(PROCEDURES["dead-volume"], found) or "--tank" in text


def test_a_weak_strength_is_not_believed_to_a_part_of_what_is_negligible():
    """A friction that is the same both ways lay 20 deviations off an asymmetry of 4 %."""
    name, friction = "friction.asymmetry", PROCEDURES["friction"]

    assert not doubts(friction, identified(name, 0.0))
    assert doubts(friction, identified(name, 0.15))
    stated = identified(name, 0.0)
    stated = replace(stated, rig=replace(stated.rig, deviations={name: 2e-3}))
    assert doubts(friction, stated)


def test_a_value_at_a_bound_is_marked_as_no_result():
    found = identified(RATIO, 0.05, "servo_reservoir")
    said = identified_text(PROCEDURES["flow"], found)
    document = identification_document(PROCEDURES["flow"], found)

    (row,) = [line for line in said.splitlines() if line.startswith("valve.supply_critical_ratio")]
    assert row.endswith("at a bound")
    assert "is no result: its range ends at 0.05" in said
    assert document["parameters"]["valve.supply_critical_ratio"]["at_bound"] is True


def test_a_curve_tells_which_of_its_values_ended_at_a_bound():
    shape = ("critical_ratio", "cracking_ratio", "subsonic_index")
    common = {"label": "charging", "along": LINE, "measured": LINE, "fitted": LINE}
    values = {key: Estimate(key, 0.05, 0.15) for key in shape} | {"area_m2": Estimate("", 0.2, 0.1)}
    curve = TankCurve(command_v=8.0, charging=True, at_bound=shape[:1], **common, **values)
    found = identified(RATIO, 0.3, "servo_reservoir")
    shut = replace(curve, at_bound=(), area_m2=Estimate("", 1e-22, 0.1))
    fit = FlowFit(
        rig=found.rig, estimates=(), parameters=(),
        curves=(curve, replace(curve, at_bound=()), shut), rig_errors_pa=(1.0, 1.0, 1.0),
    )  # fmt: skip

    lines = identified_text(PROCEDURES["flow"], fit).splitlines()

    assert lines[1].endswith("b at a bound") and "at a bound" not in lines[2]
    assert lines[3].split() == ["charging", "shut", "-", "-", "-", *lines[2].split()[-4:]]
    assert "1 of 3 curves have values at the end of their range" in lines[-1]
    curves = identification_document(PROCEDURES["flow"], fit)["curves"]
    assert [each["at_bound"] for each in curves] == [["critical_ratio"], [], []]
    assert Curve(**common).at_bound == ()


@pytest.fixture(scope="module")
def release(tmp_path_factory):
    """A folder with a release into a chamber and the rigs that read it."""
    folder = tmp_path_factory.mktemp("release")
    table = truth.reservoir_release(study.DRIVE, 0.290, "a", seed=4)
    study.write_files({"dead-volume": [study.recording(table, "release")]}, folder)
    return folder


def test_the_volume_of_another_tank_is_doubted(release, tmp_path):
    words = release / "drive_and_tank.toml", release / "release.csv", "--json", tmp_path / "x.json"

    answer = call("identify", "dead-volume", *words, "--tank", "0.5 l")

    assert answer.exit_code == 0
    assert "prior deviations from the rig's 20 cm^3" in answer.stdout
    assert json.loads((tmp_path / "x.json").read_text())["warnings"]


def test_names_that_look_most_like_one_come_first():
    names = ("command_V", "pressure_a_bar", "supply_pressure_bar")

    assert likest_first("supply.pressure", names) == [*names[::-1]]


def test_a_column_that_the_rig_does_not_map_is_named(release):
    answer = call("identify", "dead-volume", release / "drive.toml", release / "release.csv")

    assert answer.exit_code == 2
    assert "the rig maps no column to supply.pressure" in answer.stderr
    assert "supply_bar" in answer.stderr
