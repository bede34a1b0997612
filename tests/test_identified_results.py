"""What a rig takes over of what was identified, and what its notes say of where values are from."""

from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest

from studies.identification import WRONG_DRIVE, WRONG_TANK
from studies.identification_text import doubts
from workbench.identification import PROCEDURES
from workbench.identification.estimate import Estimate
from workbench.identification.least_squares import Unknown, solve
from workbench.identification.result import Identified
from workbench.recording import Recording
from workbench.rig import load_rig
from workbench.rig_writing import rig_text

DRIVE, TANK = load_rig(WRONG_DRIVE), load_rig(WRONG_TANK)
A, B = "chamber_a.dead_volume_m3", "chamber_b.dead_volume_m3"
COULOMB, LEAK = "friction.coulomb_force_n", "valve.leak_area_m2"
VOLUMES = PROCEDURES["dead-volume"]
FILES = [Recording("release", 1.0, {})]


def identified(rig, *found):
    """A result with these parameters: name, value and deviation."""
    return Identified(
        rig=rig, estimates=(), parameters=tuple(Estimate(*each) for each in found), curves=()
    )


def noted(found, into=None):
    """The rig with what was found, as the command writes it."""
    return found.improved(into, VOLUMES.note(found, FILES, into))


@pytest.mark.parametrize(
    ("name", "value", "deviation", "why"),
    [
        (A, -1e-6, 1e-7, "stands at the end of its range"),
        (A, 1e-9, 1e-7, "stands at the end of its range"),
        ("valve.supply_critical_ratio", 0.6, 0.01, "stands at the end of its range"),
        (COULOMB, 25.5, 28.8, "the recordings say nothing of it"),
        ("valve.supply_fraction", 0.8, inf, "the recordings say nothing of it"),
        ("valve.supply_critical_ratio", 0.4, 0.3, "the recordings say nothing of it"),
    ],
)
def test_a_value_that_is_no_result_leaves_what_the_rig_knew(name, value, deviation, why):
    known = replace(DRIVE, deviations={name: 0.03 * DRIVE.plant.values[name]})
    found = identified(known, (name, value, deviation), (B, 5.5e-5, 5e-7))
    better = noted(found)

    assert better.plant.values[name] == known.plant.values[name]
    assert better.deviations[name] == known.deviations[name]
    assert better.plant.values[B] == 5.5e-5
    kept, said = better.notes
    assert "keeps what the rig had" in kept and why in kept
    assert said.startswith("dead-volume identified chamber_b.dead_volume from release")
    assert any("is no result" in each for each in doubts(VOLUMES, found))


@pytest.mark.parametrize(
    ("name", "value", "deviation"),
    [
        (A, 3.1e-5, 1.5e-6),
        (COULOMB, 27.0, 3.0),
        ("friction.asymmetry", 0.0, 0.02),
        (LEAK, 0.0, 1e-9),
        ("friction.breakaway_deflection_m", 4e-5, nan),
    ],
)
def test_a_value_that_says_something_is_taken(name, value, deviation):
    """Even where it is known a little worse than a catalogue believes, and where it is none."""
    better = noted(identified(DRIVE, (name, value, deviation)))

    assert better.plant.values[name] == value
    assert better.deviations.get(name, nan) == pytest.approx(deviation, nan_ok=True)


def test_a_second_chamber_keeps_the_note_of_the_first():
    first = noted(identified(DRIVE, (A, 3.1e-5, 4e-7)))
    second = noted(identified(first, (B, 5.5e-5, 4e-7)))

    assert [note.split()[2] for note in second.notes] == [
        "chamber_a.dead_volume",
        "chamber_b.dead_volume",
    ]
    assert load_rig(rig_text(second)).notes == second.notes


def test_a_note_is_replaced_where_all_that_it_tells_of_was_found_again():
    first = noted(identified(DRIVE, (A, 3.1e-5, 4e-7)))
    both = noted(identified(first, (A, 3.2e-5, 4e-7), (B, 5.5e-5, 4e-7)))

    (note,) = both.notes
    assert "chamber_a.dead_volume, chamber_b.dead_volume from" in note


def test_a_good_result_takes_back_what_a_bad_one_left_as_a_note():
    bad = noted(identified(DRIVE, (A, -1e-6, 1e-7)))
    good = noted(identified(bad, (A, 3.1e-5, 4e-7)))
    old = "chamber_a.dead_volume stands at the end of its range: identified was a value beyond"
    older = noted(identified(replace(DRIVE, notes=(old,)), (A, 3.1e-5, 4e-7)))

    assert len(bad.notes) == 1 and "keeps what the rig had" in bad.notes[0]
    for rig in (good, older):
        (note,) = rig.notes
        assert note.startswith("dead-volume identified chamber_a.dead_volume")


def test_a_note_names_no_value_that_the_rig_fixes():
    fixed = replace(DRIVE, fixed=frozenset({A}))
    better = noted(identified(fixed, (A, 3.1e-5, 4e-7), (B, 5.5e-5, 4e-7)))

    assert better.plant.values[A] == DRIVE.plant.values[A]
    (note,) = better.notes
    assert "chamber_a" not in note and "chamber_b.dead_volume" in note


def test_a_note_names_what_the_other_rig_takes():
    held = replace(DRIVE, fixed=frozenset({LEAK}))
    found = identified(TANK, (LEAK, 8e-8, 1e-9), ("valve_dead_zone.centre_v", 4.95, 1e-3))

    (note,) = noted(found, held).notes
    assert "valve.leak_area" not in note and "valve_dead_zone.centre" in note


@pytest.mark.parametrize("slope", [0.0, 1e-70])
def test_an_unknown_that_hardly_moves_a_residual_is_not_known_exactly(slope):
    """Its pseudo-inverse is zero: a Stribeck velocity far below every run was +- 0."""
    along = np.arange(20.0)
    found = solve(
        lambda x: along - x[0] * along - slope * x[1], [Unknown(0.5, 0.1), Unknown(0.5, 0.1)], 0.1
    )

    assert found.deviations[0] < 0.1 and found.deviations[1] == inf
