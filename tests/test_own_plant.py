"""A user's own plant in a file: the README's example from end to end, and what is refused."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from commands import call

from workbench.errors import InputError
from workbench.plant_files import plant_named
from workbench.rig import load_rig
from workbench.rig_writing import rig_text, write_rig

README = Path(__file__).parents[1] / "README.md"
RIG = """name = "our joint"
plant = "my_plant.py:joint"

[recording]
time = { column = "time_s", unit = "s" }

[recording.channels]
"motor.force" = { column = "force_N", unit = "N" }
"slide.position" = { column = "position_mm", unit = "mm" }
"""
COULOMB_N, COGGING_N, PITCH_M = 8.0, 6.0, 0.032


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The README's file, a rig file, and two recordings that other code wrote."""
    place = tmp_path_factory.mktemp("joint")
    (place / "my_plant.py").write_text(example())
    (place / "rig.toml").write_text(RIG)
    record(place / "train.csv", 1, ((22.0, 1.1), (12.0, 2.3)))
    record(place / "validation.csv", 2, ((26.0, 1.3), (9.0, 0.8)))
    return place


def example():
    """The Python of the README."""
    (code,) = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.S)
    return code


def record(path, seed, waves):
    """6 s of a joint of 3 kg with cogging, friction and 20 N s/m, by Euler steps of 0.1 ms."""
    rng, dt = np.random.default_rng(seed), 1e-4
    time_s = dt * np.arange(60_000)
    force_n = sum(a * np.cos(2 * np.pi * f * time_s) for a, f in waves)
    x, v, seen = 0.2, 0.0, []
    for pushed_n in force_n:
        seen.append(x)
        held_n = 20.0 * v + COULOMB_N * np.tanh(v / 1e-3)
        v += dt / 3.0 * (pushed_n - held_n + COGGING_N * np.sin(2 * np.pi * x / PITCH_M))
        x += dt * v
    position_mm = 1e3 * np.array(seen[::10]) + 2e-3 * rng.standard_normal(6000)
    table = np.column_stack([time_s[::10], force_n[::10], position_mm])
    header = "time_s,force_N,position_mm"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.7g")


def test_the_example_is_complete_and_short():
    assert sum(bool(line.strip()) for line in example().splitlines()) <= 40


def test_the_effects_of_an_own_plant_are_listed_its_own_too(folder):
    answer = call("effects", f"{folder / 'my_plant.py'}:joint")

    assert answer.exit_code == 0
    assert "cogging" in answer.stdout and "our own motors" in answer.stdout
    assert "coulomb_friction" in answer.stdout


def test_the_sensors_of_an_own_plant_compete_where_it_asks_for_them(tmp_path):
    """As the README says, by one line among its effects."""
    (line,) = re.findall(r"`(\*sensor_flaws\(.*?\))`", README.read_text())
    code = example().replace("        effects=(\n", f"        effects=(\n            {line},\n")
    path = tmp_path / "my_plant.py"
    path.write_text(f"from workbench.effects.sensors import sensor_flaws\n{code}")
    answer = call("effects", f"{path}:joint")

    assert answer.exit_code == 0, answer.output
    for flaw in ("sensor_lag", "sensor_scale", "sensor_offset"):
        assert flaw in answer.stdout


def test_an_own_effect_is_found_and_added(folder):
    out, found = folder / "sub" / "better.toml", folder / "found.json"
    train, held_out = folder / "train.csv", folder / "validation.csv"
    answer = call("improve", folder / "rig.toml", train, "--validate", held_out, "-o", out)
    assert answer.exit_code == 0, answer.output
    better = load_rig(out)

    assert set(better.added) == {"coulomb_friction", "cogging"}
    assert better.plant.values["friction.coulomb_force_n"] == pytest.approx(COULOMB_N, rel=0.05)
    assert better.plant.values["cogging.amplitude_n"] == pytest.approx(COGGING_N, rel=0.005)
    assert 'plant = "../my_plant.py:joint"' in out.read_text()
    answer = call("compare", out, held_out, "--json", found)
    assert answer.exit_code == 0, answer.output
    (compared,) = json.loads(found.read_text())["recordings"]
    left_m = compared["errors"]["window"]["slide.position"]["rmse"]
    assert left_m < 5e-5  # behind the last refit 7e-5


def test_a_rig_of_an_own_plant_reads_back(folder, tmp_path):
    rig = load_rig(folder / "rig.toml")
    write_rig(rig, tmp_path / "again.toml")

    assert load_rig(tmp_path / "again.toml").plant.values == rig.plant.values
    assert rig_text(rig, folder) == rig_text(load_rig(tmp_path / "again.toml"), folder)


def test_a_file_that_changed_is_read_again(tmp_path):
    path = tmp_path / "my_plant.py"
    path.write_text(example())
    before = plant_named("my_plant.py:joint", tmp_path)
    path.write_text(example().replace("mass_kg=3.0", "mass_kg=4.0"))

    assert before.values["slide.mass_kg"] == 3.0
    assert plant_named("my_plant.py:joint", tmp_path).values["slide.mass_kg"] == 4.0


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("servo_drve", "", "there is no such plant.*or your own as file.py:function.*servo_drive"),
        ("my_plnt.py:joint", "", "my_plnt.py:joint: there is no such file.*'my_plant.py'"),
        ("my_plant.py:jont", "", "jont: my_plant.py has no such function.*'joint'"),
        ("my_plant.py:joint", "def joint(:", "invalid syntax, in line 1 of my_plant.py"),
        ("my_plant.py:joint", "x = 1\ny = x / 0", "ZeroDivisionError.*in line 2 of my_plant.py"),
        ("my_plant.py:joint", "def joint():\n    return 3", r"joint\(\): gives a int; expected"),
        ("my_plant.py:joint", "import nowhere", "ModuleNotFoundError.*in line 1 of my_plant.py"),
    ],
)
def test_what_does_not_work_is_said_in_one_line(tmp_path, name, text, said):
    (tmp_path / "my_plant.py").write_text(text or example())
    rig = tmp_path / "rig.toml"
    rig.write_text(f'name = "x"\nplant = "{name}"\n')

    with pytest.raises(InputError, match=said) as caught:
        load_rig(rig)
    (message,) = caught.value.messages
    assert message.line == 2 and message.file == str(rig)


def test_an_effect_on_a_body_that_is_not_there_is_refused(tmp_path):
    text = (
        example()
        .replace('Force("slide", self', 'Force("slde", self')
        .replace('now["slide"].position_m', 'now["slde"].position_m')
    )
    (tmp_path / "my_plant.py").write_text(text)

    with pytest.raises(InputError, match=r"the plant has no 'slde'.*in line \d+"):
        plant_named("my_plant.py:joint", tmp_path)


def test_nothing_is_named_of_a_single_stroke(folder):
    """Some effect makes up for any one window, and another manoeuvre may even agree."""
    short, found = folder / "short.csv", folder / "short.json"
    lines = (folder / "train.csv").read_text().splitlines(keepends=True)
    short.write_text("".join(lines[:701]))
    held_out = folder / "validation.csv"
    answer = call("diagnose", folder / "rig.toml", short, "--validate", held_out, "--json", found)
    assert answer.exit_code == 0, answer.output
    said = json.loads(found.read_text())

    assert said["verdict"] == "recording_too_weak" and said["effect"] is None
    assert said["sentence"].endswith("s were fitted, too little to tell what is missing")
    assert said["too_short"] is True
    assert said["after"]["train"] == {} and said["next_recording"]["what"]
