"""Modes at supplies that differ from a plant's own: operating points are found at each of them."""

import numpy as np
import pytest

from linearize import equilibrium
from linearize.equilibrium import operating_point
from linearize.reduction import design_model
from linearize.rest import rest_of
from linearize.shift_modes import held_at_neutral
from linearize.shift_points import ShiftPoints, shift_points
from linearize.shifting import shift_model
from linearize.standard import standard_modes
from workbench.plants import PLANTS

BAR = 1e5
SLIDING = {
    "crr_rig": ("rod", ("cap.pressure_pa", "rod_side.pressure_pa")),
    "servo_drive": ("slide", ("chamber_a.pressure_pa", "chamber_b.pressure_pa")),
}


@pytest.mark.parametrize("supply_bar", [3.0, 5.0, 7.0, 10.0])
@pytest.mark.parametrize("speed_m_s", [-0.1, 0.0, 0.1])
@pytest.mark.parametrize("plant_name", SLIDING)
def test_a_steady_slide_is_found_at_any_usual_supply(plant_name, speed_m_s, supply_bar):
    """On the rig only its own 6.5 bar had been: elsewhere Newton ran into a spool that is shut."""
    body, pressures = SLIDING[plant_name]
    plant = PLANTS[plant_name]().with_values({"supply.pressure_pa": supply_bar * BAR})
    model = design_model(plant)
    free = ("valve.command_v", *pressures)
    vanish = (f"{body}.velocity_m_s", *pressures)

    found = operating_point(model, {f"{body}.velocity_m_s": speed_m_s}, free, vanish)

    rates = dict(zip(model.states, found.rates / model.scale, strict=True))
    assert max(abs(rates[name]) for name in vanish) < 1e-6
    state = dict(zip(model.states, found.state, strict=True))
    low, high = plant.values["atmosphere.pressure_pa"], supply_bar * BAR
    assert all(low <= state[name] <= high for name in pressures)
    signal = plant.commands[0]
    assert signal.lower <= found.command[0] <= signal.upper
    assert np.sign(found.command[0] - signal.nominal) == np.sign(speed_m_s) or speed_m_s == 0.0


@pytest.mark.parametrize("supply_bar", [2.0, 4.0, 4.9, 5.1, 9.0, 10.0])
def test_the_points_of_a_shift_lie_between_the_air_and_any_supply_that_moves_the_piston(supply_bar):
    """5 bar had been the point of charging at a supply of 4.9 bar too, which was refused for it."""
    plant = PLANTS["gearbox"]().with_values({"supply.pressure_pa": supply_bar * BAR})
    points, modes = shift_points(shift_model(plant)), standard_modes(plant).modes
    air_pa = plant.values["atmosphere.pressure_pa"]

    assert air_pa < points.venting_pa < points.charging_pa < supply_bar * BAR
    for mode in modes[1:]:  # the first one is held at Neutral
        for number, flow in enumerate(mode.command, 1):
            assert flow and (flow > 0.0) == (f"{number} charges" in mode.name)
    assert held_at_neutral(shift_model(plant)).state.tolist() == [points.charging_pa] * 2


@pytest.mark.parametrize("supply_bar", [9.0, 10.0])
def test_at_its_own_supply_and_above_the_points_of_a_shift_are_those_that_were_chosen(supply_bar):
    plant = PLANTS["gearbox"]().with_values({"supply.pressure_pa": supply_bar * BAR})

    for model in map(shift_model, (plant, plant.with_values({"atmosphere.pressure_pa": 0.8e5}))):
        assert shift_points(model) == ShiftPoints(charging_pa=5e5, venting_pa=3e5)


def test_the_points_of_a_shift_go_with_the_supply_that_a_recording_brings():
    """What is measured takes the place of the parameter, which is then of no account."""
    plant = PLANTS["gearbox"]().with_values({"supply.pressure_pa": 4e5})
    recorded = plant.with_measured_input("supply.pressure_pa")

    assert shift_points(shift_model(recorded)) == ShiftPoints()


def test_where_a_mode_rests_is_looked_for_from_its_own_point_alone(monkeypatch):
    """From elsewhere nothing more was found, in 1.7 to 3.5 times the time."""

    def elsewhere(*args):
        pytest.fail("another start was tried")

    hybrid = standard_modes(PLANTS["servo_drive"]())
    monkeypatch.setattr(equilibrium._Search, "elsewhere", elsewhere)
    found = [rest_of(hybrid, mode) for mode in hybrid.modes]

    assert None in found and any(found)


def test_a_speed_that_no_supply_gives_has_no_operating_point():
    body, pressures = SLIDING["crr_rig"]
    model = design_model(PLANTS["crr_rig"]())
    free, vanish = ("valve.command_v", *pressures), (f"{body}.velocity_m_s", *pressures)

    with pytest.raises(ValueError, match=r"no operating point at rod\.velocity_m_s 50"):
        operating_point(model, {f"{body}.velocity_m_s": 50.0}, free, vanish)
