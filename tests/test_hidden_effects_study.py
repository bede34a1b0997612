"""Study hidden-effects: what its questions are, and what its rows say."""

import json
from dataclasses import replace

import pytest

from studies import hidden_study, versions
from studies.hidden_answers import counted, widened
from studies.hidden_benches import BENCHES, SERVO_DRIVE
from studies.hidden_claims import outcome
from studies.hidden_rows import Kind, Row, plain, row_again
from studies.hidden_tasks import alone, differences_of, tasks, without
from studies.kept import Kept
from studies.study import Extent
from workbench.rig import default_rig


def row(hidden="coulomb_friction", first=None, place=1, own_drop=0.9, kind=Kind.EFFECT, **other):
    """A right answer with a strong effect, unless told otherwise."""
    numbers = dict(
        plant="servo_drive", hidden=hidden, seed=1, kind=kind, size=10.0, first=first or hidden,
        found=10.0, verdict="found", place=place, tied=place == 1, right=place == 1,
        own_drop=own_drop, seconds=1.0,
    )  # fmt: skip
    return Row(**{**numbers, **other})


def held(found):
    return {claim.claim.partition(",")[0]: claim.holds for claim in found.claims}


def test_the_confusion_matrix_is_printed():
    rows = [row(seed=1), row(seed=2), row(first="stiction", place=2, seed=3), row("valve_lag")]
    printed = [line.split(maxsplit=2) for line in outcome(rows).text.splitlines()]

    assert ["servo_drive", "coulomb_friction", "coulomb_friction 2, stiction 1"] in printed
    assert ["servo_drive", "valve_lag", "valve_lag 1"] in printed


def test_answers_of_other_code_are_told(tmp_path):
    several = tasks(Extent.QUICK)[:3]
    kept = Kept(tmp_path / hidden_study.ANSWERS)
    for task, code in zip(several, ("old", versions.code_of_loops(), None), strict=True):
        kept.add(task.key, plain(row()) | ({hidden_study.CODE: code} if code else {}))

    assert hidden_study.which_code(tmp_path, several).startswith("2 of 3 answers are of other code")
    assert "; " not in hidden_study.which_code(tmp_path, several[1:2])


def test_a_question_without_the_small_differences_is_another_one_of_the_same_size():
    task = next(t for t in tasks(Extent.FULL) if t.hidden == "coulomb_friction")
    (plain_case,) = alone(task).cases

    assert task.cases[0].differences and not plain_case.differences
    assert (plain_case.size, plain_case.hidden) == (task.cases[0].size, task.hidden)
    assert alone(task).key != task.key


def test_a_question_without_one_small_difference_has_all_others():
    """What is named beside a pair may be one of them: a shift of the heat to walls that warm."""
    task = next(t for t in tasks(Extent.FULL) if t.hidden == "constant_force + valve_lag")
    cold = without(task, ["wall_k_per_j"])

    assert "wall_k_per_j" in differences_of(task)
    assert differences_of(cold) == differences_of(task) - {"wall_k_per_j"}
    assert cold.key not in (task.key, alone(task).key)


def test_a_difference_that_no_truth_has_is_refused(capsys, tmp_path):
    asked = ["--kind", "pair", "--without", "wall_k", "-o", str(tmp_path / "out")]
    with pytest.raises(SystemExit) as ended:
        hidden_study.main(asked)

    assert ended.value.code == 2 and not (tmp_path / "out").exists()
    assert "wall_k_per_j" in capsys.readouterr().err


def test_a_study_of_right_answers_holds_its_claims():
    found = outcome([row(), row("stiction"), row("nothing", "x", 0, kind=Kind.NOTHING, right=True)])

    assert all(held(found).values())
    assert "coulomb_friction" in found.text
    assert set(found.figures) == {"confusion_servo_drive"}


def test_a_visible_effect_on_rank_four_fails_three_claims():
    rows = [row(seed=k) for k in range(9)] + [row("stiction", "valve_lag", place=4)]
    said = held(outcome(rows))

    assert said["visible effects first"]
    assert not said["visible effects first or tied"]
    assert not said["visible effects in the top three"]


def test_where_more_than_three_are_said_to_do_the_same_the_top_three_claim_nothing():
    weak = {"tied": True, "verdict": "recording_too_weak"}
    crowd = row("sensor_offset", "constant_force", 4, crowd=2, **weak)
    said = held(outcome([row(seed=k) for k in range(9)] + [crowd]))

    assert said["visible effects in the top three"]
    assert said["visible effects first or tied"]


def test_a_recording_called_too_weak_for_another_reason_counts_in_the_top_three():
    weak = row("sensor_offset", "constant_force", 4, verdict="recording_too_weak")
    said = held(outcome([row(seed=k) for k in range(9)] + [weak]))

    assert not said["visible effects in the top three"]


def test_an_answer_of_code_that_told_no_crowd_is_read_without_one():
    kept = plain(row())
    del kept["crowd"]

    assert row_again(kept) == row_again(plain(row())) and row_again(kept).crowd == 0


def test_a_sample_refutes_a_bar_only_where_chance_does_not_explain_it():
    rows = [row(seed=k) for k in range(7)] + [row("stiction", "valve_lag", 2, tied=True)]
    wrong = [row("stiction", "valve_lag", 2, tied=True, seed=k) for k in range(3)]

    assert not held(outcome(rows))["visible effects first"]  # 7 of 8, asked 90 %
    assert held(outcome(rows, Extent.QUICK))["visible effects first"]
    assert not held(outcome(rows + wrong, Extent.QUICK))["visible effects first"]
    false_name = row("nothing", "stiction", 0, kind=Kind.NOTHING, right=False)
    assert not held(outcome([false_name], Extent.QUICK))["no false name where nothing is hidden"]


def test_sizes_of_strong_effects_are_claimed_by_their_median():
    close, off = row(found=10.4), row(found=6.0)
    key = "median error of the size of strong effects"

    assert held(outcome([close, close, off]))[key]
    assert not held(outcome([close, off, off]))[key]


def test_sizes_are_counted_apart_where_an_effect_removes_nearly_all():
    alone, off = row(found=10.4, own_drop=0.95), row(found=6.0, own_drop=0.7)
    claims = outcome([alone, off]).claims
    (said,) = (each.found for each in claims if each.claim.startswith("median error of the size"))

    assert "1 of 2 within 10%" in said
    assert said.endswith("where one removes over 90%, 1 of 1)")


def test_an_effect_that_hardly_shows_counts_among_all_only():
    weak = row("stiction", "valve_lag", place=7, own_drop=0.1, verdict="nothing_missing")
    said = held(outcome([row(), row("stiction"), row("wall_heat"), weak]))

    assert said["visible effects in the top three"]
    assert said["all effects first"]


def test_a_false_name_where_nothing_is_hidden_fails():
    said = held(outcome([row(), row("nothing", "stiction", 0, kind=Kind.NOTHING, right=False)]))

    assert not said["no false name where nothing is hidden"]


def test_a_pair_counts_by_its_effects_and_fails_by_a_wrong_one():
    pair = row("a + b", "a + b", 0, kind=Kind.PAIR, accepted=2, right=True)
    half = [replace(pair, accepted=1)] * 2
    well, badly = held(outcome([pair] * 8 + half)), held(outcome([pair] * 8 + half * 3))
    named = held(outcome([pair, replace(pair, wrong=1)]))

    assert well["effects of pairs found"]
    assert not badly["effects of pairs found"]
    assert well["pairs without a wrong effect"]
    assert not named["pairs without a wrong effect"]


def test_what_was_accepted_counts_for_one_hidden_effect_of_its_tie():
    hidden = ("constant_force", "valve_lag")
    tied = {"sensor_offset": ("constant_force",), "valve_offset": ("constant_force",)}

    def of(*kept):
        return counted(kept, tied, hidden, SERVO_DRIVE)

    assert of(*hidden) == (2, 0)
    assert of("sensor_offset") == (1, 0)
    assert of("sensor_offset", "valve_offset") == (1, 1)
    assert of("sensor_offset", "constant_force") == (1, 1)
    assert of("valve_lag", "sensor_lag@slide.position") == (
        1,
        0,
    )  # a small difference of every truth
    assert of("stiction") == (0, 1)


def test_one_law_of_six_may_be_missed_but_not_its_balance():
    law = row("a law", "viscous_friction", 0, kind=Kind.LAW, right=True, balance_right=True)
    missed = replace(law, right=False)
    elsewhere = replace(law, balance_right=False)

    assert all(held(outcome([law] * 5 + [missed])).values())
    assert not held(outcome([law] * 4 + [missed] * 2))["laws called outside the catalogue"]
    assert not held(outcome([law] * 5 + [elsewhere]))["laws in the right balance"]
    other = replace(missed, plant="crr_rig")
    found = {c.claim.partition(",")[0]: c for c in outcome([law] * 6 + [other]).claims}
    assert found["laws called outside the catalogue"].found.endswith("on other plants 0 of 1")
    there, lost = other, replace(other, balance_right=False)
    balance = outcome([law] * 6 + [there, lost])
    (claim,) = (c for c in balance.claims if "right balance" in c.claim)
    assert claim.holds and claim.found == "6 of 6 (100%); on other plants 1 of 2"


def test_what_was_accepted_may_stand_for_a_small_difference_that_it_was_tied_with_once():
    """A tie that names what is there is no false name, for a pair as for a single effect."""
    tied = {name: ("command_delay",) for name in ("line_delay", "valve_offset", "command_delay")}

    def of(*kept):
        return counted(kept, tied, ("constant_force", "stiction"), SERVO_DRIVE)

    assert of("constant_force", "stiction", "line_delay") == (2, 0)
    assert of("stiction", "line_delay", "valve_offset") == (1, 1)
    assert of("stiction", "line_delay", "command_delay") == (1, 1)  # that one is there by itself
    assert of("stiction", "spring_force") == (1, 1)


def test_other_priors_are_held_against_the_answer_of_the_same_case():
    effects = [row(seed=k) for k in range(10)]
    wide = [replace(each, kind=Kind.WIDTH) for each in effects]
    other = [replace(wide[0], first="stiction")]
    claim = "the same first name with priors three times as wide"

    assert held(outcome(effects + wide[1:] + other))[claim]
    assert not held(outcome(effects + wide[2:] + other * 2))[claim]
    assert claim not in held(outcome(wide))


def test_names_that_change_places_within_the_printed_tie_of_both_are_counted_beside():
    effects = [row(seed=k, first="stiction", beside=("valve_lag",)) for k in range(3)]
    effects[0] = replace(effects[0], own_drop=0.2)
    wide = [replace(each, kind=Kind.WIDTH) for each in effects]
    swapped = replace(wide[1], first="valve_lag", beside=("stiction",))
    one_sided = replace(wide[2], first="valve_lag", beside=())
    said = outcome([*effects, wide[0], swapped, one_sided])
    (claim,) = (c for c in said.claims if "wide" in c.claim)

    assert not claim.holds
    visible, tied = "of visible ones 0 of 2", "each in the other's printed tie in 2"
    assert claim.found == f"1 of 3 (33%); {visible}; {tied}"


def test_weak_recordings_are_claimed_apart_from_effects():
    weak = row("valve_lag", "stiction", 9, kind=Kind.WEAK, right=True)
    said = held(outcome([weak] * 5 + [replace(weak, right=False)]))

    assert said == {"recordings called too weak": True}


def test_a_row_survives_as_json():
    kept = row(own_drop=float("nan"), kind=Kind.WEAK, beside=("valve_lag",))
    again = row_again(json.loads(json.dumps({"key": "a", **plain(kept)}, allow_nan=False)))

    assert repr(again) == repr(kept)


def test_the_full_grid_is_what_the_issue_asks_for():
    full, quick = tasks(Extent.FULL), tasks(Extent.QUICK)

    def count(kind, plant="servo_drive"):
        found = [t for t in full if t.kind is kind and t.plant == plant]
        return len({t.hidden for t in found}), len(found)

    assert count(Kind.EFFECT) >= (20, 60)
    for plant, least in (("crr_rig", (8, 16)), ("gearbox", (6, 12)), ("soft_joint", (6, 12))):
        assert count(Kind.EFFECT, plant) >= least
    assert count(Kind.PAIR)[1] == count(Kind.NOTHING)[1] == 10
    assert count(Kind.LAW)[0] == count(Kind.WEAK)[0] == 6
    assert count(Kind.WIDTH) == count(Kind.EFFECT)
    assert {t.seed for t in full if t.kind is Kind.LAW} == {1}
    assert {t.seed for t in quick} == {1}
    assert {t.kind for t in quick} == set(Kind) - {Kind.WIDTH}
    assert len({t.key for t in full}) == len(full)


def test_every_law_outside_has_its_balance():
    for bench in BENCHES.values():
        assert set(bench.laws) == set(bench.truth.outside_catalogue)


def test_wider_priors_are_wider_by_that_much():
    rig = default_rig("servo_drive")
    wide = widened(rig, 3.0)

    for name in ("slide.mass_kg", "valve_dead_zone.centre_v", "supply.pressure_pa"):
        assert wide.standard_deviation(name) == 3.0 * rig.standard_deviation(name) > 0.0
    assert wide.plant is rig.plant
