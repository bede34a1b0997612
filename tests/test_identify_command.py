"""The command `workbench identify`."""

import json
from pathlib import Path

import pytest
from commands import call

from studies import identification as study
from studies.command_line import ORDER
from studies.truth import dedicated as truth
from workbench.identification import PROCEDURES
from workbench.rig import load_rig

README = Path(__file__).parent.parent / "README.md"
FIGURES = " --figures figures"


def test_identify_lists_every_procedure_with_its_recording():
    lines = call("identify").stdout.splitlines()

    rows = lines[1 : 1 + len(PROCEDURES)]
    assert "identify" in ORDER
    assert [line.split()[0] for line in rows] == list(PROCEDURES)
    for line, each in zip(rows, PROCEDURES.values(), strict=True):
        assert each.manoeuvre in line
    for each in PROCEDURES.values():
        names = list(PROCEDURES)
        assert not each.first or names.index(each.first) < names.index(each.name)


@pytest.mark.parametrize("name", PROCEDURES)
def test_a_procedure_alone_is_told_how_it_is_done(name):
    answer = call("identify", name)
    said = " ".join(answer.stdout.split())

    assert answer.exit_code == 0
    for part in (PROCEDURES[name].manoeuvre, PROCEDURES[name].channels, PROCEDURES[name].source):
        assert part in said
    assert f"workbench identify {name}" in said
    assert max(map(len, answer.stdout.splitlines())) <= 100


def test_the_commands_of_the_guides_are_the_chain_of_the_readme():
    """Each takes the rig that the one before it wrote; the flow of a tank goes into a drive."""
    lines = README.read_text(encoding="utf-8").splitlines()
    rows = [line.split("`")[1] for line in lines if line.startswith("|") and "`identify " in line]
    told = [f"identify {each.example.removesuffix(FIGURES)}" for each in PROCEDURES.values()]

    assert sorted(told) == sorted(rows) and len(rows) == len(PROCEDURES)


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
    assert document["estimates"]["chamber_a.total_volume"]["paper"] == pytest.approx(1.734e-4)
    assert "173.4 cm^3" in answer.stdout
    written = load_rig(better)
    assert written.plant.values["chamber_a.dead_volume_m3"] == pytest.approx(told)
    assert written.deviations["chamber_a.dead_volume_m3"] > 0
    assert written.notes[0].startswith("dead-volume identified chamber_a.dead_volume from release")
    assert (tmp_path / "dead_volume.svg").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["dead-zon"], "did you mean 'dead-zone'?"),
        (["friction", "rig.toml"], "needs recordings; expected one constant command"),
        (["friction", "rig.toml", "a.csv", "--into", "b.toml"], "writes nothing without -o"),
        (["friction", "rig.toml", "a.csv", "--tank", "1 l"], "takes no volume of a tank"),
        (["dead-volume", "rig.toml", "a.csv", "--tank", "1 bar"], "does not fit"),
        (["dead-volume", "rig.toml", "a.csv", "--tank", "0.344"], 'such as "0.344 l"'),
        (["dead-volume", "rig.toml", "a.csv", "--tank", "-1 l"], "is no volume of a tank"),
        (["dead-volume", "rig.toml", "a.csv", "--tank", "nan l"], "is no volume of a tank"),
    ],
)
def test_identify_says_what_is_wrong(words, said):
    answer = call("identify", *words)

    assert answer.exit_code == 2
    assert said in answer.stderr
