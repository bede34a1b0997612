"""The study of real recordings: what it claims of its rows, and what it says without them."""

import pytest
from typer.testing import CliRunner

from studies.command_line import app
from studies.real_recordings import ABSENT, CASES, QUICK, outcome, run
from studies.study import Extent
from workbench.recordings.folder import VARIABLE


def row(case, **other):
    """As good as the best of plain least squares, with what belongs there."""
    tied = case.kind == "chamber"
    named = ["chamber_leak", "wall_heat"] if tied else ["coulomb_friction"]
    return {"named": named, "bare": 9.0, "left": case.best, "tied": tied, **other}


def held(rows):
    return [claim.holds for claim in outcome(CASES, rows).claims]


def test_every_claim_holds_of_rows_as_good_as_plain_least_squares():
    found = outcome(CASES, [row(case) for case in CASES])

    assert all(claim.holds for claim in found.claims)
    assert "chamber_leak or wall_heat" in found.text and "coulomb_friction" in found.text
    assert set(found.numbers) == {case.key for case in CASES}
    assert set(found.figures) == {"held_out"}


@pytest.mark.parametrize(
    ("name", "other", "broken"),
    [
        ("KDN", {"left": 1.2 * 1.06}, 0),
        ("KDN", {"named": ["viscous_friction", "coulomb_friction"]}, 1),
        ("X-ring257", {"named": ["coulomb_friction", "friction_pressure"]}, 2),
        ("Aluminium", {"tied": False}, 3),
        ("Aluminium", {"named": ["chamber_leak", "sensor_lag"]}, 3),
    ],
)
def test_each_claim_can_fail(name, other, broken):
    rows = [row(case, **(other if case.name == name else {})) for case in CASES]

    assert [not holds for holds in held(rows)] == [k == broken for k in range(4)]


def test_the_quick_grid_has_one_actuator_of_each_kind():
    assert len({case.kind for case in CASES if case.name in QUICK}) == len(QUICK) == 3


def test_without_the_recordings_it_says_so_and_claims_nothing(monkeypatch, tmp_path):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "nowhere"))
    found = run(tmp_path, Extent.QUICK, lambda message: None)

    assert found.text == ABSENT and found.claims == ()


def test_a_folder_that_is_none_is_wrong_input(tmp_path):
    asked = ["study", "real-recordings", "--data", str(tmp_path / "nowhere"), "-o", str(tmp_path)]
    answered = CliRunner().invoke(app, asked)

    assert answered.exit_code == 2
    assert "is no folder" in answered.stderr
