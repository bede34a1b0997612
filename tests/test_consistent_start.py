"""Where runs and filters begin: gas masses follow pressures, and pressures their supply."""

import numpy as np
import pytest

from workbench.filtering import consistent_start
from workbench.plants import closed_chamber, servo_drive

PRESSURES = ("chamber_a.pressure_pa", "chamber_b.pressure_pa")


def at(supply_pa, known=None):
    plant = servo_drive().lean().with_values({"supply.pressure_pa": supply_pa})
    start = consistent_start(plant, known or {})
    return plant, dict(zip(plant.model.states, start, strict=True))


def temperatures(plant, states):
    u, d, p = plant.nominal
    found = plant.model.quantities("chamber_a.temperature_k", "chamber_b.temperature_k")
    return found(np.array([*states.values()]), u, d, p).full().ravel()


def test_no_chamber_begins_above_its_supply():
    low_pa = 2.1e5
    plant, states = at(low_pa)

    assert [states[name] for name in PRESSURES] == [low_pa, low_pa]
    assert temperatures(plant, states) == pytest.approx([293.15, 293.15])


def test_below_the_supply_a_chamber_begins_at_rest_as_the_plant_has_it():
    plant, states = at(7e5)

    np.testing.assert_array_equal([*states.values()], plant.initial)


def test_what_is_known_is_kept_also_above_the_supply():
    """A recording may begin while the supply droops."""
    plant, states = at(2.1e5, {PRESSURES[0]: 3e5, "slide.position_m": 0.1, PRESSURES[1]: np.nan})

    assert [states[name] for name in PRESSURES] == [3e5, 2.1e5]
    assert states["slide.position_m"] == 0.1
    assert temperatures(plant, states) == pytest.approx([293.15, 293.15])


def test_a_plant_without_a_supply_begins_as_it_is():
    plant = closed_chamber().lean()

    np.testing.assert_array_equal(consistent_start(plant, {}), plant.initial)
