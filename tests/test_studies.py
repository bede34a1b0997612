"""Studies: what one writes, the command, the gallery."""

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from studies.command_line import app
from studies.registry import STUDIES
from studies.running import ALL, run_study
from studies.study import Claim, Extent, Outcome, Study

ROOT = Path(__file__).parent.parent
MOST_BYTES = 120_000


@pytest.fixture
def small():
    """A study of one claim that does not hold."""
    claims = (Claim("two and two make five", "4", holds=False),)
    return Study("sum", "do they?", "-", lambda *_: Outcome("4", claims, {}, {"sum": 4}))


def test_a_study_writes_its_text_and_numbers_and_says_whether_claims_hold(small, tmp_path):
    said = []
    failed = run_study(small, tmp_path, Extent.QUICK, "workbench study sum", print, said.append)

    document = json.loads((tmp_path / "study.json").read_text())
    assert failed == ["sum: two and two make five (4)"]
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


def test_the_gallery_shows_eight_small_figures_of_studies_that_there_are():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[[^]]+\]\((studies/gallery/[^)]+)\)", text)
    named = set(re.findall(r"workbench study ([a-z0-9-]+)", text))

    assert len(shown) == 8
    assert {path.name for path in (ROOT / "studies" / "gallery").iterdir()} == {
        Path(path).name for path in shown
    }
    assert all((ROOT / path).stat().st_size < MOST_BYTES for path in shown)
    assert named <= {*STUDIES, ALL}
