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


STATES = 'expected a list of states, as ["slide.position"]'
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
        (
            [NEAR.replace("50 mm", "15 cm")],
            None,
            "the point 15 cm lies outside 'near', -inf to 100 mm; expected lower <= point < upper",
        ),
        ([FAR.replace("label", 'upper = "9 cm", label')], None, "'far', 100 mm to 9 cm, is empty"),
        ([NEAR, FAR.replace("100", "90")], None, "'near' and 'far' overlap from 90 mm to 100 mm"),
        ([NEAR, FAR.replace("100", "110")], None, "nothing covers 100 mm to 110 mm, between"),
        ([NEAR, FAR.replace("far", "near")], None, "2 regions are called 'near'"),
        ([], None, "is cut into nothing; expected at least one interval or level"),
        (['{ label = "a", level = "1 mm" }'], None, "expected intervals instead of levels"),
        ([NEAR.replace("mm", "bar")], None, "unit 'bar' does not fit; expected m"),
        ([NEAR.replace("point", "poind")], None, "a region has no 'poind'"),
        ([NEAR.replace("label", "name")], None, "a region lacks its label"),
        (["5"], None, "5 is no region"),
        ([NEAR.replace("label", "holds = 3, label")], None, f"holds: is 3; {STATES}"),
        ([NEAR.replace("label", 'holds = "x", label')], None, f"holds: is 'x'; {STATES}"),
        ([NEAR.replace("label", "holds = [3], label")], None, f"holds: is [3]; {STATES}"),
        (
            [NEAR.replace("label", 'holds = ["slide.positon"], label')],
            None,
            "'near' holds slide.positon, which is no state; expected slide.position, slide.vel"
            "ocity, chamber_a.pressure, chamber_b.pressure; did you mean 'slide.position'?",
        ),
        ([NEAR.replace('"near"', '["near"]')], None, "label: is ['near']; expected a text"),
        ([NEAR.replace('"50 mm"', "[50]")], None, "point: [50] is no quantity; expected"),
    ],
)
def test_wrong_cuts_are_told_in_one_clear_message(tmp_path, regions, signal, said):
    name = signal or "slide.position"
    path = cut(tmp_path, *regions, signal=name)

    answer = call("modes", DRIVE, "--cuts", path, "-q")

    assert answer.exit_code == 2
    assert said in answer.stderr
    for line in answer.stderr.removeprefix("workbench: ").splitlines():
        assert line.startswith(f"{path}:2: {name}: ") and "_m" not in line.removeprefix(str(path))


def test_the_values_of_a_switch_are_told_as_typed_too(tmp_path):
    (tmp_path / "rig.toml").write_text('plant = "gearbox"\n')
    regions = '{ label = "off", level = 0 }, { label = "half", level = "50 %" }'
    path = cut(tmp_path, regions, signal="valve_1.command")

    answer = call("modes", tmp_path / "rig.toml", "--cuts", path, "-q")
    first, second = answer.stderr.splitlines()

    assert answer.exit_code == 2
    assert first == f"workbench: {path}:2: valve_1.command: 'half' is at 50 %; expected 0 or 1"
    assert second.startswith(f"{path}:2: valve_1.command: nothing covers 1; expected a level for")


def test_cuts_that_cannot_be_read_are_refused_with_their_line(tmp_path):
    path = tmp_path / "cuts.toml"
    path.write_text('[cuts]\n"slide.position" = [ {\n')

    broken, none = (call("modes", DRIVE, "--cuts", p, "-q") for p in (path, tmp_path / "cut.toml"))

    assert broken.exit_code == none.exit_code == 2
    assert broken.stderr.startswith(f"workbench: {path}:") and "expected TOML" in broken.stderr
    assert "there is no such file; did you mean 'cuts.toml'?" in none.stderr


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
