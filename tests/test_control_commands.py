"""`design` and `check`: what they refuse, what they warn of, and what the answer depends on."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from commands import call
from slide_controllers import SLIDE_CONTROLLERS

from controllers.design_file import read_design
from controllers.mpc_limits import state_limits
from controllers.mpc_spec import MpcSpec
from linearize.axes import stroke_m
from linearize.standard import SLIDE_MODES
from studies.checking import Loops, differences
from studies.closed_loop_check import Check
from studies.closed_loop_metrics import (
    LOST_SHARE,
    Metrics,
    air_used_kg,
    rise_s,
    table,
    valve_switches,
)
from studies.documents import check_document
from workbench.plants import PLANTS
from workbench.recording import Recording

PLANT = PLANTS["servo_drive"]()


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Rig files of several plants, and a design for the servo drive in a folder of its own."""
    folder = tmp_path_factory.mktemp("control")
    for plant in PLANTS:
        (folder / f"{plant}.toml").write_text(f'plant = "{plant}"\n')
    answer = call(
        "design", folder / "servo_drive.toml", "--controller", "pid",
        "-o", folder / "new" / "folder" / "pid.toml",
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    return folder


def row(scenario, error_m, cycle_m, rmse_m, amplitude_m):
    """Metrics of a run with these errors."""
    rest = dict.fromkeys(
        ("rise_s", "overshoot_m", "settling_s", "air_kg", "activity_v", "switches", "violation_s",
         "solve_median_s", "solve_p99_s", "estimate_median_s"), 0.0,
    )  # fmt: skip
    errors = {"final_error_m": error_m, "limit_cycle_m": cycle_m, "rmse_m": rmse_m}
    return Metrics("lq", "ekf", scenario, **errors, amplitude_m=amplitude_m, **rest)


NONE = float("nan")
GOOD, FAR = row("step", 1e-4, 1e-5, 2e-2, NONE), row("step", 5e-4, 1e-5, 2e-2, NONE)
RECORD = SimpleNamespace(recording=Recording("step", 1e-3, {"slide.position_m": np.zeros(3)}))
FOLLOWED = row("sine", NONE, NONE, 3e-4, 0.08)
LOST = replace(FOLLOWED, rmse_m=1.1 * LOST_SHARE * 0.08)


def test_a_design_goes_into_a_folder_that_is_made_for_it(place):
    assert [path.name for path in (place / "new" / "folder").iterdir()] == ["pid.toml"]


@pytest.mark.parametrize("plant", ["vertical_cylinder", "cylinder_bench"])
def test_a_plant_without_standard_modes_is_refused_in_one_line(place, plant):
    answer = call("check", place / f"{plant}.toml", place / "new" / "folder" / "pid.toml")

    assert answer.exit_code == 2
    assert f"{plant} has no standard modes" in answer.stderr
    assert len(answer.stderr.splitlines()) == 1


@pytest.mark.parametrize("method", SLIDE_CONTROLLERS)
def test_no_design_is_written_for_a_mode_that_its_command_cannot_steer(
    place, monkeypatch, tmp_path, method
):
    whole = SLIDE_MODES["servo_drive"]

    def deaf(plant):
        hybrid = whole(plant)
        return replace(hybrid, modes=tuple(replace(m, B=0.0 * m.B) for m in hybrid.modes))

    monkeypatch.setitem(SLIDE_MODES, "servo_drive", deaf)
    written = tmp_path / "design.toml"
    answer = call("design", place / "servo_drive.toml", "--controller", method, "-o", written, "-q")
    (line,) = answer.stderr.splitlines()

    assert answer.exit_code == 2
    assert "mode 'charge a slide + near a': not controllable: its commands reach 0 of 4" in line
    assert "expected a mode in which valve.command_v can steer slide.position_m" in line
    assert not written.exists()


def test_a_design_for_another_plant_is_refused(place, monkeypatch):
    from studies import checking

    found = read_design(place / "new" / "folder" / "pid.toml")
    other = replace(found, plant=replace(found.plant, name="crr_rig"))
    monkeypatch.setattr(checking, "parse_design", lambda text, path: other)

    answer = call("check", place / "servo_drive.toml", place / "new" / "folder" / "pid.toml")

    assert answer.exit_code == 2
    assert "is a design for crr_rig; expected one for servo_drive" in answer.stderr


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        (
            "positioning = 3",
            "spec.toml:2: mpc.positioning: 3 is no table; expected a table of some",
        ),
        ("horizon = 0", "spec.toml:2: mpc.horizon: is 0; expected a whole number from 1 to 500"),
        ("horizon = 2.5", "mpc.horizon: is 2.5; expected a whole number"),
        ("opening_v = nan", "mpc.opening_v: is nan; expected a number above 0"),
        ("sample_time_s = -1", "mpc.sample_time_s: is -1; expected a number from 0.0001 to"),
        ("sample_time_s = 50", "mpc.sample_time_s: is 50; expected a number from 0.0001 to 0.05"),
        ("[mpc.positioning]\nstribeck_share = 2", "expected a number from 0 to 1"),
        ("positon_m = 1", "did you mean 'position_m'?"),
        ("band_m = 1e-4", "did you mean 'positioning.band_m'?"),
        ("below_supply_pa = 6e5", "leave no room on servo_drive"),
    ],
)
def test_a_number_that_makes_no_sense_is_named_with_what_was_expected(place, tmp_path, spec, said):
    path = tmp_path / "spec.toml"
    path.write_text(f"[mpc]\n{spec}\n")

    answer = call(
        "design", place / "servo_drive.toml", "--controller", "mpc", "--spec", path,
        "-o", tmp_path / "mpc.toml",
    )  # fmt: skip

    assert answer.exit_code == 2
    assert said in answer.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["spec.toml"]


def test_only_a_reference_that_ends_at_rest_has_a_goal_and_any_can_be_lost():
    assert [each.reached for each in (GOOD, FAR, FOLLOWED, LOST)] == [True, False, None, False]

    document = check_document("drive", Check((GOOD, FOLLOWED), ()))
    assert [run["reached"] for run in document["runs"]] == [True, None]
    lines = table((GOOD, FAR, FOLLOWED)).splitlines()
    assert [line.split()[3] for line in lines] == ["reached", "yes", "no", "-"]


def test_long_steps_of_a_controller_and_steps_that_never_settle_are_told_in_plain_numbers():
    slow = replace(GOOD, settling_s=float("inf"), solve_median_s=38.43e-3, solve_p99_s=74e-3)
    head, line = table([slow]).splitlines()

    assert "ctrl ms" in head and "p99 ms" in head and "est ms" in head
    assert line.split()[6] == "never" and line.split()[-3:-1] == ["38.43", "74"]
    assert "e+" not in line and "inf" not in line


def test_a_diverged_run_has_not_reached_anything():
    assert row("step", NONE, NONE, NONE, NONE).reached is False
    assert replace(FOLLOWED, rmse_m=NONE).reached is False


@pytest.mark.parametrize(
    ("rows", "code"), [((GOOD, FOLLOWED), 0), ((FAR, FOLLOWED), 1), ((GOOD, LOST), 1)]
)
def test_the_exit_code_depends_on_rows_with_a_goal(place, monkeypatch, rows, code):
    by_name = {each.scenario: Check((each,), (RECORD,)) for each in rows}
    monkeypatch.setattr(Loops, "once", lambda loops, *_: by_name[loops.scenarios[0]])

    answer = call("check", place / "servo_drive.toml", place / "new" / "folder" / "pid.toml")

    assert answer.exit_code == code, answer.output


def test_other_values_than_those_of_the_design_are_named_five_of_them():
    changed = {name: 1.01 * value for name, value in PLANT.values.items() if value > 0.0}
    few = dict([*changed.items()][:2])

    assert differences(PLANT, PLANT) == []
    assert len(differences(PLANT, PLANT.with_values(few))) == 2
    assert "slide.mass 2.22 kg (here 2.3 kg)" in differences(
        PLANT, PLANT.with_values({"slide.mass_kg": 2.3})
    )


def test_a_check_warns_once_of_a_design_for_other_values(place, monkeypatch, tmp_path):
    values = [
        '"slide.mass" = "2.3 kg"', '"supply.pressure" = "6.5 bar"',
        '"friction.viscous" = "50 N s/m"', '"chamber_a.dead_volume" = "40 cm^3"',
        '"chamber_b.dead_volume" = "40 cm^3"', '"friction.coulomb_force" = "20 N"',
    ]  # fmt: skip
    rig = tmp_path / "rig.toml"
    rig.write_text('plant = "servo_drive"\n[values]\n' + "\n".join(values) + "\n")
    monkeypatch.setattr(Loops, "once", lambda *_: Check((GOOD,), (RECORD,)))

    answer = call("check", rig, place / "new" / "folder" / "pid.toml", "-q")

    assert answer.exit_code == 0, answer.output
    assert len(answer.stderr.splitlines()) == 1
    assert "pid.toml: designed for other values than those of rig: " in answer.stderr
    assert "and 1 more" in answer.stderr


def test_limits_of_the_pressures_follow_the_supply():
    low = PLANT.with_values({"supply.pressure_pa": 5e5})

    assert state_limits(PLANT, MpcSpec())[1].tolist() == [stroke_m(PLANT) - 2e-3, 2.0, 6.9e5, 6.9e5]
    assert state_limits(low, MpcSpec())[1, 2:].tolist() == [4.9e5, 4.9e5]


def test_each_end_of_the_position_has_its_own_limit_outside_the_margin():
    both = state_limits(PLANT, MpcSpec(lowest_m=0.05, below_end_m=0.1))[:, 0]
    none = state_limits(PLANT, MpcSpec(margin_m=0.06, lowest_m=0.05))[:, 0]

    assert both.tolist() == [0.05, stroke_m(PLANT) - 0.1]
    assert none.tolist() == [0.06, stroke_m(PLANT) - 0.06]


def test_time_outside_the_limits_is_counted_against_the_own_supply():
    from studies.closed_loop_metrics import _violation_s
    from workbench.closed_loop import LoopRecord
    from workbench.recording import Recording

    n = 10
    channels = {
        "slide.position_m": np.full(n, 0.1),
        "chamber_a.pressure_pa": np.full(n, 6e5),
        "chamber_b.pressure_pa": np.full(n, 6e5),
    }
    none = np.zeros((0, n))
    record = LoopRecord(Recording("run", 1e-3, channels), none, {}, none, none, {})

    assert _violation_s(PLANT, record) == 0.0
    assert _violation_s(PLANT.with_values({"supply.pressure_pa": 6e5}), record) == n * 1e-3


def test_a_sample_on_a_limit_is_no_time_outside_of_it():
    """A position that is on its limit but for the last digit."""
    from studies.closed_loop_metrics import _violation_s
    from studies.specification import Limit
    from workbench.closed_loop import LoopRecord
    from workbench.recording import Recording
    from workbench.units import Scale

    names = ("slide.position_m", "chamber_a.pressure_pa", "chamber_b.pressure_pa")
    values = (np.full(10, value) for value in (0.1, 6e5, 6e5))
    none = np.zeros((0, 10))
    channels = dict(zip(names, values, strict=True))
    record = LoopRecord(Recording("run", 1e-3, channels), none, {}, none, none, {})
    on, beyond = (
        Limit("limits.x", names[0], 0.0, 0.1 * (1.0 - off), (), "m", Scale())
        for off in (1e-15, 1e-8)
    )

    assert on.most < 0.1 and _violation_s(PLANT, record, [on]) == 0.0
    assert _violation_s(PLANT, record, [on, beyond]) == 1e-2


def test_a_proportional_valve_switches_when_it_goes_over_its_dead_zone():
    centre = 4.95
    beyond = np.array([0.0, 0.3, 0.5, 0.4, 0.5, -0.4, -0.5, 0.0, -0.6, 0.6])

    assert valve_switches(PLANT, centre + beyond) == 2.0
    assert valve_switches(PLANT, np.full(5, centre)) == 0.0


def test_air_is_taken_by_commands_as_they_arrive():
    """With 20 ms under way a step of the bench was told 0.93 g where 0.79 were taken."""
    from workbench.closed_loop import LoopRecord

    soon, late = (
        PLANT.with_values({"command_delay.delay_s": delay_s}).lean() for delay_s in (0.0, 20e-3)
    )
    emptied, opened = np.where(np.arange(100) < 50, 1.0, 0.5), np.full(100, 4.95)
    opened[30:60] += 2.0

    def taken_kg(plant, command_v):
        states = zip(plant.model.states, plant.initial, strict=True)
        channels = {name: np.full(100, value) for name, value in states}
        channels["chamber_a.pressure_pa"] = 6e5 * emptied
        channels["valve.command_v"] = command_v
        none = np.zeros((0, 100))
        record = LoopRecord(Recording("run", 1e-3, channels), none, {}, none, none, {})
        return air_used_kg(plant, record)

    assert taken_kg(late, opened) == pytest.approx(taken_kg(soon, np.roll(opened, 20)))
    assert taken_kg(late, opened) > 1.1 * taken_kg(soon, opened)


def test_a_rise_is_from_a_tenth_to_nine_tenths_and_nothing_where_it_never_gets_there():
    share = np.linspace(0.0, 1.0, 1001)

    assert rise_s(share, 1e-3) == pytest.approx(0.8, abs=1.5e-3)
    assert np.isnan(rise_s(0.85 * share, 1e-3))
