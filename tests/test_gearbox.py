"""The gearbox actuator of paper 003: a flat oracle and the numbers of physics.md 7 and 10."""

import numpy as np
import oracle_gearbox as oracle
import pytest

from workbench.plants.gearbox import gearbox

DT = 1e-4
COMMANDS = ("valve_1.command", "valve_2.command")
GASES = ("chamber_1", "chamber_2", "control_chamber")
POSITION, VELOCITY = "main_piston.position_m", "main_piston.velocity_m_s"
ORACLE_STATES = (
    *(f"{name}.pressure_pa" for name in GASES),
    *(f"{name}.mass_kg" for name in GASES),
    POSITION,
    VELOCITY,
    "floating_piston.position_m",
    "floating_piston.velocity_m_s",
    "finger.angle_rad",
    "finger.velocity_rad_s",
    *(
        f"valve_{k}.{quantity}"
        for k in (1, 2)
        for quantity in ("current_a", "armature_position_m", "armature_velocity_m_s")
    ),
)


@pytest.fixture(scope="module")
def actuator():
    return gearbox().lean()


def random_conditions(n):
    """States in the oracle's order, commands and a load: into the stops and the contact too."""
    rng = np.random.default_rng(5)
    for _ in range(n):
        pressures = rng.uniform(0.6e5, 9.6e5, 3)
        x, x_f = rng.uniform(-1.202e-2, 1.202e-2), rng.uniform(-2e-5, 1.202e-2)
        x_f = rng.choice([x_f, x + 1e-5, x - 1e-5])
        masses = pressures * oracle.volumes(x, x_f) / (oracle.R * rng.uniform(220, 370, 3))
        v, v_f = rng.normal(0, 1, 2) * rng.choice([1e-3, 0.1, 1.0])
        finger = [(x + rng.normal(0, 2e-5)) / oracle.R_C, (v + rng.normal(0, 0.05)) / oracle.R_C]
        valves = [
            [rng.choice([rng.uniform(-0.02, 0.02), rng.uniform(0, 0.8)]), lift, rng.normal(0, 0.5)]
            for lift in rng.uniform(-2e-5, 1.92e-3, 2)
        ]
        state = [*pressures, *masses, x, v, x_f, v_f, *finger, *valves[0], *valves[1]]
        yield np.array(state), rng.choice([0.0, 1.0], 2), rng.uniform(-500, 500)


def test_the_composed_actuator_has_the_rates_of_the_flat_one(actuator):
    plant = actuator.with_measured_input("load.force_n")
    model, p = plant.model, plant.nominal[2]
    order = [ORACLE_STATES.index(name) for name in model.states]
    assert sorted(order) == list(range(18))
    for x, u, load_n in random_conditions(300):
        ours, seen = (column.full().ravel() for column in model.f(x[order], u, load_n, p))
        expected = oracle.rates(x, *u, load_n)[order]

        np.testing.assert_allclose(ours, expected, rtol=1e-10)
        np.testing.assert_array_equal(seen, x[[0, 1, 6]])
