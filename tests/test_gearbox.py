"""The gearbox actuator of paper 003: a flat oracle, the vectors of physics.md 10, conservation."""

import casadi as ca
import numpy as np
import oracle_gearbox as oracle
import pytest
from gearbox_shifts import ALL_SHIFTS, POSITION, held, run
from reference_solution import reference

from workbench.compiled import compiled
from workbench.effect import Force, HeatFlow, MassFlow, Torque
from workbench.effects import StribeckFriction
from workbench.parts import Body, Chamber
from workbench.plant import Plant, Signal
from workbench.plants.gearbox import gearbox
from workbench.rosenbrock import controlled_step

GASES = ("chamber_1", "chamber_2", "control_chamber")
ORACLE_STATES = (
    *(f"{name}.pressure_pa" for name in GASES),
    *(f"{name}.mass_kg" for name in GASES),
    POSITION,
    "main_piston.velocity_m_s",
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
    return gearbox().lean().with_measured_input("load.force_n")


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


def ordered(model):
    """Where each state of the model stands in the oracle's vector."""
    return [ORACLE_STATES.index(name) for name in model.states]


def test_the_composed_actuator_has_the_rates_of_the_flat_one(actuator):
    model, p = actuator.model, actuator.nominal[2]
    order = ordered(model)
    assert sorted(order) == list(range(18))
    for x, u, load_n in random_conditions(300):
        ours, seen = (column.full().ravel() for column in model.f(x[order], u, load_n, p))

        np.testing.assert_allclose(ours, oracle.rates(x, *u, load_n)[order], rtol=1e-10)
        np.testing.assert_array_equal(seen, x[[0, 1, 6]])


@pytest.mark.parametrize(
    ("start_m", "expected_cm3"),
    [
        (-12e-3, (15.00, 88.30, 45.07)),
        (0.0, (38.56, 79.82, 30.00)),
        (12e-3, (62.11, 40.00, 46.26)),
    ],
)
def test_the_volumes_at_low_neutral_and_high(start_m, expected_cm3):
    """To 0.02 cm3: the vectors of physics.md 10 are worked out with areas of four digits."""
    plant = gearbox(start_m).lean()
    volumes = plant.model.quantities(*(f"{name}.volume_m3" for name in GASES))
    found = volumes(plant.initial, [0, 0], [], plant.nominal[2]).full().ravel()

    assert 1e6 * found == pytest.approx(expected_cm3, abs=0.02)


def test_both_valves_hold_the_piston_in_neutral_from_either_side(actuator):
    """Physics.md 2.5: +1003 N below Neutral, -1082 N above, where the floating piston pushes."""
    gas = {b: 9e5 for b in ("chamber_1", "chamber_2")} | {"control_chamber": 1.013e5}
    flows = actuator.model.flows
    push = {
        body: sum(flows[name, "Force", body] for name in GASES if (name, "Force", body) in flows)
        for body in ("main_piston", "floating_piston")
    }
    x = actuator.initial
    for name, pressure_pa in gas.items():
        x[actuator.model.states.index(f"{name}.pressure_pa")] = pressure_pa
    force = ca.Function("force", [*actuator.model.symbols], [push[b] for b in push])
    main_n, floating_n = (float(f) for f in force(x, [1, 1], 0.0, actuator.nominal[2]))

    assert main_n == pytest.approx(1003.0, abs=1.0)
    assert main_n + floating_n == pytest.approx(-1082.0, abs=1.0)


def reduced(p1_pa, p2_pa, position_m, velocity_m_s, a1, a2, v10, v20, m, d):
    """Jacobian of (p1, p2, x, v) of two opposed chambers without flows, V2 = V20 - A2 x."""
    gas = dict(body="piston", stroke_m=1.0)
    plant = Plant(
        name="reduced",
        parts=(
            Body(name="piston", mass_kg=m),
            Chamber(name="one", side=+1, area_m2=a1, dead_volume_m3=v10, **gas),
            Chamber(name="two", side=-1, area_m2=a2, dead_volume_m3=v20, lower_m=-1.0, **gas),
        ),
        effects=(StribeckFriction(name="friction", body="piston", viscous_n_s_m=d),),
        commands=(Signal("nothing.at_all_v", 0.0),),
        measured=("one.pressure_pa",),
    )
    names = ("one.pressure_pa", "two.pressure_pa", "piston.position_m", "piston.velocity_m_s")
    rows = [plant.model.states.index(name) for name in names]
    x = plant.initial
    x[rows] = p1_pa, p2_pa, position_m, velocity_m_s
    return plant.model.jacobians(x, 0.0, [], plant.nominal[2])[0].full()[np.ix_(rows, rows)]


def test_the_jacobian_of_the_reduced_model_has_the_corrected_signs():
    """Errata E003-2 and E003-3: a13, a22, a23 and a24 are positive."""
    A = reduced(6e5, 3e5, 2e-3, 0.7, a1=1.9e-3, a2=7e-4, v10=4e-5, v20=3e-5, m=1.6, d=60.0)
    expected = [
        [-42.5114, 0.0, 1.10646e9, -3.64384e7],
        [0.0, 23.986, 1.76121e8, 1.02797e7],
        [0.0, 0.0, 0.0, 1.0],
        [1.1875e-3, -4.375e-4, 0.0, -37.5],
    ]

    np.testing.assert_allclose(A, expected, rtol=1e-5)


@pytest.mark.parametrize(("p1_bar", "p2_bar", "omega"), [(6, 3, 218), (1, 9, 143)])
def test_at_rest_two_chambers_are_a_spring_at_any_pressures(p1_bar, p2_bar, omega):
    """Consequence of E003-3: 0, 0 and -19 +- 218 i or 143 i; with the printed sign unstable."""
    sizes = dict(a1=1.9e-3, a2=7e-4, v10=4e-5, v20=3e-5, m=1.6, d=60.0)
    found = np.linalg.eigvals(reduced(p1_bar * 1e5, p2_bar * 1e5, 2e-3, 0.0, **sizes))
    pair = found[np.abs(found) > 1.0]

    assert pair.real == pytest.approx([-19.0, -19.0], abs=0.5)
    assert np.abs(pair.imag) == pytest.approx([omega, omega], abs=1.0)


def balance(plant):
    """Energy stored in J, gas held in kg, and what changes them: terms in W, and in kg/s."""
    model = plant.model
    values = dict(zip(model.parameters, ca.vertsplit(model.symbols[3]), strict=True))
    symbolic, now = plant.with_values(values), model.conditions
    along = {"main_piston": now["main_piston"], "floating_piston": now["floating_piston"]}
    ports = [p for p in symbolic.parts if p.name == "control_chamber"]
    powers, entering = [], 0.0
    for term in (t for member in (*ports, *symbolic.effects) for t in member.terms(now)):
        if isinstance(term, MassFlow) and term.balance in GASES:
            c_p = 1004.5
            powers.append(c_p * term.value * term.temperature_k)
            entering += term.value
        elif isinstance(term, HeatFlow):
            powers.append(term.value)
        elif isinstance(term, Torque):
            powers.append(term.value * now["finger"].velocity_rad_s)
    for member in symbolic.effects:
        for term in member.terms(now):
            if isinstance(term, Force):
                powers.append(term.value * along[term.balance].velocity_m_s)
    gas = sum(now[name].pressure_pa * now[name].volume_m3 / 0.4 for name in GASES)
    kinetic = 0.5 * values["finger.inertia_kg_m2"] * now["finger"].velocity_rad_s ** 2
    for name, body in along.items():
        kinetic += 0.5 * values[f"{name}.mass_kg"] * body.velocity_m_s**2
    held_kg = sum(now[name].mass_kg for name in GASES)
    return gas + kinetic, held_kg, ca.vertcat(*powers), entering


def test_what_the_gas_does_to_the_pistons_it_loses_itself(actuator):
    """Rate of the energy of gas and motion = enthalpy, heat and the power of all other forces."""
    plant = gearbox().lean()
    model, p = plant.model, plant.nominal[2]
    stored, held_kg, powers, entering = balance(plant)
    kept = ca.jtimes(ca.vertcat(stored, held_kg), model.symbols[0], model.rates)
    both = ca.Function("both", [*model.symbols], [kept, powers, entering])
    order = ordered(model)
    for x, u, _ in random_conditions(100):
        rates, power_w, entering_kg_s = (c.full().ravel() for c in both(x[order], u, [], p))

        assert rates[0] == pytest.approx(power_w.sum(), abs=1e-10 * np.abs(power_w).max())
        assert rates[1] == pytest.approx(entering_kg_s[0], rel=1e-12)


def test_no_energy_and_no_gas_is_lost_or_made_over_a_shift_and_its_release():
    """Our own step at 0.05 ms, with powers and flow integrated beside the states."""
    plant, dt = gearbox().lean(), 5e-5
    model, p = plant.model, plant.nominal[2]
    stored, held_kg, powers, entering = balance(plant)
    x, u, d, ps = model.symbols
    passed = ca.SX.sym("passed", 2)
    rates = ca.vertcat(model.rates, ca.sum1(powers), entering)
    tolerances = np.append(0.1 * model.tolerances, [np.inf] * 2)
    step = controlled_step((ca.vertcat(x, passed), u, d, ps), rates, dt, tolerances)
    commands = held([((1, 0), 0.03), ((0, 0), 0.05)], dt)[:, :-1]
    start = np.append(plant.initial, [0.0, 0.0])
    end = compiled(step).mapaccum(commands.shape[1])(start, commands, [], p)[:, -1].full().ravel()
    now = ca.Function("now", [x, u, d, ps], [ca.vertcat(stored, held_kg)])
    gained = (now(end[:-2], [0, 0], [], p) - now(plant.initial, [0, 0], [], p)).full().ravel()
    filled_j = 9e5 * 62e-6 / 0.4

    assert gained[0] == pytest.approx(end[-2], abs=1e-5 * filled_j)
    assert gained[1] == pytest.approx(end[-1], abs=1e-9 * 6.6e-4)


def errors(pieces):
    """Worst and mean error of the position in m and of the pressures in Pa, sampled at 1 kHz."""
    plant = gearbox().lean()
    seen = run(plant, pieces, 1e-3)
    exact = reference(plant, held(pieces, 1e-3), 1e-3, contact=True)
    off = {n: np.abs(seen[n] - row) for n, row in zip(plant.model.states, exact, strict=True)}
    pressures = np.array([off[f"chamber_{k}.pressure_pa"] for k in (1, 2)])
    return off[POSITION].max(), off[POSITION].mean(), pressures.max(), pressures.mean()


@pytest.mark.parametrize(
    "pieces",
    [
        pytest.param([((1, 0), 0.025)], id="N to H"),
        pytest.param(ALL_SHIFTS, id="all shifts", marks=pytest.mark.slow),
    ],
)
def test_a_shift_is_exact_to_a_tenth_of_the_sensor_noise(pieces):
    """Noise of 20 um and 1 kPa, physics.md 2; the means are a hundred times smaller."""
    worst_m, mean_m, worst_pa, mean_pa = errors(pieces)

    assert worst_m < 2e-6
    assert worst_pa < 100.0
    assert mean_m < 0.2e-6
    assert mean_pa < 10.0


@pytest.mark.parametrize("coil_k", [293.15, 350.0])
def test_a_valve_long_energised_carries_the_current_of_its_warm_coil(coil_k):
    plant = gearbox().with_values({"valve_1.coil_temperature_k": coil_k}).lean()
    record = run(plant, [((1, 0), 0.3)])
    valve = next(member for member in plant.members if member.name == "valve_1")
    warm = 1.0 + 0.0039 * (coil_k - 293.15)

    assert record["valve_1.current_a"][-1] == pytest.approx(24.0 / (30.0 * warm), rel=1e-3)
    assert float(valve.driven()["current_a"]) == pytest.approx(24.0 / (30.0 * warm))
