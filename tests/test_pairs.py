"""Two effects that only work together, on a friction bench written here in plain numpy."""

import json

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from test_diagnosis import AMBIENT_PA, AREA_M2, bench, coulomb, nothing

from studies.documents import diagnosis_document
from workbench.diagnosis.addition import add
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.improve import improve
from workbench.diagnosis.pair_gains import joint_drops
from workbench.diagnosis.result import Verdict
from workbench.recording import Recording
from workbench.rig import load_rig

BARE = 'name = "bench"\nplant = "cylinder_bench"\n[values]\n"chamber.area" = "518.7 mm^2"\n'
PAIR = ("coulomb_friction", "constant_force")


def strokes(seed, back, friction_n, force_n, gauge_pa=3e5):
    """10 s at 100 Hz of which the rod moves back, with negative speed, for a share of the time."""
    rng = np.random.default_rng(seed)
    time_s = 0.01 * np.arange(1000)
    speed_m_s = 0.02 + 0.012 * np.sin(2 * np.pi * (0.41 + 0.02 * seed) * time_s)
    v = speed_m_s * np.where(np.mod(time_s + 0.13 * seed, 2.0) < 2.0 * back, -1.0, 1.0)
    p = gauge_pa * (1 + 0.1 * np.sin(2 * np.pi * 0.31 * time_s))
    force = p * AREA_M2 + friction_n * np.sign(v) + force_n + 0.2 * rng.standard_normal(len(v))
    channels = {
        "chamber.pressure_pa": p + AMBIENT_PA,
        "rod.position_m": 0.01 * np.cumsum(v),
        "rod.velocity_m_s": v,
        "rod.force_n": force,
    }
    return Recording(f"strokes {seed}", 0.01, channels, noise={"rod.force_n": 0.2})


def mostly_inwards(seed, gauge_pa):
    """The rod moves outwards for a tenth of the time: there friction and force add up.

    Inwards 8 N of friction and a force of 8 N on the rod cancel at the sensor, so either alone
    makes nine tenths of the recording worse.
    """
    return strokes(seed, 0.1, 8.0, -8.0, gauge_pa)


@pytest.fixture(scope="module")
def rig():
    return load_rig(BARE)


@pytest.fixture(scope="module")
def sets():
    return [mostly_inwards(1, 3e5)], [mostly_inwards(2, 4e5)]


@pytest.fixture(scope="module")
def improved(rig, sets):
    return improve(rig, *sets)


def test_neither_effect_passes_alone_and_both_together_are_named(improved):
    found = improved.diagnoses[0]
    leader = found.ranking[0]
    alone = [row for row in found.ranking if row.candidate.name in PAIR]

    assert {each.name for each in leader.candidate.singles} == set(PAIR)
    assert len(alone) == 2 and not any(row.accepted for row in alone)
    assert found.verdict in (Verdict.FOUND, Verdict.TIE)
    assert "together" in found.sentence
    assert leader.size["friction.coulomb_force_n"].value == pytest.approx(8.0, rel=0.05)
    assert leader.size["constant_force.force_n"].value == pytest.approx(8.0, rel=0.05)
    assert leader.drop_train > 0.9 and leader.drop_validation > 0.9
    # Of the nuisances only the ambient pressure is there, known to 0.05 N on this area.
    assert 0.0 < leader.compensable < 0.01


def test_both_effects_of_a_pair_are_added_in_one_round_and_asked_for_again(improved):
    first, second = improved.steps

    assert set(improved.kept) == set(improved.rig.added) == set(PAIR)
    assert improved.budget[2].label == f"+ {first.candidate.name} + {second.candidate.name}"
    assert [each.candidate.name for each in improved.removals] == list(improved.kept)
    assert all(not r.dropped and r.share_validation > 0.5 for r in improved.removals)
    assert len(improved.rig.notes) == 2 and "together with" in improved.rig.notes[0]
    assert improved.after["validation"]["rod.force"].rmse < 0.25


def test_a_pair_stands_in_the_document_with_both_names(improved):
    told = json.loads(json.dumps(diagnosis_document(improved.diagnoses[0], {}), allow_nan=False))
    row, *others = told["ranking"]

    assert {told["effect"], told["together_with"]["effect"]} == set(PAIR)
    assert {row["effect"], row["together_with"]["effect"]} == set(PAIR)
    assert set(row["size"]) == {"friction.coulomb_force", "constant_force.force"}
    assert {each["together_with"] for each in others} == {None}


def test_a_pair_can_be_asked_for_and_starts_from_nothing(rig, sets):
    step = add(rig, " + ".join(PAIR), *sets)

    assert set(step.rig.added) == set(PAIR)
    assert step.rig.plant.values["friction.coulomb_force_n"] == pytest.approx(8.0, rel=0.05)
    assert step.drop_validation > 0.9
    with pytest.raises(ValueError, match="expected one, or two different ones"):
        add(rig, "constant_force + constant_force", *sets)


def test_no_pair_is_tried_where_a_single_effect_suffices_or_nothing_is_missing(rig):
    for friction in (coulomb, nothing):
        said = []
        found = diagnose(rig, [bench(1, friction)], [bench(2, friction)], said.append)

        assert not any("pair" in each for each in said)
        assert all(len(row.candidate.singles) == 1 for row in found.ranking)


def test_amounts_of_pairs_are_those_of_bounded_least_squares():
    rng = np.random.default_rng(4)
    residual, changes = rng.standard_normal(12), rng.standard_normal((6, 12))
    changes[3] = -changes[2] + 0.3 * rng.standard_normal(12)  # two that nearly cancel
    room = np.array([3.0, 0.2, 3.0, 3.0, 0.05, 1.0])
    amounts, drops = joint_drops(changes @ changes.T, changes @ residual, room)
    for i, j in [(i, j) for i in range(6) for j in range(6) if i != j]:
        exact = lsq_linear(changes[[i, j]].T, -residual, (0.0, room[[i, j]]), tol=1e-14)

        assert drops[i, j] == pytest.approx(residual @ residual - 2 * exact.cost, abs=1e-6)
        assert amounts[[i, j], [j, i]] == pytest.approx(exact.x, abs=1e-4)
