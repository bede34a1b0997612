"""Studies: what is kept of long work, what the rows of the hidden-effect study say, the command."""

import json

import pytest
from typer.testing import CliRunner

from studies.command_line import app
from studies.hidden_study import Row, outcome
from studies.kept import Kept
from studies.registry import STUDIES
from studies.running import run_study
from studies.study import Claim, Extent, Outcome, Study


def row(hidden="coulomb_friction", first=None, place=1, own_drop=0.9, kind="effect", **other):
    """A right answer with a strong effect, unless told otherwise."""
    numbers = dict(
        plant="servo_drive", hidden=hidden, seed=1, kind=kind, size=10.0, first=first or hidden,
        found=10.0, verdict="found", place=place, tied=place == 1, right=place == 1,
        own_drop=own_drop, seconds=1.0,
    )  # fmt: skip
    return Row(**{**numbers, **other})


def held(found):
    return {claim.claim.partition(",")[0]: claim.holds for claim in found.claims}


def test_rows_survive_and_a_line_cut_short_is_left_out(tmp_path):
    path = tmp_path / "work" / "rows.jsonl"
    Kept(path).add("a", {"value": 1})
    with path.open("a", encoding="utf-8") as file:
        file.write('{"key": "b", "val')

    again = Kept(path)
    assert "a" in again
    assert "b" not in again
    again.add("c", {"value": 3})

    assert [r["value"] for r in Kept(path).rows.values()] == [1, 3]


def test_a_study_of_right_answers_holds_its_claims():
    found = outcome([row(), row("stiction"), row("nothing", "x", 0, kind="nothing", right=True)])

    assert all(held(found).values())
    assert "coulomb_friction" in found.text
    assert set(found.figures) == {"confusion_servo_drive"}


def test_a_visible_effect_on_rank_four_fails_three_claims():
    rows = [row(seed=k) for k in range(9)] + [row("stiction", "valve_lag", place=4)]
    said = held(outcome(rows))

    assert said["visible effects first"]
    assert not said["visible effects first or tied"]
    assert not said["visible effects in the top three"]


def test_an_effect_that_hardly_shows_counts_among_all_only():
    weak = row("stiction", "valve_lag", place=7, own_drop=0.1, verdict="nothing_missing")
    said = held(outcome([row(), row("stiction"), row("wall_heat"), weak]))

    assert said["visible effects in the top three"]
    assert said["all effects first"]


def test_a_false_name_where_nothing_is_hidden_fails():
    said = held(outcome([row(), row("nothing", "stiction", 0, kind="nothing", right=False)]))

    assert not said["no false name"]


@pytest.fixture
def small():
    """A study of one claim that does not hold."""
    claims = (Claim("two and two make five", "4", holds=False),)
    return Study("sum", "do they?", "-", lambda *_: Outcome("4", claims, {}, {"sum": 4}))


def test_a_study_writes_its_text_and_numbers_and_says_whether_claims_hold(small, tmp_path):
    said = []
    holds = run_study(small, tmp_path, Extent.QUICK, "workbench study sum", print, said.append)

    document = json.loads((tmp_path / "study.json").read_text())
    assert not holds
    assert document["claims"] == [{"claim": "two and two make five", "found": "4", "holds": False}]
    assert document["numbers"] == {"sum": 4}
    assert "NO" in said[0]
    assert (tmp_path / "study.txt").read_text().rstrip("\n") == said[0]


def test_the_command_refuses_an_unknown_study_with_the_nearest():
    answered = CliRunner().invoke(app, ["study", "hidden-efects"])

    assert answered.exit_code == 2
    assert "did you mean 'hidden-effects'" in answered.stderr


def test_every_study_is_listed_with_its_question():
    said = CliRunner().invoke(app, ["studies"]).stdout

    for study in STUDIES.values():
        assert study.name in said
        assert study.question in said
