"""The reservoir of paper 002: a flat oracle, the numbers of physics.md 7, conservation."""

import casadi as ca
import numpy as np
import oracle_servo_reservoir as oracle
import pytest
from scipy.integrate import solve_ivp

from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.simulation import simulate

DT = 1e-3
COMMAND, PRESSURE = "valve.command_v", "reservoir.pressure_pa"
SUPPLY_PA, AMBIENT_PA, ROOM_K = 7e5, 1e5, 293.15


@pytest.fixture(scope="module")
def tank():
    return PLANTS["servo_reservoir"]().lean()


def filled(pressure_pa):
    return np.array([pressure_pa, pressure_pa * oracle.V / (oracle.R * ROOM_K), 0.0])


def run(tank, command_v, start_pa):
    """Pressure and gas temperature along a run from a tank at room temperature."""
    recording = Recording("run", DT, {COMMAND: np.asarray(command_v, dtype=float)})
    result = simulate(tank, recording, filled(start_pa))
    gas_k = result[PRESSURE] * oracle.V / (result["reservoir.mass_kg"] * oracle.R)
    return result[PRESSURE], gas_k


def random_states(n=100):
    rng = np.random.default_rng(5)
    for _ in range(n):
        p, temperature = rng.uniform(0.9e5, 7.2e5), rng.uniform(200.0, 390.0)
        m = p * oracle.V / (oracle.R * temperature)
        yield np.array([p, m, rng.normal(0, 20)]), rng.uniform(0, 10)


@pytest.mark.parametrize("heating_k_j", [0.0, 0.02])
def test_the_composed_reservoir_has_the_rates_of_the_flat_one(tank, heating_k_j):
    """To 1e-10 of each rate's usual size; a heat flow of 1e-6 of its size is guarded against."""
    plant = tank.with_values({"wall_heat.heating_k_j": heating_k_j})
    for x, u in random_states():
        ours = plant.model.f(x, u, [], plant.nominal[2])[0].full().ravel()
        size = np.array([1e6, 1e-2, 1e2])

        np.testing.assert_allclose(
            ours / size, oracle.rates(x, u, heating_k_j) / size, rtol=1e-10, atol=1e-10
        )


@pytest.mark.parametrize(("command_v", "time_s"), [(10.0, 0.10), (7.0, 0.20), (5.6, 1.4)])
def test_the_tank_charges_in_the_time_that_physics_7_gives(tank, command_v, time_s):
    pressure, _ = run(tank, np.full(3001, command_v), AMBIENT_PA)

    assert DT * np.argmax(pressure > 0.95 * SUPPLY_PA) == pytest.approx(time_s, rel=0.05)


def test_the_gas_gets_as_hot_as_the_adiabatic_limit_allows_and_cold_when_it_leaves(tank):
    """Physics.md 7: up to 384 K charging, limit 388 K; down to 177 K discharging."""
    adiabatic = tank.with_values({"wall_heat.coefficient_w_m2_k": 0.0})
    full = np.full(1001, 10.0)

    assert run(tank, full, AMBIENT_PA)[1].max() == pytest.approx(384.0, abs=2.0)
    assert run(adiabatic, full, AMBIENT_PA)[1].max() == pytest.approx(388.0, abs=2.0)
    assert run(tank, np.zeros(1001), SUPPLY_PA)[1].min() == pytest.approx(177.0, abs=2.0)


def test_the_tank_discharges_in_the_time_that_physics_7_gives(tank):
    pressure, _ = run(tank, np.zeros(1001), SUPPLY_PA)

    assert DT * np.argmax(pressure < 1.35e5) == pytest.approx(0.24, rel=0.05)


def test_a_fast_sine_of_full_size_swings_the_pressure_as_told(tank):
    """4 Hz between 0 and 10 V: 3.4 to 7.0 bar."""
    time_s = DT * np.arange(4001)
    pressure, _ = run(tank, 5.0 + 5.0 * np.sin(8 * np.pi * time_s), 5e5)
    settled = pressure[2000:] / 1e5

    assert [settled.min(), settled.max()] == pytest.approx([3.4, 7.0], rel=0.03)


def test_the_tank_loses_its_heat_in_2_8_seconds(tank):
    """Thermal time constant at P_0 (physics.md 2.4), from 1 K above the wall, valve shut tight."""
    shut = tank.with_values({"valve.leak_area_m2": 0.0})
    warm = filled(oracle.P_0)
    warm[0] *= 1 + 1 / ROOM_K
    rate = shut.model.f(warm, 4.95, [], shut.nominal[2])[0].full()[0, 0]

    assert -(warm[0] - oracle.P_0) / rate == pytest.approx(2.8, rel=0.03)


def test_an_adiabatic_tank_gains_the_enthalpy_of_what_flowed_in(tank):
    """U = p V/(kappa - 1) grows by c_p T_s for every kilogram from the supply."""
    values = {"wall_heat.coefficient_w_m2_k": 0.0, "valve.leak_area_m2": 0.0}
    plant = tank.with_values(values)
    recording = Recording("fill", DT, {COMMAND: np.full(1001, 10.0)})
    result = simulate(plant, recording, filled(AMBIENT_PA))
    energy_j = result[PRESSURE] * oracle.V / (oracle.K - 1)
    heat_capacity_j_kg_k = oracle.K * oracle.R / (oracle.K - 1)
    carried_j = heat_capacity_j_kg_k * ROOM_K * result["reservoir.mass_kg"]

    assert energy_j[-1] - energy_j[0] == pytest.approx(carried_j[-1] - carried_j[0], rel=1e-6)


def test_a_shut_tank_and_its_wall_keep_mass_and_energy(tank):
    values = {"valve.leak_area_m2": 0.0, "wall_heat.heating_k_j": 0.02}
    plant = tank.with_values(values | {"wall_heat.wall_time_s": 1e4})
    hot = filled(6e5) * [1.2, 1.0, 0.0]
    result = simulate(plant, Recording("shut", DT, {COMMAND: np.full(10_001, 4.95)}), hot)
    stored_j = result["wall_heat.stored_j"]
    energy_j = result[PRESSURE] * oracle.V / (oracle.K - 1) + stored_j
    lost_j = np.trapezoid(stored_j, dx=DT) / 1e4

    assert result["reservoir.mass_kg"][-1] == pytest.approx(hot[1], rel=1e-12)
    assert stored_j[-1] > 10.0
    assert energy_j[-1] + lost_j == pytest.approx(energy_j[0], rel=1e-7)


def test_what_the_valve_brings_is_what_the_tank_holds(tank):
    """The mass state against the valve's own flow, integrated beside it."""
    model, p = tank.model, tank.nominal[2]
    into = model.flows["valve", "MassFlow", "reservoir"]
    both = ca.Function("both", [*model.symbols], [ca.vertcat(model.rates, into)])

    def rates(t, x):
        return both(x[:3], 5.0 + 5.0 * np.sin(8 * np.pi * t), [], p).full().ravel()

    start = np.append(filled(5e5), 0.0)
    options = dict(rtol=1e-8, atol=[1.0, 1e-11, 1e-4, 1e-11], max_step=2e-3)
    end = solve_ivp(rates, (0.0, 0.5), start, "LSODA", **options).y[:, -1]
    fine = 1e-4
    command = 5.0 + 5.0 * np.sin(8 * np.pi * (fine * np.arange(5001) + fine / 2))
    result = simulate(tank, Recording("sine", fine, {COMMAND: command}), filled(5e5))

    assert end[1] - start[1] == pytest.approx(end[3], abs=1e-9)
    assert result["reservoir.mass_kg"][-1] == pytest.approx(end[1], rel=1e-5)
