"""Rounds of diagnosis and addition: an effect that is refused until a second one is there.

On a friction bench written here in plain numpy the rod moves outwards for most of the training and
inwards for most of what is held out.  Friction and a constant force add up outwards, so either
alone is fitted with the size of both, and held out that is worse than nothing.
"""

import pytest
from test_pairs import strokes

from workbench.diagnosis import diagnose as diagnosis
from workbench.diagnosis.improve import improve
from workbench.diagnosis.judge import HELD_OUT_REASON
from workbench.diagnosis.passes import Passes, Removal
from workbench.rig import load_rig

BARE = 'name = "bench"\nplant = "cylinder_bench"\n[values]\n"chamber.area" = "518.7 mm^2"\n'
FRICTION_N, FORCE_N = 8.0, 6.0


def recorded(seed, outwards, friction_n=FRICTION_N, force_n=FORCE_N):
    """The rod moves outwards for a share of the time."""
    return strokes(seed, 1.0 - outwards, friction_n, force_n)


@pytest.fixture
def singly(monkeypatch):
    """Diagnoses that ask for no pairs, as where the linear model sees no gain in one."""
    monkeypatch.setattr(diagnosis, "with_pairs", lambda problem, ranking, *_: ranking)


@pytest.fixture
def rig():
    return load_rig(BARE)


def test_an_effect_that_is_refused_alone_comes_in_with_the_next(rig, singly):
    heard = []
    found = improve(rig, [recorded(1, 0.9)], [recorded(2, 0.1)], heard.append)
    first, second, *_ = found.diagnoses
    rows = {row.candidate.name: row for row in first.ranking}

    assert not first.ranking[0].accepted and second.ranking[0].accepted
    assert rows[found.steps[0].candidate.name].reasons[0] == HELD_OUT_REASON
    assert set(found.kept) == {"coulomb_friction", "constant_force"}
    assert found.rig.plant.values["friction.coulomb_force_n"] == pytest.approx(FRICTION_N, rel=0.05)
    assert abs(found.rig.plant.values["constant_force.force_n"]) == pytest.approx(FORCE_N, rel=0.05)
    assert [stage.label for stage in found.budget[1:3]] == [f"+ {name}" for name in found.kept]
    assert found.after["validation"]["rod.force"].rmse < 0.25
    assert any("one round further" in message for message in heard)


def test_an_effect_that_is_refused_and_finds_no_second_one_is_not_added(rig, singly):
    """Held out, friction is less and the force another: no two effects can say that."""
    train, held_out = [recorded(1, 0.9)], [recorded(2, 0.9, 3.0, -5.0)]
    heard = []
    found = improve(rig, train, held_out, heard.append)

    assert any("one round further" in message for message in heard)
    assert found.steps == found.kept == () and found.rig is rig
    assert len(found.diagnoses) == len(found.budget) == 1


def test_two_effects_of_which_one_is_needless_beside_the_other_are_not_added(
    rig, singly, monkeypatch
):
    def needless(self, kept, step):
        return Removal(step.candidate, 0.0, 0.0, ("brings nothing",), True), kept

    monkeypatch.setattr(Passes, "removal", needless)
    found = improve(rig, [recorded(1, 0.9)], [recorded(2, 0.1)])

    assert found.steps == found.kept == ()
