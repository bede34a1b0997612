"""The command ``modes``: every plant, a user's own cuts and recordings, and what it refuses."""

import json

import pytest
from commands import call

import studies.demo

DRIVE = studies.demo.DATA / "rig.toml"
BRIEF = ("--no-validity", "-q")
PLANTS = {
    "gearbox": 9,
    "crr_rig": 60,
    "crr_arm": 33,
    "soft_joint": 4,
    "soft_joint_parametric": 2,
    "servo_reservoir": 5,
}
NEAR = '{ label = "near", upper = "100 mm", point = "50 mm" }'
FAR = '{ label = "far", lower = "100 mm", point = "200 mm" }'


def cut(folder, *regions, signal="slide.position"):
    """A file of cuts of one signal."""
    path = folder / "cuts.toml"
    path.write_text(f'[cuts]\n"{signal}" = [{", ".join(regions)}]\n')
    return path


SLOW = ("crr_rig", "crr_arm")  # half a minute each: linkages
ANY = [pytest.param(each, marks=pytest.mark.slow) if each in SLOW else each for each in PLANTS]


@pytest.mark.parametrize("plant", ANY)
def test_every_plant_has_a_table_a_map_and_a_step(tmp_path, plant):
    (tmp_path / "rig.toml").write_text(f'plant = "{plant}"\n')
    words = ("--json", tmp_path / "modes.json", "--export", tmp_path / "modes", *BRIEF)

    answer = call("modes", tmp_path / "rig.toml", *words)
    document = json.loads((tmp_path / "modes.json").read_text())

    assert answer.exit_code == 0, answer.output
    assert len(document["modes"]) == PLANTS[plant]
    assert answer.stdout.splitlines()[PLANTS[plant]].startswith(document["modes"][-1]["name"])
    assert {path.stem for path in (tmp_path / "modes").glob("*.svg")} == {
        "poles", "mode_poles", "mode_map", "step"
    }  # fmt: skip


def test_modes_are_placed_on_a_recording(tmp_path):
    recording = studies.demo.DATA / "train.csv"
    words = ("--place", recording, "--number", 5, "--json", tmp_path / "modes.json")

    answer = call("modes", DRIVE, *words, *BRIEF)
    modes = json.loads((tmp_path / "modes.json").read_text())["modes"]

    assert answer.exit_code == 0, answer.output
    assert len(modes) == 5
    assert any(mode["name"].startswith("stick") for mode in modes)


def test_cuts_of_ones_own_make_the_modes(tmp_path):
    answer = call("modes", DRIVE, "--cuts", cut(tmp_path, NEAR, FAR), *BRIEF)

    assert answer.exit_code == 0, answer.output
    assert [line.split()[0] for line in answer.stdout.splitlines()[1:3]] == ["near", "far"]


@pytest.mark.parametrize(
    ("regions", "signal", "said"),
    [
        ([NEAR], "slide.postion", "has no such signal to cut; expected slide.position, "),
        ([NEAR.replace("50 mm", "150 mm")], None, "the point 0.15 lies outside 'near', -inf to"),
        ([FAR.replace("label", 'upper = "90 mm", label')], None, "'far', 0.1 to 0.09, is empty"),
        ([NEAR, FAR.replace("100", "90")], None, "'near' and 'far' overlap from 0.09 to 0.1"),
        ([NEAR, FAR.replace("100", "110")], None, "nothing covers 0.1 to 0.11, between"),
        ([NEAR.replace("mm", "bar")], None, "unit 'bar' does not fit; expected m"),
        ([NEAR.replace("point", "poind")], None, "a region has no 'poind'"),
        ([NEAR.replace("label", "name")], None, "a region lacks its label"),
        (["5"], None, "5 is no region"),
    ],
)
def test_wrong_cuts_are_told_in_one_clear_message(tmp_path, regions, signal, said):
    path = cut(tmp_path, *regions, signal=signal or "slide.position")

    answer = call("modes", DRIVE, "--cuts", path, "-q")

    assert answer.exit_code == 2
    assert said in answer.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--number", 5], "--number: needs a recording to place modes on; expected --place REC"),
        (["--horizon", "5 kg"], "--horizon: unit 'kg' does not fit"),
        (["--horizon", "0 s"], "--horizon: is 0; expected more than zero"),
        (["--tolerance", "-1"], "--tolerance: is -1; expected more than zero"),
        (["--place", "none.csv"], "none.csv: there is no such file"),
        (["--regimes", "--place", studies.demo.DATA / "train.csv"], "each choose the regions"),
        (["--cuts", DRIVE], "has no [cuts]"),
        (["--for", "axis-lqr"], "the list of controllers has no axis-lqr; did you mean axis-lq?"),
        (["--for", "pressure"], "no modes to control a pressure with for servo_drive"),
        (["--for", "lq", "--regimes"], "each choose the regions"),
    ],
)
def test_options_that_cannot_be_are_refused(words, said):
    answer = call("modes", DRIVE, *words, "-q")

    assert answer.exit_code == 2
    assert said in answer.stderr


@pytest.mark.parametrize("plant", ["vertical_cylinder", "cylinder_bench", "closed_chamber"])
def test_a_plant_without_a_command_is_refused_in_one_line(tmp_path, plant):
    (tmp_path / "rig.toml").write_text(f'plant = "{plant}"\n')

    answer = call("modes", tmp_path / "rig.toml", "-q")

    assert answer.exit_code == 2
    assert f"no standard modes for {plant}; there are some for servo_drive" in answer.stderr
