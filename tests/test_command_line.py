"""The command `workbench` as a user meets it: what it prints, writes, refuses and answers."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from commands import call

from studies.command_line import ORDER
from studies.command_line.application import spread
from workbench.causes import all_causes
from workbench.plants import PLANTS
from workbench.reading import read_recording
from workbench.rig import default_rig, load_rig

RIG = 'name = "drive 7"\nplant = "servo_drive"\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A rig file and commands of 0.6 s."""
    place = tmp_path_factory.mktemp("drive")
    (place / "rig.toml").write_text(RIG)
    command = np.full(600, 4.95)
    command[50:200], command[400:550] = 6.0, 3.9
    rows = [f"{1e-3 * k:.3f},{value}" for k, value in enumerate(command)]
    (place / "commands.csv").write_text("\n".join(["time,valve.command", "s,V", *rows]) + "\n")
    return place


@pytest.fixture(scope="module")
def simulated(folder):
    """A recording that `simulate` wrote."""
    out = folder / "simulated.csv"
    answer = call("simulate", folder / "rig.toml", folder / "commands.csv", "-o", out)
    assert answer.exit_code == 0, answer.output
    return out


def test_help_is_there_at_once_for_every_command_with_an_example():
    asked = [sys.executable, "-X", "importtime", "-m", "studies.command_line", "--help"]
    done = subprocess.run(asked, capture_output=True, text=True)

    assert done.returncode == 0
    for slow in ("casadi", "scipy", "matplotlib"):  # 0.15 s alone on the machine without them
        assert f" {slow}\n" not in done.stderr
    for name in ORDER:
        assert f"  {name} " in done.stdout
        answer = call(name, "--help")
        assert answer.exit_code == 0
        assert f"Example:\n    workbench {name}" in answer.output


@pytest.mark.parametrize(("chosen", "used"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "4"}, "4")])
def test_matrix_products_take_one_thread_unless_another_number_was_chosen(chosen, used):
    told = "print(os.environ['OPENBLAS_NUM_THREADS'], 'numpy' in sys.modules)"
    code = f"import os, sys, studies.command_line as c; c.app = lambda: {told}; c.main()"
    kept = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}

    run = [sys.executable, "-c", code]
    said = subprocess.run(run, env=kept | chosen, capture_output=True, text=True, check=True)
    assert said.stdout.split() == [used, "False"]


def test_plants_are_listed_one_line_each():
    lines = call("plants").stdout.splitlines()

    assert [line.split()[0] for line in lines[1:]] == list(PLANTS)


def test_effects_lists_every_cause_of_the_catalogue():
    words = {line.split()[0] for line in call("effects").stdout.splitlines()[1:]}

    placed = {c.cause.name for build in PLANTS.values() for c in build().candidates.values()}
    assert placed | {"added_mass", "dead_volume"} <= words
    assert words == {*all_causes()}


@pytest.mark.parametrize("command", [["plants"], ["effects"], ["studies"]])
def test_lists_take_quiet_like_every_command(command):
    assert call(*command, "-q").exit_code == 0


def test_an_effect_that_sits_on_a_part_is_known_where_it_has_no_place(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text('plant = "cylinder_bench"\n[effects]\nadd = ["added_mass", "added_mas"]\n')

    said = call("compare", rig, "run.csv").stderr.splitlines()

    assert "added_mass: cylinder_bench has no place for this effect" in said[0]
    assert "added_mas: there is no such effect" in said[1]


@pytest.mark.parametrize("plant", PLANTS)
def test_effects_of_a_plant_tell_null_typical_unit_balance_and_source(plant):
    candidates = PLANTS[plant]().candidates
    lines = call("effects", plant).stdout.splitlines()

    for column in ("null", "typical", "unit", "balance", "source"):
        assert column in lines[0]
    listed = {line.split()[0]: line for line in lines[1:]}
    assert set(listed) == set(candidates)
    for name, candidate in candidates.items():
        assert candidate.cause.balance.value in listed[name]
        assert candidate.cause.source in listed[name]


def test_an_unknown_plant_gets_the_nearest_name():
    answer = call("effects", "servo_driv")

    assert answer.exit_code == 2
    assert "did you mean 'servo_drive'?" in answer.stderr


def test_a_simulation_is_a_recording_that_reads_back(folder, simulated):
    recording = read_recording(load_rig(folder / "rig.toml"), simulated)

    assert len(recording) == 600
    assert set(default_rig("servo_drive").plant.measured) <= set(recording.channels)


def test_compare_finds_no_error_in_what_the_plant_itself_made(folder, simulated):
    out = folder / "errors.json"
    answer = call("compare", folder / "rig.toml", simulated, "--json", out)

    assert answer.exit_code == 0, answer.output
    assert "comparing" in answer.stderr and "comparing" not in answer.stdout
    document = json.loads(out.read_text())
    errors = document["recordings"][0]["errors"]["free run"]["slide.position"]
    assert document["schema"] == "workbench.comparison/1"
    assert errors["rmse"] < 1e-6 and errors["unit"] == "m"
    assert errors["fit_percent"] > 99.9


def test_compare_writes_each_figure_in_four_files(folder, simulated):
    place = folder / "figures"
    answer = call("compare", folder / "rig.toml", simulated, "--figures", place, "-q")

    assert answer.exit_code == 0, answer.output
    assert answer.stderr == ""
    stems = {path.stem for path in place.iterdir() if path.is_file()}
    kinds = "comparison", "regimes", "error_over_motion", "error_over_command", "residuals"
    assert stems == {f"{kind}_simulated" for kind in kinds}
    for stem in stems:
        assert {p.suffix for p in place.glob(f"{stem}.*")} == {".pdf", ".svg", ".csv", ".txt"}


@pytest.mark.parametrize(
    ("rig", "said"),
    [
        ('plant = "servo_driv"\n', "did you mean 'servo_drive'?"),
        ('plant = "servo_drive"\n[values]\n"slide.mas" = "2 kg"\n', "slide.mass"),
        ('plant = "servo_drive"\n[values]\n"slide.mass" = "2 kN"\n', "kg"),
    ],
)
def test_a_wrong_rig_file_is_refused_and_nothing_is_written(folder, tmp_path, rig, said):
    (tmp_path / "rig.toml").write_text(rig)
    out = tmp_path / "out.csv"

    answer = call("simulate", tmp_path / "rig.toml", folder / "commands.csv", "-o", out)

    assert answer.exit_code == 2
    assert said in answer.stderr and "Traceback" not in answer.output
    assert list(tmp_path.iterdir()) == [tmp_path / "rig.toml"]


def test_all_that_is_wrong_with_several_recordings_is_said_at_once(folder, tmp_path):
    for name in ("one.csv", "two.csv"):
        (tmp_path / name).write_text("time,valve.command\ns,V\n0,5\n0,5\n0,5\n")

    answer = call("compare", folder / "rig.toml", tmp_path / "one.csv", tmp_path / "two.csv")

    assert answer.exit_code == 2
    assert "one.csv" in answer.stderr and "two.csv" in answer.stderr


@pytest.mark.parametrize("command", ["simulate", "design", "fit", "add"])
def test_a_folder_as_the_file_to_write_is_refused_before_any_work(folder, tmp_path, command):
    words = {
        "simulate": [folder / "commands.csv"],
        "design": ["--controller", "lq"],
        "fit": [folder / "commands.csv"],
        "add": ["valve_lag", "--fit", folder / "commands.csv"],
    }[command]

    answer = call(command, folder / "rig.toml", *words, "-o", tmp_path)

    assert answer.exit_code == 2
    assert "is a folder" in answer.stderr


def test_a_file_that_is_not_there_is_named(folder):
    answer = call("compare", folder / "rig.toml", folder / "nowhere.csv")

    assert answer.exit_code == 2
    assert "nowhere.csv" in answer.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["chamber_leak"], "chamber_leak: needs its place; expected --at with one of chamber_a, "),
        (
            ["chamber_leak", "--at", "chambr_a"],
            "chamber_leak@chambr_a: there is no such place; expected --at with one of chamber_a, "
            "chamber_b; did you mean 'chamber_a'?",
        ),
        (["chamber_lek", "--at", "chamber_a"], "did you mean 'chamber_leak@chamber_a'?"),
    ],
)
def test_an_effect_to_add_needs_a_known_name_and_place(folder, simulated, tmp_path, words, said):
    out = tmp_path / "rig2.toml"

    answer = call("add", folder / "rig.toml", *words, "--fit", simulated, "-o", out)

    assert answer.exit_code == 2
    assert said in answer.stderr
    assert not out.exists()


def test_an_unknown_parameter_to_fit_gets_the_nearest_name(folder, simulated, tmp_path):
    words = ("--only", "slide.mas", "-o", tmp_path / "rig2.toml")

    answer = call("fit", folder / "rig.toml", simulated, *words)

    assert answer.exit_code == 2
    assert "did you mean 'slide.mass'?" in answer.stderr


def test_modes_are_printed_and_exported(folder, tmp_path):
    from scipy.io import loadmat

    out = tmp_path / "modes.json"
    place = tmp_path / "modes"
    answer = call("modes", folder / "rig.toml", "--json", out, "--export", place, "-q")

    assert answer.exit_code == 0, answer.output
    assert "left out of the modes" in answer.stdout
    document = json.loads(out.read_text())
    assert len(document["modes"]) == 27
    found = loadmat(place / "modes.mat", simplify_cells=True)["modes"]
    assert np.array_equal(found[0]["A"], np.array(document["modes"][0]["A"]))
    arrays = np.load(place / "modes.npz")
    assert arrays["name"].tolist() == [mode["name"] for mode in document["modes"]]
    assert np.array_equal(arrays["B_26"], np.array(document["modes"][26]["B"]))
    drawn = {path.name for path in place.glob("*.pdf")}
    assert drawn == {"poles.pdf", "mode_poles.pdf", "mode_map.pdf", "step.pdf"}
    assert document["modes"][0]["validity"]["horizon_s"] == 0.05
    assert "half-widths of boxes in which a mode errs less than 0.05" in answer.stdout


def test_a_design_is_written_and_checked_and_the_answer_is_the_exit_code(folder, tmp_path):
    rig, design, out = folder / "rig.toml", tmp_path / "lq.toml", tmp_path / "check.json"
    assert call("design", rig, "--controller", "lq", "-o", design).exit_code == 0

    answer = call("check", rig, design, "--scenario", "step", "--json", out)

    (run,) = json.loads(out.read_text())["runs"]
    assert answer.exit_code == (0 if run["reached"] else 1), answer.output
    assert run["design"] == "lq" and run["final_error_m"] < 1e-3


def test_an_unknown_controller_is_refused(folder, tmp_path):
    answer = call("design", folder / "rig.toml", "--controller", "lqr", "-o", tmp_path / "x.toml")

    assert answer.exit_code == 2
    assert "no controller lqr" in answer.stderr
    assert not list(tmp_path.iterdir())


def test_options_take_several_values_in_a_row_behind_the_arguments():
    several = {"--validate"}

    assert spread(["rig", "a", "--validate", "b", "c", "-o", "d"], several) == [
        "rig", "a", "--validate", "b", "--validate", "c", "-o", "d",
    ]  # fmt: skip
    assert spread(["--validate", "b", "rig", "a"], several) == ["--validate", "b", "rig", "a"]
    assert spread(["rig", "a", "--validate=b", "c", "-o", "d"], several) == [
        "rig", "a", "--validate=b", "--validate", "c", "-o", "d",
    ]  # fmt: skip


def test_a_flag_that_stands_first_swallows_nothing_and_hinders_no_list():
    """``-q`` has no value: what follows it is the first argument."""
    several, flags = {"--validate"}, {"-q", "--quiet"}

    assert spread(["-q", "rig", "a", "--validate", "b", "c"], several, flags) == [
        "-q", "rig", "a", "--validate", "b", "--validate", "c",
    ]  # fmt: skip
    assert spread(["-q", "-o", "d", "rig", "--validate", "b", "c"], several, flags)[-1] == "c"
