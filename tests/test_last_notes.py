"""Notes in the rig file that an improvement ends with: what they say holds of that rig."""

# ruff: noqa: F811  (fixtures of other tests)

from dataclasses import replace
from math import nan
from types import SimpleNamespace

import pytest
from test_improvement import rig, sets, steps_of  # noqa: F401

from workbench.diagnosis import improve as improving
from workbench.diagnosis.addition import accept, add, alike_text, apart, noted
from workbench.diagnosis.diagnose import diagnose, silent
from workbench.diagnosis.last_notes import with_last_notes
from workbench.diagnosis.passes import Kept, Removal, Swap
from workbench.diagnosis.rounds import Rounds
from workbench.rig import load_rig
from workbench.rig_writing import rig_text


@pytest.fixture(scope="module")
def pair(rig, sets):
    step = add(rig, "coulomb_friction + constant_force", *sets)
    return Kept(apart(step), step.fit, step.validation_fit)


def asked(step, train, held_out, dropped=False):
    return Removal(step.candidate, train, held_out, ("brings nothing",) * dropped, dropped)


def last(kept):
    return [step.rig.notes[-1] for step in kept.steps]


def test_no_note_names_a_partner_that_is_gone(pair):
    friction, force = pair.steps
    alone = replace(pair, steps=(friction,))
    removals = (asked(friction, 0.31, 0.28), asked(force, 0.001, 0.0, dropped=True))

    assert "together with constant_force" in friction.rig.notes[-1]
    assert last(with_last_notes(alone, pair.steps, removals)) == [
        "coulomb_friction: weighted misfit 31% smaller in training, 28% in validation"
    ]
    (unasked,) = last(with_last_notes(alone, pair.steps, ()))
    assert unasked.startswith("coulomb_friction: with another, which went again, weighted misfit")
    assert "constant_force" not in unasked


def test_a_note_says_what_its_effect_removes_in_the_end_where_its_round_had_another_share(pair):
    friction, force = pair.steps
    needed = Removal(force.candidate, nan, nan, ("another needs it",), False)
    told = last(with_last_notes(pair, pair.steps, (asked(friction, 0.31, 0.28), needed)))

    assert told[0] == (
        f"{friction.rig.notes[-1]}; on top of all else in the backward pass "
        "31% smaller in training, 28% in validation"
    )
    assert told[1] == force.rig.notes[-1]
    same = (asked(friction, friction.drop_train, friction.drop_validation),)
    assert last(with_last_notes(pair, pair.steps, same)) == last(pair)


def test_the_rig_file_holds_the_notes_of_the_end(rig, sets, pair, monkeypatch):
    done = Rounds(rig, kept=pair, steps=pair.steps).told(diagnose(rig, *sets))
    monkeypatch.setattr(improving, "forward", lambda *asked: done)
    needless = Removal(pair.steps[1].candidate, 0.0, 0.0, ("brings nothing",), True)

    def removal(self, kept, step):
        if step is pair.steps[0]:
            return asked(step, 0.31, 0.28), kept
        return needless, replace(kept, steps=kept.without(step))

    monkeypatch.setattr(improving.Passes, "removal", removal)
    monkeypatch.setattr(improving.Passes, "swaps", lambda self, kept, step: ([], kept))
    found = improving.improve(rig, *sets)

    assert found.kept == ("coulomb_friction",)
    assert load_rig(rig_text(found.rig)).notes == (
        "coulomb_friction: weighted misfit 31% smaller in training, 28% in validation",
    )


def test_what_a_law_sends_away_is_in_no_note_and_not_among_what_is_kept(
    rig, sets, pair, monkeypatch
):
    first = diagnose(rig, *sets)
    lawful = replace(first, ranking=(), law=SimpleNamespace(steps=()))
    done = Rounds(rig, kept=pair, steps=pair.steps).told(lawful)
    friction, force = pair.steps

    def without(done, last, *asked):
        return replace(done, kept=replace(done.kept, steps=done.kept.without(force))), last

    monkeypatch.setattr(improving, "forward", lambda *asked: done)
    monkeypatch.setattr(improving.Passes, "removal", lambda self, kept, s: (asked(s, 1, 1), kept))
    monkeypatch.setattr(improving.Passes, "swaps", lambda self, kept, step: ([], kept))
    monkeypatch.setattr(improving, "_without_needless", without)
    monkeypatch.setattr(improving, "_with_terms", lambda done, *asked: done)
    found = improving.improve(rig, *sets, law=True)

    assert found.kept == found.rig.added == (friction.candidate.name,)
    assert not any(force.candidate.name in note for note in found.rig.notes)


def test_a_share_is_of_what_stayed_and_not_of_when_it_went(pair):
    """What the backward pass drops a swap may bring back."""
    went = asked(pair.steps[0], 0.01, 0.0, dropped=True)

    assert last(with_last_notes(pair, pair.steps, (went,))) == last(pair)


def test_the_note_of_what_is_accepted_says_what_it_is_not_told_apart_from(rig, sets):
    diagnosis = diagnose(rig, *sets, silent)
    best, *others = diagnosis.ranking
    alone = replace(best, tied_with=(), crowd=())
    tied = replace(best, tied_with=("one", "two"), crowd=("three", "four", "five"))
    notes = [
        accept(rig, replace(diagnosis, ranking=(row, *others))).rig.notes[-1]
        for row in (alone, tied)
    ]

    assert "not told apart" not in notes[0]
    assert notes[1] == f"{notes[0]}; not told apart from one, two, three and 2 more"
    halves = apart(accept(rig, replace(diagnosis, ranking=(tied, *others))))
    assert halves[0].rig.notes[-1].endswith("and 2 more")


def test_a_rival_that_the_swap_pass_told_apart_is_named_no_longer(rig, sets):
    diagnosis = diagnose(rig, *sets, silent)
    best, other, *rest = diagnosis.ranking
    names = (other.candidate.name, "second", "third")
    row = replace(best, tied_with=names, crowd=())
    step = accept(rig, replace(diagnosis, ranking=(row, other, *rest)))
    kept = Kept((step,), step.fit, step.validation_fit)
    swap = Swap(best.candidate, other.candidate, 0.99, 0.99, 0.8, 0.8, False)
    of_its_round = replace(swap, share_train=step.drop_train, share_validation=0.99)

    def alike(*swaps, kept=kept):
        (note,) = last(with_last_notes(kept, kept.steps, (), swaps))
        return note.partition("not told apart from ")[2]

    assert alike() == ", ".join(names)
    assert alike(swap) == "second, third"
    assert alike(replace(swap, rival_validation=0.99)) == alike(of_its_round) == alike()


def test_what_came_in_too_is_not_named_as_not_told_apart(pair):
    friction, force = pair.steps
    names = (force.candidate.name, "third")
    tied = replace(noted(friction, f"{friction.rig.notes[-1]}{alike_text(names)}"), alike=names)
    both = Kept((tied, force), pair.fit, pair.validation)

    assert last(with_last_notes(both, (), ()))[0].endswith("; not told apart from third")
