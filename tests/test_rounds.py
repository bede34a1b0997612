"""Rounds of diagnosis and addition: an effect that is refused until a second one is there.

On a friction bench written here in plain numpy the rod moves outwards for most of the training and
inwards for most of what is held out.  Friction and a constant force add up outwards, so either
alone is fitted with the size of both, and held out that is worse than nothing.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from test_pairs import strokes

from workbench.diagnosis import diagnose as diagnosis
from workbench.diagnosis.improve import improve
from workbench.diagnosis.improvement import Change, Stage
from workbench.diagnosis.judge import HELD_OUT_REASON
from workbench.diagnosis.passes import Passes, Removal
from workbench.diagnosis.rounds import Rounds, leaves_less
from workbench.fitting.errors import per_sample
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
    assert [stage.label for stage in found.budget[2:]] == [f"+ {' + '.join(found.kept)}"]
    assert found.after["validation"]["rod.force"].rmse < 0.25
    assert any("one round further" in message for message in heard)
    assert [each.sentence for each in found.ahead] == [
        "one round further with coulomb_friction: comes in with constant_force"
    ]
    assert found.warnings == () and "unexplained" in first.warnings[0]


def contradicting(monkeypatch, times):
    """The first few diagnoses name nothing, whatever leads: rig and recording contradict."""
    left = [True] * times

    def credible(found, doubts):
        withdrawn = bool(left) and left.pop()
        return replace(found, contradicted=True, sentence="they contradict") if withdrawn else found

    monkeypatch.setattr(diagnosis, "credible", credible)


def test_two_effects_come_in_where_one_alone_leaves_the_recording_contradicted(
    rig, singly, monkeypatch
):
    """A leak was first beside a missing friction of 13 N, passed every criterion, and was told."""
    contradicting(monkeypatch, 1)
    found = improve(rig, [recorded(1, 0.5)], [recorded(2, 0.5)])
    first, second, *_ = found.diagnoses

    assert first.contradicted and first.ranking[0].accepted and not second.contradicted
    assert set(found.kept) == {"coulomb_friction", "constant_force"}
    assert found.ahead[0].sentence.endswith("comes in with constant_force")


def test_nothing_comes_in_where_two_effects_leave_the_recording_contradicted(
    rig, singly, monkeypatch
):
    contradicting(monkeypatch, 2)
    found = improve(rig, [recorded(1, 0.5)], [recorded(2, 0.5)])

    assert found.kept == () and found.rig is rig
    assert "no effect passes every criterion on top of it" in found.ahead[0].sentence


def test_two_that_come_in_together_are_told_and_thought_over_like_a_pair(rig, singly):
    """The first one's note is no longer that of the round which refused it."""
    found = improve(rig, [recorded(1, 0.9)], [recorded(2, 0.1)])

    assert [note.partition(":")[0] for note in found.rig.notes] == [
        "coulomb_friction, together with constant_force",
        "constant_force, together with coulomb_friction",
    ]
    assert all("100% in validation" in note for note in found.rig.notes)
    assert [each.candidate.name for each in found.removals] == list(found.kept)
    assert {each.candidate.name for each in found.swaps} == set(found.kept)


def test_no_step_is_credited_with_what_another_fit_of_the_model_before_it_gives(rig):
    """What a diagnosis begins with is no higher than the bar of the step before, nor lower."""
    found = improve(rig, [recorded(1, 0.5), recorded(3, 0.5)], [recorded(2, 0.5)])
    began = [(each.base, each.base_validation) for each in found.diagnoses]

    assert {each.change for each in found.budget[2 : len(began) + 1]} == {Change.ADDED}
    for fits, stage in zip(began, found.budget[1:], strict=False):  # then second thoughts
        assert not leaves_less(fits, (stage.train, stage.validation))

    errors = [*map(per_sample, began[1])]
    for worse, told in (((2.0, 2.0), errors), ((2.0, 0.9), None), ((1.01, 1.01), None)):
        stage = Stage("+ it", *np.multiply(worse, errors).tolist())
        again = Rounds(rig, budget=(found.budget[0], stage)).fitted_again(found.diagnoses[1])
        assert again.budget == (found.budget[0], Stage("+ it", *told) if told else stage)


def refused_ahead(rig, train, held_out):
    """What one round further says where it adds nothing."""
    found = improve(rig, [train], [held_out])

    assert found.steps == found.kept == () and found.rig is rig
    assert (len(found.diagnoses), len(found.budget)) == (1, 2)
    assert "unexplained" in found.warnings[-1]
    (ahead,) = found.ahead
    assert ahead.after == 1 and ahead.name == "coulomb_friction"
    return ahead.outcome


def test_nothing_is_added_where_recordings_contradict_the_rig_one_round_further(rig, singly):
    """Held out, friction is less and the force another: no two effects can say that."""
    outcome = refused_ahead(rig, recorded(1, 0.9), recorded(2, 0.9, 3.0, -5.0))

    assert outcome == "no effect passes every criterion on top of it"


def waved(recording, seed, rms_n=9.0, memory_s=0.05):
    """A force that wanders from zero without any cause."""
    normal = np.random.default_rng(seed).standard_normal(len(recording))
    normal[0] = 0.0
    share = np.exp(-recording.sample_time_s / memory_s)
    force = lfilter([np.sqrt(1.0 - share**2)], [1.0, -share], normal)
    seen = {**recording.channels, "rod.force_n": recording["rod.force_n"] + rms_n * force}
    return replace(recording, channels=seen)


@pytest.mark.parametrize(("friction_n", "force_n"), [(4.6, 2.6), (5.3, 3.3)])
def test_two_that_predict_hardly_better_than_neither_are_not_added(
    rig, singly, friction_n, force_n
):
    """A spring earns its place beside the friction, and both together do not."""
    train = waved(recorded(1, 0.9), 5)
    outcome = refused_ahead(rig, train, waved(recorded(2, 0.5, friction_n, force_n), 6))

    assert outcome.startswith(f"with spring_force it {HELD_OUT_REASON}")


def test_an_interrupt_one_round_further_keeps_what_the_round_had_found(rig, singly):
    def interrupted(message):
        if message.startswith("one round further"):
            raise KeyboardInterrupt

    found = improve(rig, [recorded(1, 0.9)], [recorded(2, 0.1)], interrupted)

    assert found.stopped and found.steps == () and len(found.diagnoses) == 1


def test_two_effects_of_which_one_is_needless_beside_the_other_are_not_added(
    rig, singly, monkeypatch
):
    def needless(self, kept, step):
        return Removal(step.candidate, 0.0, 0.0, ("brings nothing",), True), kept

    monkeypatch.setattr(Passes, "removal", needless)
    assert "brings nothing" in refused_ahead(rig, recorded(1, 0.9), recorded(2, 0.1))
