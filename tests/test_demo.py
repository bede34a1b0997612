"""The demo: it does not know the answer, finds it, and controls the improved plant."""

import json
from pathlib import Path

import pytest

from workbench.plants import PLANTS

PLANT = PLANTS["servo_drive"]()


@pytest.mark.slow
def test_the_demo_finds_what_is_missing_and_controls_the_improved_plant(tmp_path):
    from studies.demo import run_demo

    page = run_demo(tmp_path, "workbench demo", lambda message: None, lambda text: None)

    found = json.loads((tmp_path / "diagnosis.json").read_text())
    assert found["verdict"] == "found"
    for output, before in found["before"]["validation"].items():
        assert found["after"]["validation"][output]["rmse"] < before["rmse"]
    runs = json.loads((tmp_path / "check.json").read_text())["runs"]
    assert {(run["design"], run["estimator"]) for run in runs if run["scenario"] == "step"} == {
        (design, estimator) for design in ("pid", "lq", "mpc") for estimator in ("ekf", "mhe")
    }
    assert any(run["reached"] for run in runs)
    assert page.read_text().count("<svg") >= 8


def test_the_demo_does_not_know_the_answer():
    from studies import demo

    told = [path.name for path in demo.DATA.iterdir()]
    sources = [demo.__file__, demo.DATA / "rig.toml"]

    assert "truth.json" not in told
    for source in sources:
        text = Path(source).read_text(encoding="utf-8")
        assert not [name for name in PLANT.candidates if name.partition("@")[0] in text]
