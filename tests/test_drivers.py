"""What a missing term is looked at against: pressures together and flows, each only once."""

import numpy as np
import pytest

from workbench.diagnosis.dependence import dependences
from workbench.diagnosis.drivers import drivers
from workbench.diagnosis.missing_term import Course
from workbench.plants import PLANTS

TIME_S = 5e-3 * np.arange(1600)
A, B = "chamber_a.pressure_pa", "chamber_b.pressure_pa"
ACROSS = "chamber_a less chamber_b.pressure_pa"
INTO_A = "valve into chamber_a.flow_kg_s"


def course(plant, **rows):
    """A course by what is said of it, all else as the plant begins."""
    model, (u, d, _) = plant.model, plant.nominal
    vectors = (model.states, plant.initial), (model.commands, u), (model.measured_inputs, d)
    constant = np.ones(len(TIME_S))
    parts = (
        np.array([rows.get(name, x * constant) for name, x in zip(names, start, strict=True)])
        for names, start in vectors
    )
    return Course(model.states[0], "", *(each.reshape(-1, len(TIME_S)) for each in parts))


def waves(seed, low, high):
    random = np.random.default_rng(seed)
    parts = [np.sin(2 * np.pi * f * TIME_S + random.uniform(0, 6)) for f in (0.31, 0.83, 1.7)]
    return low + (high - low) * (np.sum(parts, axis=0) + 3.0) / 6.0


@pytest.fixture(scope="module")
def driven():
    plant = PLANTS["servo_drive"]().lean()
    rows = {A: waves(1, 1.2e5, 6.9e5), B: waves(2, 2e5, 6e5), "valve.command_v": waves(3, 2.0, 8.0)}
    return rows, drivers(plant, course(plant, **rows), TIME_S)


def test_states_commands_and_their_rates_are_there(driven):
    rows, found = driven
    assert found[A] is not None and np.array_equal(
        found["valve.command_v"], rows["valve.command_v"]
    )
    slope = np.gradient(rows["valve.command_v"], TIME_S)
    np.testing.assert_allclose(found["rate of valve.command_v"], slope)


def test_a_leak_across_the_piston_follows_the_difference_of_its_pressures(driven):
    rows, found = driven
    across = rows[A] - rows[B]
    term = 1e-9 * across + 1e-5 * np.random.default_rng(5).standard_normal(len(across))
    first, *_ = dependences(found, {}, term, term)

    np.testing.assert_allclose(found[ACROSS], across)
    assert first.variable == ACROSS and first.explains > 0.95


def test_a_valve_that_passes_too_little_follows_its_own_flow(driven):
    rows, found = driven
    opened = rows["valve.command_v"] > 5.2
    assert (found[INTO_A][opened] > 0.0).all()  # the supply of 7 bar is above every pressure here
    first, *_ = dependences(found, {}, -0.1 * found[INTO_A], found[INTO_A])
    assert first.variable == INTO_A

    share = found["valve into chamber_a.share_of_choked_flow"]
    assert share.max() == pytest.approx(1.0) and share.min() < 0.9


def test_what_says_the_same_stands_once(driven):
    """A difference and a ratio order the samples alike here, and the supply is constant."""
    found = driven[1]
    assert "chamber_a over chamber_b.pressure_ratio" not in found
    assert not any("supply" in name for name in found)


def test_a_pressure_of_nothing_has_no_ratio():
    plant = PLANTS["servo_drive"]().lean()
    emptied = np.where(TIME_S > 4.0, 0.0, 3e5)
    found = drivers(plant, course(plant, **{A: waves(1, 2e5, 6e5), B: emptied}), TIME_S)
    assert "chamber_a over chamber_b.pressure_ratio" not in found
    assert all(np.isfinite(values).all() for values in found.values())
