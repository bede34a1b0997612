"""Backward and swap pass where effects hang on each other: one needs another, or came on top."""

from types import SimpleNamespace

import pytest
from test_diagnosis import bench, coulomb, nothing
from test_improvement import BARE, steps_of

from studies.improvement_text import improvement_text
from workbench.diagnosis import improve as improvement
from workbench.diagnosis import passes as passing
from workbench.diagnosis import settle
from workbench.diagnosis.diagnose import diagnose, silent
from workbench.diagnosis.improve import improve
from workbench.diagnosis.passes import Kept, Passes
from workbench.diagnosis.rounds import Rounds
from workbench.diagnosis.settle import settled_leader
from workbench.rig import load_rig

SETS = [bench(1, coulomb, 5.0), bench(3, coulomb, 5.0, 1e5)], [bench(2, coulomb, 5.0, 4e5)]
BLANK = [bench(1, nothing), bench(3, nothing, 0.0, 1e5)], [bench(2, nothing, 0.0, 4e5)]


@pytest.fixture(scope="module")
def rig():
    return load_rig(BARE)


def test_no_rival_takes_the_place_of_what_a_kept_effect_needs(rig, monkeypatch):
    """Static friction is what Coulomb's is exceeded by: without it, it means nothing."""
    monkeypatch.setattr(passing, "clearly_better", lambda *asked: True)
    kept = steps_of(rig, SETS, "coulomb_friction", "stiction")
    passes = Passes(rig, *SETS, {"coulomb_friction": diagnose(rig, *SETS)}, silent)

    assert passes._rivals(kept, kept.steps[0])
    assert passes.swaps(kept, kept.steps[0]) == ([], kept)


def test_what_is_left_alone_is_asked_against_the_rig_as_it_came(rig, monkeypatch):
    """Neither is needed; the second was judged on top of the first alone."""
    kept = steps_of(rig, BLANK, "viscous_friction", "constant_force")
    done = Rounds(rig, kept=kept, steps=kept.steps).told(diagnose(rig, *BLANK))
    monkeypatch.setattr(improvement, "forward", lambda *asked: done)
    found = improve(rig, *BLANK)

    assert [each.candidate.name for each in found.removals] == list(kept.names)
    assert all(each.dropped and each.reasons for each in found.removals)
    assert found.kept == () and found.rig is rig
    assert "constant_force" in improvement_text(found, {"rod.force": "rod.force_n"})


def test_what_is_needed_is_asked_after_what_needs_it(rig, monkeypatch):
    """Where stiction goes, what stands only because stiction needs it is asked too."""
    kept = steps_of(rig, SETS, "coulomb_friction", "stiction", "constant_force")
    done = Rounds(rig, kept=kept, steps=kept.steps).told(diagnose(rig, *SETS))
    monkeypatch.setattr(passing, "reasons_against", lambda *asked: ("brings nothing",))
    monkeypatch.setattr(passing, "leaves_more", lambda *asked: False)
    found = improvement._thought_over(done, *SETS, silent)

    asked = {each.candidate.name: each for each in found.removals}
    assert [*asked] == ["stiction", "coulomb_friction", "constant_force"]
    assert all(each.dropped for each in asked.values())
    assert all(each.reasons == ("brings nothing",) for each in asked.values())


def test_the_order_of_asking_is_that_of_coming_in_where_none_needs_another(rig):
    kept = steps_of(rig, SETS, "coulomb_friction", "viscous_friction", "stiction")
    needed, other, needing = kept.steps
    passes = Passes(rig, *SETS, {}, silent)

    assert passes.in_turn((needed, other)) == (needed, other)
    assert passes.in_turn(kept.steps) == (other, needing, needed)
    assert passes.in_turn((needing, needed, other)) == (needing, needed, other)


def test_a_rival_that_takes_a_place_has_its_size_settled_like_any_addition(rig, monkeypatch):
    """Its refit weighs errors as the model without it made them, and stops short."""
    wrong = steps_of(rig, SETS, "viscous_friction", "constant_force")
    passes = Passes(rig, *SETS, {"viscous_friction": diagnose(rig, *SETS)}, silent)
    asked = []

    def settled(fit, candidate):
        asked.append((fit, candidate.name))
        return settled_leader(fit, candidate)

    monkeypatch.setattr(settle, "settled_leader", settled)
    tried, better = passes.swaps(wrong, wrong.steps[0])
    ((refitted, name),) = asked

    assert tried[-1].replaced and name == "coulomb_friction" == tried[-1].rival.name
    assert tried[-1].addition is better.steps[-1]
    assert better.fit is better.steps[-1].fit is not refitted
    assert better.validation is better.steps[-1].validation_fit
    assert better.fit.windows.scale.max() < 0.5 * refitted.windows.scale.max()


def test_an_effect_stays_where_both_errors_grow_without_it(rig, monkeypatch):
    """Put back from afar it may end in a worse valley than the one in which it came in.

    So a leak was dropped beside a droop, and chi2 per sample went from 95 to 720.
    """
    monkeypatch.setattr(passing, "reasons_against", lambda base, found: ("in another valley",))
    kept = steps_of(rig, SETS, "coulomb_friction", "constant_force")

    removal, same = Passes(rig, *SETS, {}, silent).removal(kept, kept.steps[0])

    assert not removal.dropped and same is kept
    assert removal.reasons[0].startswith("without it chi2 per sample grows from ")


def missing(error, length=200):
    """A fit that misses so much per sample of windows of this length."""
    return SimpleNamespace(error=error, windows=SimpleNamespace(length=length))


@pytest.mark.parametrize(
    ("without", "stays"),
    [((1.3, 1.1), True), ((1.1, 1.3), True), ((1.2, 1.2), False), ((3.0, 0.99), False)],
)
def test_both_errors_are_to_grow_and_one_by_a_quarter(without, stays, monkeypatch):
    monkeypatch.setattr(passing, "per_sample", lambda fit: fit.error)
    kept = Kept((), missing(1.0), missing(1.0))

    assert passing.leaves_more(kept, Kept((), *map(missing, without))) == stays
    assert not passing.leaves_more(kept, Kept((), missing(9.0, 400), missing(9.0, 400)))


def test_no_rival_takes_a_place_with_which_both_errors_grow(rig, monkeypatch):
    """However much more of the model without both it removes."""
    kept = steps_of(rig, SETS, "viscous_friction", "constant_force")
    passes = Passes(rig, *SETS, {"viscous_friction": diagnose(rig, *SETS)}, silent)
    monkeypatch.setattr(passing, "leaves_more", lambda before, after: True)

    tried, same = passes.swaps(kept, kept.steps[0])

    assert tried and not any(each.replaced for each in tried)
    assert same is kept
