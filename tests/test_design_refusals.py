"""`design` where a number or the supply leads nowhere: the cause by name, and no file."""

import pytest
from commands import call

from linearize.equilibrium import NoOperatingPointError
from linearize.standard import SLIDE_MODES, slide_modes
from workbench.errors import InputError, Message
from workbench.plants.servo_drive import servo_drive


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    path = tmp_path_factory.mktemp("rigs") / "rig.toml"
    path.write_text('plant = "servo_drive"\n')
    return path


@pytest.mark.parametrize(
    ("method", "numbers", "said"),
    [
        (
            "lq",
            "sample_time_s = 0.0015",
            "spec.toml:2: lq.sample_time_s: is 0.0015; expected a multiple of the 0.001 s at which "
            "servo_drive is simulated, as 0.001 or 0.002",
        ),
        (
            "lq",
            "opening_v = 1e-30",
            "spec.toml:2: lq.opening_v: is 1e-30, farthest of all numbers from usual",
        ),
        (
            "lq",
            "position_m = 1e-12",
            "spec.toml:2: lq.position_m: is 1e-12; expected a number from 1e-06",
        ),
        ("axis-lq", "position = 1e-12", "axis-lq.position: is 1e-12; expected a number from 1e-05"),
        ("lq", "position_m = 1e30\nsample_time_s = 0.05", "a number nearer to the usual 0.0015"),
        ("mpc", "position_m = 1e30", "mpc.position_m: is 1e+30, farthest of all numbers"),
    ],
)
def test_no_design_is_written_where_a_number_leads_nowhere(rig, tmp_path, method, numbers, said):
    spec = tmp_path / "spec.toml"
    spec.write_text(f"[{method}]\n{numbers}\n")
    answer = call(
        "design", rig, "--controller", method, "--spec", spec,
        "-o", tmp_path / "design.toml", "-q",
    )  # fmt: skip

    assert answer.exit_code == 2
    assert said in answer.stderr and len(answer.stderr.splitlines()) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["spec.toml"]


ONE = 'limits = {"slide.position" = "1 mm"}'
LATE = '[limits]\nslide.velocity = "1 m/s"\nslide.position = ["289 mm", "300 mm"]'
FAINT = '[limits]\nchamber_a.pressure = "1 bar"'
APART = '[limits]\nchamber_a.pressure = ["4 bar", "5 bar"]\nchamber_b.pressure = ["2 bar", "3 bar"]'
HIGH = '[limits]\nchamber_a.pressure = ["8 bar", "9 bar"]'


@pytest.mark.parametrize(
    ("method", "limits", "said"),
    [
        ("mpc", ONE, "spec.toml:1: limits.slide.position: 0 to 1 mm leaves mpc no room; expected "
         "some of it above 2 mm, the least that mpc keeps"),
        ("mpc", LATE, "spec.toml:3: limits.slide.position: 289 to 300 mm leaves mpc no room; "
         "expected some of it below 288 mm, the most that mpc keeps"),
        ("nonlinear-mpc", FAINT, "spec.toml:2: limits.chamber_a.pressure: at most 1 bar leaves "
         "nonlinear-mpc no room; expected some of it above 1.2 bar, the least that nonlinear-mpc "
         "keeps"),
        ("mpc", APART, "spec.toml:3: limits.chamber_b.pressure: 2 to 3 bar leaves mpc no room; "
         "expected some of it above 4 bar, of limits.chamber_a.pressure"),
        ("mpc", HIGH, "spec.toml:2: limits.chamber_a.pressure: 8 to 9 bar leaves mpc no room; "
         "expected some of it below 7 bar, the most that mpc keeps"),
        ("mpc", "[mpc]\nbelow_supply_pa = 6e5", "spec.toml:1: mpc: lowest_pa 120000, "
         "below_supply_pa 600000 leave no room on servo_drive; expected less than the supply "
         "pressure between them"),
    ],
)  # fmt: skip
def test_limits_that_leave_an_mpc_no_room_are_told_as_they_were_asked_for(
    rig, tmp_path, method, limits, said
):
    spec = tmp_path / "spec.toml"
    spec.write_text(f"{limits}\n")
    made = tmp_path / "design.toml"
    answer = call("design", rig, "--controller", method, "--spec", spec, "-o", made, "-q")

    assert answer.exit_code == 2 and not made.exists()
    assert answer.stderr.removeprefix(f"workbench: {tmp_path}/").strip() == said


def test_fine_weights_are_told_by_their_small_margins_and_not_by_words_of_a_library(rig, tmp_path):
    """scipy's "ill-conditioned matrix" was of coordinates, whose choice proves nothing."""
    spec = tmp_path / "spec.toml"
    spec.write_text("[lq]\nposition_m = 1e-5\n")
    made = tmp_path / "design.toml"
    answer = call("design", rig, "--controller", "lq", "--spec", spec, "-o", made, "-q")

    assert answer.exit_code == 0
    assert "ill-conditioned" not in answer.stderr
    assert "warning: the smallest phase margin is 26.3 deg in mode 'charge b slide - near a'" in (
        answer.stderr
    )


def test_numbers_of_another_method_are_said_not_to_be_used(rig, tmp_path):
    spec = tmp_path / "spec.toml"
    for text, said in (
        ("[cascade]\nbandwidth_hz = 10.0\n", "[cascade] is not for lq, and not used"),
        ("[lq]\nopening_v = 0.3\n", ""),
        ("[lq]\nopening_v = 0.3\n[cascade]\nbandwidth_hz = 10.0\n", ""),  # shared by both
    ):
        spec.write_text(text)
        made = tmp_path / "design.toml"
        answer = call("design", rig, "--controller", "lq", "--spec", spec, "-o", made, "-q")

        assert answer.exit_code == 0
        assert answer.stderr == (f"warning: {spec}: {said}\n" if said else "")


def test_no_design_is_written_where_nothing_can_be_told_of_it(rig, tmp_path, monkeypatch):
    def failing(found, say):
        raise ValueError("Invalid inputs.")

    monkeypatch.setattr("studies.design_report.design_report", failing)
    answer = call("design", rig, "--controller", "lq", "-o", tmp_path / "lq.toml")

    assert answer.exit_code == 2 and not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    ("plant", "enough"), [("servo_drive", "7"), ("crr_rig", "6.5"), ("gearbox", "9")]
)
@pytest.mark.parametrize("command", ["design", "modes"])
def test_a_supply_that_moves_nothing_is_said_to_be_too_low(tmp_path, plant, command, enough):
    """A supply little above ambient pressure: no valve makes anything move steadily."""
    weak = tmp_path / "weak.toml"
    weak.write_text(f'plant = "{plant}"\n[values]\n"supply.pressure" = "1.1 bar"\n')
    method = {"gearbox": "hybrid-mpc", "crr_rig": "axis-lq"}.get(plant, "lq")
    more = ["--controller", method, "-o", tmp_path / "lq.toml"] if command == "design" else []
    answer = call(command, weak, *more, "-q")
    (line,) = answer.stderr.splitlines()

    assert answer.exit_code == 2
    assert line.startswith("workbench: supply.pressure: 1.1 bar is too low to move: ")
    assert line.endswith(f"; expected more, as {enough} bar")


@pytest.mark.parametrize("supply_bar", [1.0, 1.01])
def test_a_supply_at_ambient_pressure_is_refused_in_words_of_the_project(supply_bar):
    plant = servo_drive()
    values = {"supply.pressure_pa": supply_bar * 1e5, "atmosphere.pressure_pa": supply_bar * 1e5}
    with pytest.raises(InputError, match="too low to move: servo_drive: no operating point at "):
        slide_modes(plant.with_values(values))


@pytest.mark.parametrize("plant", ["soft_joint", "servo_reservoir"])
def test_a_vessel_is_not_filled_from_below_the_atmosphere(tmp_path, plant):
    weak = tmp_path / "weak.toml"
    weak.write_text(f'plant = "{plant}"\n[values]\n"supply.pressure" = "0.5 bar"\n')
    answer = call("modes", weak, "-q")
    (line,) = answer.stderr.splitlines()

    assert answer.exit_code == 2
    assert line.startswith("workbench: supply.pressure: 0.5 bar is too low to move: ")
    assert "the supply is not above the atmosphere; expected more, as " in line


def test_a_point_that_is_missing_for_another_reason_is_not_blamed_on_the_supply(monkeypatch):
    def stuck(plant):
        raise NoOperatingPointError("servo_drive: no operating point at all")

    monkeypatch.setitem(SLIDE_MODES, "servo_drive", stuck)
    with pytest.raises(ValueError, match=r"^servo_drive: no operating point at all$"):
        slide_modes(servo_drive().with_values({"supply.pressure_pa": 1.1e5}))


def test_what_else_goes_wrong_below_the_usual_supply_is_not_called_too_low_to_move(monkeypatch):
    """Any error that went with more supply had been rephrased as one of motion."""

    def cut(plant):
        if plant.values["supply.pressure_pa"] < 7e5:
            raise InputError(Message("the point lies outside", "valve_1.flow_kg_s"))

    monkeypatch.setitem(SLIDE_MODES, "servo_drive", cut)
    with pytest.raises(InputError, match=r"^valve_1\.flow_kg_s: the point lies outside$"):
        slide_modes(servo_drive().with_values({"supply.pressure_pa": 5e5}))


@pytest.mark.parametrize(
    ("supply", "code"), [("4.9 bar", 0), pytest.param("4 bar", 2, id="no Low")]
)
def test_a_gearbox_is_designed_where_its_commands_still_lead_everywhere(tmp_path, supply, code):
    """At 4.9 bar all four shifts end in open loop, at 4 bar none leads to Low from everywhere."""
    rig = tmp_path / "rig.toml"
    rig.write_text(f'plant = "gearbox"\n[values]\n"supply.pressure" = "{supply}"\n')
    modes = call("modes", rig, "--no-validity", "-q")
    made = call("design", rig, "--controller", "hybrid-mpc", "-o", tmp_path / "hm.toml", "-q")

    assert modes.exit_code == 0, modes.output
    assert made.exit_code == code and "too low to move" not in made.stderr
    assert ("no commands of gearbox lead to -12 mm" in made.stderr) is (code == 2)
