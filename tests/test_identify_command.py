"""The command `workbench identify`."""

import json

import pytest
from commands import call

from studies import identification as study
from studies.command_line import ORDER
from studies.truth import dedicated as truth
from workbench.identification import PROCEDURES
from workbench.rig import load_rig


def test_identify_lists_every_procedure_with_its_recording():
    lines = call("identify").stdout.splitlines()

    assert "identify" in ORDER
    assert [line.split()[0] for line in lines[1:]] == list(PROCEDURES)
    for line, each in zip(lines[1:], PROCEDURES.values(), strict=True):
        assert each.manoeuvre in line


def test_identify_writes_a_rig_with_what_it_found(tmp_path):
    release = study.recording(truth.reservoir_release(study.DRIVE, 0.290, "a", seed=4), "release")
    study.write_files({"dead-volume": [release]}, tmp_path)
    rig, better, out = (tmp_path / n for n in ("drive_and_tank.toml", "better.toml", "found.json"))
    answer = call(
        "identify", "dead-volume", rig, tmp_path / "release.csv", "-o", better, "--json", out,
        "--tank", "0.344 l", "--figures", tmp_path,
    )  # fmt: skip

    assert answer.exit_code == 0, answer.output
    document = json.loads(out.read_text())
    assert document["schema"] == "workbench.identification/1"
    told = document["parameters"]["chamber_a.dead_volume"]["value"]
    assert load_rig(better).plant.values["chamber_a.dead_volume_m3"] == pytest.approx(told)
    assert (tmp_path / "dead_volume.svg").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["dead-zon"], "did you mean 'dead-zone'?"),
        (["friction"], "needs a rig and recordings; expected one constant command"),
        (["friction", "rig.toml", "a.csv", "--tank", "1 l"], "takes no volume of a tank"),
        (["dead-volume", "rig.toml", "a.csv", "--tank", "1 bar"], "does not fit"),
    ],
)
def test_identify_says_what_is_wrong(words, said):
    answer = call("identify", *words)

    assert answer.exit_code == 2
    assert said in answer.stderr
