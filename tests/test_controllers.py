"""What every controller must do, and what ours must equal where the answer is known."""

import numpy as np
import pytest
from slide_controllers import SLIDE_CONTROLLERS

from controllers.design_file import design, read_design, write_design
from controllers.lq import dlqr
from controllers.positioning import STATES
from linearize.standard import standard_modes
from workbench.contracts import Estimate
from workbench.effects import DeadZone, ValveOffset
from workbench.errors import InputError
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import COMMAND, servo_drive
from workbench.plants.vertical_cylinder import vertical_cylinder

everyone = pytest.mark.parametrize("name", SLIDE_CONTROLLERS)
REST = np.array([0.145, 0.0, 5.65e5, 5.65e5])


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


@pytest.fixture(scope="module")
def controllers(hybrid):
    return {name: m.design(hybrid, m.spec()) for name, m in SLIDE_CONTROLLERS.items()}


def seen(state):
    return Estimate(STATES, np.array(state, dtype=float), np.eye(4))


def held(controller, position_m):
    """A reference that stays."""
    return np.full((1, controller.preview), position_m)


@everyone
def test_a_controller_gives_the_same_answer_twice(controllers, name):
    controller = controllers[name]
    first, again = (
        controller.step(controller.start(), held(controller, 0.2), seen(REST)) for _ in range(2)
    )

    assert np.array_equal(first.value, again.value)
    assert first.memory.integral_m_s == again.memory.integral_m_s


@everyone
@pytest.mark.parametrize("position_m", [0.0, 0.29])
def test_a_controller_keeps_its_limits_and_does_not_wind_up(controllers, name, position_m):
    controller, command = controllers[name], controllers[name].start()
    moving = seen([0.145, 0.3 if position_m < 0.1 else -0.3, 5.65e5, 5.65e5])
    for _ in range(300):
        command = controller.step(command, held(controller, position_m), moving)

        assert 0.0 <= command.value[0] <= 10.0
    assert command.memory.integral_m_s == 0.0


@everyone
def test_a_controller_opens_the_valve_towards_the_target(controllers, name):
    controller = controllers[name]
    for position_m, side in ((0.2, 1.0), (0.09, -1.0)):
        command = controller.step(controller.start(), held(controller, position_m), seen(REST))

        assert side * (command.value[0] - 4.95) > 0.42


@everyone
def test_a_controller_shuts_the_valve_at_rest_on_target_and_freezes_its_integral(controllers, name):
    controller = controllers[name]
    command = controller.step(controller.start(), held(controller, 0.14502), seen(REST))

    assert command.value == pytest.approx([4.95])
    assert command.memory.resting
    assert command.memory.integral_m_s == 0.0


@everyone
def test_a_resting_controller_wakes_when_the_error_leaves_the_wider_band(controllers, name):
    controller = controllers[name]
    resting = controller.step(controller.start(), held(controller, 0.14502), seen(REST))
    awake = controller.step(resting, held(controller, 0.1455), seen(REST))

    assert not awake.memory.resting


@everyone
def test_a_design_file_builds_the_same_controller_again(tmp_path, name):
    plant = servo_drive().without("end_cushion").with_values({"slide.mass_kg": 2.4})
    path = tmp_path / "design.toml"
    wanted = design(name, plant, {"positioning": {"band_m": 4e-5}})

    write_design(wanted, path)
    found = read_design(path)

    assert (found.method, found.plant, found.spec) == (name, plant, wanted.spec)
    for one in (wanted.controller, found.controller):
        command = one.step(one.start(), held(one, 0.2), seen(REST))
        assert command.value == pytest.approx(
            wanted.controller.step(one.start(), held(one, 0.2), seen(REST)).value
        )


def test_a_design_file_of_before_the_later_numbers_still_builds_its_controller(tmp_path):
    later = ("hardest_m_s2", "sharpest_m_s3", "standing_per_s")
    path = tmp_path / "design.toml"
    write_design(design("lq", servo_drive(), {"positioning": {"band_m": 4e-5}}), path)
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(line for line in lines if not line.startswith(later)) + "\n")

    assert read_design(path).spec.positioning.band_m == 4e-5
    assert read_design(path).spec.positioning.standing_per_s == 50.0


def test_a_wrong_number_in_a_design_is_an_error_that_names_it():
    with pytest.raises(InputError, match=r"lq.positon_m: .*did you mean 'position_m'\?"):
        design("lq", servo_drive(), {"positon_m": 1e-3})
    with pytest.raises(InputError, match=r"lq\.position_m: is 'far'; expected a number from 1e-06"):
        design("lq", servo_drive(), {"position_m": "far"})
    with pytest.raises(KeyError, match="no controller lqg; there is pid, lq, mpc, cascade, hybrid"):
        design("lqg", servo_drive())


def test_an_incomplete_design_file_is_an_error(tmp_path):
    path = tmp_path / "design.toml"
    path.write_text('controller = "lq"\n', encoding="utf-8")

    with pytest.raises(InputError, match=r"design\.toml: plant: is missing; expected a table"):
        read_design(path)


def test_the_regulator_of_a_double_integrator_is_the_analytic_one():
    """Continuous LQR of 1/s^2 with Q = I, R = 1 has K = (1, sqrt 3); fast sampling tends to it."""
    h = 1e-4
    F, G = np.array([[1.0, h], [0.0, 1.0]]), np.array([[h**2 / 2], [h]])

    K = dlqr(F, G, np.eye(2) * h, np.eye(1) * h, np.array([1.0, 3.0]))

    assert pytest.approx([1.0, 3.0**0.5], rel=1e-3) == K[0]


def test_every_lq_design_is_stable_in_its_mode(controllers):
    schedule = controllers["lq"].gains
    for gain in (*schedule.forward, *schedule.backward):
        assert gain.poles.real.max() < 0.0


def test_every_pid_design_is_stable_in_its_mode(controllers):
    schedule = controllers["pid"].gains
    for gain in (*schedule.forward, *schedule.backward):
        assert gain.poles.real.max() < 0.0


def test_the_dead_zone_is_undone_outside_a_narrow_zone_of_transition(controllers):
    valve = controllers["lq"].task.valve
    plant = servo_drive()
    dead_zone = next(e for e in plant.effects if isinstance(e, DeadZone))
    for opening_v in (-2.0, -0.1, 0.1, 2.0):
        through = float(dead_zone.alter(COMMAND, float(valve.command(opening_v)[0]), None))

        assert through - 4.95 == pytest.approx(opening_v, abs=1e-6)
    assert valve.command(0.0) == pytest.approx([4.95])


def test_an_offset_of_the_valve_shifts_its_closed_command():
    plant = servo_drive().with_values({"valve_offset.offset_v": 0.2})
    found = design("lq", plant).controller.task.valve
    offset = next(e for e in plant.effects if isinstance(e, ValveOffset))
    dead_zone = next(e for e in plant.effects if isinstance(e, DeadZone))
    arrived = float(dead_zone.alter(COMMAND, found.command(0.5)[0] - offset.offset_v, None))

    assert found.shut == pytest.approx([5.15])
    assert arrived == pytest.approx(4.95 + 0.5, abs=1e-6)


@pytest.mark.parametrize(
    ("plant", "offered"),
    [
        (vertical_cylinder(), "no controller is for vertical_cylinder, only for servo_drive, crr"),
        (gearbox(), "controllers for gearbox: hybrid-mpc"),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_a_method_that_is_not_for_a_plant_is_refused_with_what_there_is_for_it(plant, offered):
    with pytest.raises(InputError, match=f"position a slide with for {plant.name}; .*{offered}"):
        design("pid", plant)
