"""What is drawn in the runs of a check: what can make a difference, and nothing else."""

from dataclasses import replace

import pytest
from check_loops import MASS, RIG, SPEC, heavy_is_slow

from studies.checked_runs import check_rig
from studies.checking import Loops, drawn_plant, idle_parameters
from studies.followers import drawn_plant as followed
from studies.specification import read_specification
from workbench.plants.crr_leg import crr_leg
from workbench.rig import default_rig
from workbench.units import public_name

ABSENT = {"friction.wavelength_m", "friction.phase_rad", "friction_thermal.warming_time_s"}


def test_what_belongs_to_an_absent_cause_is_not_drawn():
    drawn = drawn_plant(RIG, 3).values

    assert idle_parameters(RIG.plant) >= ABSENT
    assert all(drawn[name] == RIG.plant.values[name] for name in ABSENT)
    assert not {MASS, "valve.flow_area_m2", "friction.coulomb_force_n"} & idle_parameters(RIG.plant)


def test_a_cause_that_is_there_is_drawn_with_all_that_belongs_to_it():
    present = RIG.plant.with_values({"friction.position_share": 0.2})
    drawn = drawn_plant(default_rig(present), 3).values

    assert {name for name in ABSENT if drawn[name] != present.values[name]} == {
        "friction.wavelength_m",
        "friction.phase_rad",
    }


def test_other_values_are_the_same_whether_a_cause_is_there_or_not():
    """A strength whose uncertainty is none takes no number: all others keep theirs."""
    share = "friction.position_share"
    plant = RIG.plant.with_values({share: 0.2})
    present = replace(default_rig(plant), fixed=frozenset([share]))
    with_it, without = drawn_plant(present, 3).values, drawn_plant(RIG, 3).values

    assert {name for name in with_it if with_it[name] != without[name]} == {
        share,
        "friction.wavelength_m",
        "friction.phase_rad",
    }


def test_pauses_of_the_leg_are_drawn_with_their_lengths():
    plant = crr_leg()
    values = followed(plant, 3).values

    assert values["packet_pause.redraw_hz"] == 1.0
    assert values["packet_pause.pause_s"] != plant.values["packet_pause.pause_s"]


def test_worst_runs_and_influences_tell_of_no_absent_cause(lq, monkeypatch):
    monkeypatch.setattr(Loops, "once", heavy_is_slow)
    found = check_rig(RIG, lq, ["ekf"], ["step"], spec=read_specification(SPEC, RIG), runs=8)
    names = {public_name(name) for name in ABSENT}

    assert not any(name in found.text or name in found.judged.text for name in names)
    for entry in found.document["specification"]:
        assert not names & entry["worst_parameters"].keys()
    assert not ABSENT & found.robustness.deviations.keys()
    assert found.robustness.deviations[MASS] == pytest.approx(
        [(drawn_plant(RIG, k).values[MASS] / 2.22 - 1.0) / 0.05 for k in range(8)]
    )
