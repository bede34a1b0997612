"""Modes stand for the plant near their point, cover its range, and leave out what they say."""

import json

import numpy as np
import pytest

from linearize.analysis import analyse, analyse_all, prediction_error
from linearize.discrete import sampled
from linearize.equilibrium import operating_point
from linearize.listing import document, left_out, table
from linearize.modes import Interval, Mode
from linearize.reduction import design_model
from linearize.standard import COMMAND, POSITION, PRESSURES, VELOCITY, standard_modes
from workbench.effects import DeadZone
from workbench.plants import PLANTS
from workbench.plants.servo_drive import servo_drive


@pytest.fixture(scope="module")
def plant():
    return servo_drive()


@pytest.fixture(scope="module")
def hybrid(plant):
    return standard_modes(plant)


@pytest.mark.parametrize(
    ("command_v", "speed_m_s", "slow", "real", "swing"),
    [
        (5.6, 0.32, -2.9, -12.6, 37.0),
        (6.0, 0.85, -6.3, -16.4, 36.0),
        (7.0, 2.0, -11.2, -26.6, 29.0),
    ],
)
def test_steady_sliding_has_the_speed_and_the_poles_of_the_reference(
    plant, command_v, speed_m_s, slow, real, swing
):
    """physics.md 4.3, mid stroke; one or two units in its last digit are left to rounding."""
    dead_zone = next(e for e in plant.effects if isinstance(e, DeadZone))
    model = design_model(plant)
    opened_v = float(dead_zone.alter(COMMAND, command_v, None))
    found = (VELOCITY, *PRESSURES)

    point = operating_point(model, {COMMAND: opened_v, VELOCITY: 0.3}, found, found)
    poles = np.linalg.eigvals(model.jacobians(point.state, point.command)[0].full())
    pair = poles[np.argmax(poles.imag)]
    single = np.sort(poles[np.abs(poles.imag) < 1e-6].real)

    assert point.state[1] == pytest.approx(speed_m_s, rel=0.03)
    assert pair == pytest.approx(real + 1j * swing, rel=0.02)
    assert single == pytest.approx([slow, 0.0], rel=0.07, abs=1e-6)


def test_every_combination_of_valve_friction_and_place_is_a_mode(hybrid):
    assert len({mode.name for mode in hybrid.modes}) == 27


def test_exactly_one_mode_holds_anywhere(hybrid):
    rng = np.random.default_rng(1)
    for _ in range(50):
        signals = {
            COMMAND: rng.uniform(0.0, 10.0),
            VELOCITY: rng.choice([-0.2, 0.0, 0.2]),
            POSITION: rng.uniform(0.0, 0.29),
        }

        assert [mode.holds(signals) for mode in hybrid.modes].count(True) == 1


def test_outside_all_modes_is_an_error_that_says_where(hybrid):
    with pytest.raises(LookupError, match=r"no mode of servo_drive covers .*nan"):
        hybrid.active({COMMAND: 6.0, VELOCITY: 0.1, POSITION: np.nan})


def test_an_unknown_mode_is_an_error_that_names_those_there_are(hybrid):
    with pytest.raises(KeyError, match="no mode 'fast'; it has charge b slide - near a"):
        hybrid["fast"]


def test_a_plant_without_standard_modes_is_an_error_that_says_so():
    with pytest.raises(KeyError, match="no standard modes for cylinder_bench"):
        standard_modes(PLANTS["cylinder_bench"]())


def test_a_mode_has_no_pole_of_dry_friction(hybrid):
    for mode in hybrid.modes:
        assert np.abs(np.linalg.eigvals(mode.A)).max() < 100.0, mode.name


def test_a_sticking_mode_keeps_the_pressures_alone(hybrid):
    assert hybrid["closed stick middle"].state_names == PRESSURES


def test_the_drift_of_a_sliding_mode_against_the_valve_says_how_it_brakes(hybrid):
    mode = hybrid["charge b slide + middle"]

    assert np.abs(mode.drift).max() > 0.0
    assert mode.rates(mode.state, mode.command) == pytest.approx(mode.drift)


def test_driven_sliding_modes_are_controllable_and_observable(hybrid):
    for report in analyse_all(hybrid):
        if "slide" in report.name and "closed" not in report.name:
            assert (report.controllable, report.observable) == (4, 4), report.name


def test_the_pneumatic_spring_swings_at_six_hertz(hybrid):
    """physics.md 2.4: 39 rad/s at mid stroke."""
    report = analyse(hybrid["charge a slide + middle"])

    assert report.frequency_hz == pytest.approx(6.2, abs=0.2)
    assert 0.2 < report.damping < 0.4


def test_a_mode_predicts_the_full_plant_for_a_tenth_of_a_second(hybrid):
    mode = hybrid["charge a slide + middle"]

    errors = prediction_error(hybrid.model, mode, [0.02], horizon_s=0.1)

    assert errors[0] < 0.1e-3
    assert errors[2:].max() < 500.0


def test_the_reduction_is_a_written_list(plant):
    left_out = {item.what for item in design_model(plant).left_out}

    assert left_out == {
        "chamber_a.mass_kg",
        "chamber_b.mass_kg",
        "valve_dead_zone",
        "friction bristle",
    }


def test_a_reduced_state_expands_to_gas_at_supply_temperature(plant):
    model = design_model(plant)
    full = model.full(model.initial).full().ravel()

    assert full == pytest.approx(model.plant.initial)


def test_a_point_without_solution_is_an_error(plant):
    with pytest.raises(ValueError, match="servo_drive: no operating point at "):
        operating_point(design_model(plant), {VELOCITY: 9.0}, (COMMAND,), (VELOCITY,))


def test_free_values_and_vanishing_rates_must_be_as_many(plant):
    with pytest.raises(ValueError, match="1 free values for 0 rates"):
        operating_point(design_model(plant), {}, (COMMAND,))


def test_sampling_a_double_integrator_with_drift_is_exact():
    """x1 = x + v h + (u + g) h^2/2, v1 = v + (u + g) h."""
    box = {"x": Interval("all", -1.0, 1.0, 0.0)}
    A, B, drift = (
        np.array([[0.0, 1.0], [0.0, 0.0]]),
        np.array([[0.0], [1.0]]),
        np.array([0.0, -9.81]),
    )
    mode = Mode("free", box, ("x", "v"), ("u",), ("x",), A, B, np.eye(1, 2), np.zeros((1, 1)),
                np.zeros(2), np.zeros(1), np.zeros(1), drift, np.array([0.1, 3.0]))  # fmt: skip
    h = 0.1

    found = sampled(mode, h)

    assert pytest.approx(np.array([[1.0, h], [0.0, 1.0]])) == found.F
    assert found.G.ravel() == pytest.approx([h**2 / 2, h])
    assert found.offset == pytest.approx([-9.81 * h**2 / 2, -9.81 * h])


def test_python_control_gets_named_signals(hybrid):
    system = hybrid["charge a slide + middle"].system

    assert system.state_labels[0] == "slide:position_m"
    assert pytest.approx(hybrid["charge a slide + middle"].A) == system.A


def test_the_table_has_one_line_per_mode_and_the_document_is_plain_numbers(hybrid):
    lines = table(hybrid).splitlines()
    entries = json.loads(json.dumps(document(hybrid)))

    assert len(lines) == 28
    assert entries[0]["A"] == hybrid.modes[0].A.tolist()
    assert "undone in the command" in left_out(hybrid)
