"""The leg of paper 001 against a flat oracle and the numbers of physics.md 2.3, 7 and 10."""

import numpy as np
import oracle_crr_leg as oracle
import oracle_crr_rig as rig
import pytest
from conftest import PLANT_MODELS
from scipy.integrate import DOP853

from workbench.effects import LinkGravity
from workbench.leg import Leg, LegGeometry
from workbench.linkage import Joint
from workbench.plant import Plant
from workbench.plants.crr_leg import JOINTS, RANGES_RAD, RODS
from workbench.recording import Recording
from workbench.simulation import simulate

NUMBERS = (1, 2, 3)
ANGLES = [f"joint_{n}.angle_rad" for n in NUMBERS]
VELOCITIES = [f"joint_{n}.velocity_rad_s" for n in NUMBERS]
GAS = [
    f"{chamber}_{n}.{quantity}"
    for n in NUMBERS
    for chamber in ("cap", "rod_side")
    for quantity in ("pressure_pa", "mass_kg")
]
ORACLE_STATES = (*ANGLES, *VELOCITIES, *GAS)
SIZE = np.array([1.0] * 3 + [100.0] * 3 + [1e5, 1e-3] * 6)
POSE = (0.3, -0.7, 1.1)
LEG = Leg(name="leg", joints=JOINTS)


@pytest.fixture
def leg():
    """The leg without what is absent."""
    return PLANT_MODELS["crr_leg"].lean()


def random_states():
    """States in the oracle's order and commands, into the stops too."""
    rng = np.random.default_rng(14)
    for _ in range(100):
        q = np.array([rng.uniform(low - 2e-3, high + 2e-3) for low, high in oracle.RANGES])
        qd = rng.normal(0, 5, 3) * rng.choice([1e-3, 0.1, 1.0])
        gas = []
        for n in range(3):
            volumes = rig.volumes(oracle.joint(n, q[n])[0], oracle.STROKE)
            pressures = rng.uniform(0.8e5, 7e5, 2)
            masses = pressures * volumes / (rig.R * rng.uniform(240, 350, 2))
            gas.extend(np.ravel([pressures, masses], "F"))
        yield np.concatenate([q, qd, gas]), rng.uniform(0, 10, 3)


def test_the_composed_leg_has_the_rates_and_outputs_of_the_flat_one(leg):
    for x, u in random_states():
        known = dict(zip(ORACLE_STATES, x, strict=True))
        state = [known.get(name, 0.0) for name in leg.model.states]
        rates, outputs = leg.model.f(state, u, [], leg.nominal[2])
        rate = dict(zip(leg.model.states, rates.full().ravel(), strict=True))
        ours = np.array([rate[name] for name in ORACLE_STATES])

        np.testing.assert_allclose(ours / SIZE, oracle.rates(x, u) / SIZE, 1e-10, 1e-10)
        np.testing.assert_array_equal(outputs.full().ravel(), [*x[:3], *x[6::2]])


def test_a_full_leg_has_18_states_besides_its_bristles(leg):
    assert len([name for name in leg.model.states if "friction" not in name]) == 18


def test_the_foot_is_where_the_table_of_paper_001_puts_it():
    foot = [float(value) for value in LegGeometry().foot_m(POSE)]

    assert foot == pytest.approx((0.534450, 0.165325, 0.033876), abs=1e-6)


def test_the_foot_is_the_product_of_the_transforms_of_the_table():
    for q in np.random.default_rng(2).uniform(-np.pi, np.pi, (50, 3)):
        foot = [float(value) for value in LegGeometry().foot_m(q)]

        assert foot == pytest.approx(oracle.dh_foot(q), abs=1e-14)


def test_the_inverse_kinematics_leads_back_to_the_same_angles():
    rng = np.random.default_rng(3)
    geometry = LegGeometry()
    for _ in range(100):
        q = np.array([rng.uniform(low, high) for low, high in RANGES_RAD])
        foot = [float(value) for value in geometry.foot_m(q)]

        assert geometry.angles_rad(foot) == pytest.approx(q, abs=1e-12)
        other = geometry.angles_rad(foot, bend=-1)
        assert other[2] == pytest.approx(-q[2], abs=1e-12)
        assert [float(v) for v in geometry.foot_m(other)] == pytest.approx(foot, abs=1e-12)


def test_a_foot_out_of_reach_is_refused():
    with pytest.raises(
        ValueError, match=r"the foot cannot be at \(2, 0, 0\) m.*0\.1314 to 0\.4782"
    ):
        LegGeometry().angles_rad((2.0, 0.0, 0.0))


def test_inertia_and_weight_have_the_known_values(leg):
    M = np.array(LEG.mass_matrix(POSE), dtype=float)
    x = leg.initial
    x[[leg.model.states.index(name) for name in ANGLES]] = POSE
    names = [f"leg.joint_{n}_along_kg_m" for n in (2, 3)]
    along = leg.model.quantities(*names)(x, [5.25] * 3, [], leg.nominal[2]).full().ravel()

    found = [M[0, 0], M[1, 1], M[1, 2], M[2, 2]]
    assert found == pytest.approx([0.142038, 0.051704, 0.021506, 0.015512], abs=1e-6)
    assert 9.81 * along == pytest.approx([-1.924722, -0.688513], abs=2e-6)


def test_the_inertia_is_that_of_three_solid_cylinders():
    """Kinetic energy link by link, from the velocities of centres and the turning rates."""
    rng = np.random.default_rng(4)
    q, qd = np.array(POSE), rng.normal(size=3)

    def centres(q):
        c1, s1, c2, c23 = np.cos(q[0]), np.sin(q[0]), np.cos(q[1]), np.cos(q[1] + q[2])
        s2, s23 = np.sin(q[1]), np.sin(q[1] + q[2])
        out = (oracle.A1 / 2, oracle.A1 + oracle.A2 / 2 * c2,
               oracle.A1 + oracle.A2 * c2 + oracle.A3 / 2 * c23)  # fmt: skip
        down = (0.0, oracle.A2 / 2 * s2, oracle.A2 * s2 + oracle.A3 / 2 * s23)
        return np.array([[r * c1, r * s1, -z] for r, z in zip(out, down, strict=True)])

    velocities = np.imag(centres(q + 1e-30j * qd)) / 1e-30
    pitch, rate = (0.0, q[1], q[1] + q[2]), (0.0, qd[1], qd[1] + qd[2])
    energy = 0.0
    for m, r, length, v, angle, turn in zip(
        (1.2, 0.9, 0.5), (30e-3, 25e-3, 15e-3), (oracle.A1, oracle.A2, oracle.A3),
        velocities, pitch, rate, strict=True,
    ):  # fmt: skip
        across, axial = m * (3 * r**2 + length**2) / 12, m * r**2 / 2
        yaw = across * np.cos(angle) ** 2 + axial * np.sin(angle) ** 2
        energy += 0.5 * (m * v @ v + across * turn**2 + yaw * qd[0] ** 2)

    M = np.array(LEG.mass_matrix(POSE), dtype=float)
    assert 0.5 * qd @ M @ qd == pytest.approx(energy, rel=1e-12)


def test_a_payload_is_a_point_mass_at_the_foot():
    """Its kinetic energy, and its weight as the slope of its height."""
    loaded = Leg(name="leg", joints=JOINTS, added_mass_kg=0.4)
    q, qd = np.array(POSE), np.array([0.7, -1.1, 2.3])
    foot = np.imag(oracle_foot(q + 1e-30j * qd)) / 1e-30
    extra = np.array(loaded.mass_matrix(POSE), float) - np.array(LEG.mass_matrix(POSE), float)

    assert qd @ extra @ qd == pytest.approx(0.4 * foot @ foot, rel=1e-12)


def oracle_foot(q):
    """The printed foot position, for complex angles."""
    out = oracle.A1 + oracle.A2 * np.cos(q[1]) + oracle.A3 * np.cos(q[1] + q[2])
    down = oracle.A2 * np.sin(q[1]) + oracle.A3 * np.sin(q[1] + q[2])
    return np.array([out * np.cos(q[0]), out * np.sin(q[0]), oracle.D1 - down])


def test_the_weight_is_the_slope_of_the_potential_energy():
    rest = np.zeros(3)
    for q in np.random.default_rng(5).uniform(-1.5, 1.5, (20, 3)):
        slope = [
            (oracle.energy(q + e, rest) - oracle.energy(q - e, rest)) / 2e-5
            for e in 1e-5 * np.eye(3)
        ]

        assert oracle.gravity(q) == pytest.approx(slope, abs=1e-8)


def test_holding_torques_are_as_told():
    """Physics.md 7: 0, -1.26 and +0.26 N m at (0, 20, 90) degrees."""
    torques = oracle.gravity(np.radians([0.0, 20.0, 90.0]))

    assert torques == pytest.approx([0.0, -1.26, 0.26], abs=5e-3)


@pytest.mark.parametrize("number", NUMBERS)
def test_every_joint_needs_a_stroke_of_56_to_58_mm_and_a_lever_of_28_to_45_mm(number):
    rod, (low, high) = RODS[number - 1], RANGES_RAD[number - 1]
    angles = np.linspace(low, high, 200)
    levers = [float(rod.lever_m(angle)) for angle in angles]

    assert 0.0559 < float(rod.position_m(high) - rod.position_m(low)) < 0.0581
    assert min(levers) > 0.0275 and max(levers) < 0.0451
    assert float(rod.position_m(low)) > 0.0 and float(rod.position_m(high)) < 0.0635


def swinging():
    """The leg without cylinders, free to turn, started with a whirl."""
    joints = tuple(
        Joint(name=joint, rod=rod.name, linkage="leg", initial_angle_rad=angle)
        for joint, rod, angle in zip(JOINTS, RODS, (0.0, 0.3, 0.6), strict=True)
    )
    gravity = LinkGravity(name="link_gravity", linkage="leg", joints=JOINTS[1:], gravity_m_s2=9.81)
    return Plant(
        name="swinging", parts=(*RODS, *joints, LEG), effects=(gravity,), measured=tuple(ANGLES)
    )


def energies(states, x):
    """Energy along a run, states in rows."""
    q, qd = (x[[states.index(name) for name in names]].T for names in (ANGLES, VELOCITIES))
    return np.array([oracle.energy(*pair) for pair in zip(q, qd, strict=True)])


def start(states):
    values = dict(zip((*ANGLES, *VELOCITIES), (0.0, 0.3, 0.6, 2.0, -1.0, 1.5), strict=True))
    return np.array([values[name] for name in states])


def test_in_free_swing_the_leg_keeps_its_energy():
    """Below 1e-8 J in 2 s with a tight integrator: M, C and G belong together (told: 1.1e-9 J)."""
    plant = swinging()
    model, values = plant.model, plant.nominal[2]
    x0 = start(model.states)
    solver = DOP853(
        lambda t, x: model.f(x, [], [], values)[0].full().ravel(),
        0.0, x0, 2.0, rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    path = [x0]
    while solver.status == "running":
        solver.step()
        path.append(solver.y)
    found = energies(model.states, np.array(path).T)

    assert np.ptp(np.array(path), axis=0).max() > 2.0
    assert np.ptp(found) < 1e-8


def test_the_integrator_of_the_workbench_keeps_the_energy_of_a_free_swing_nearly():
    """2 s at 1 kHz; the swing holds some 2 J."""
    plant = swinging()
    x0 = start(plant.model.states)
    nothing = np.zeros((0, 2000))
    run = plant.model.run(1e-3, 2000)
    states = run(x0, nothing, nothing, plant.nominal[2]).full()

    assert np.ptp(energies(plant.model.states, states)) < 1e-4


def test_a_commanded_joint_moves_and_the_others_feel_it(leg):
    """Joint 3 is driven out: its angle grows, and joint 2 is pushed by it."""
    n = 301
    commands = {f"valve_{k}.command_v": np.full(n, 5.25) for k in NUMBERS}
    still = simulate(leg, Recording("rest", 1e-3, commands))
    driven = simulate(
        leg, Recording("drive", 1e-3, commands | {"valve_3.command_v": np.full(n, 7.0)})
    )

    moved = [driven[name][-1] - still[name][-1] for name in ANGLES]
    assert moved[2] > 0.1
    assert abs(moved[1]) > 1e-4
    assert abs(moved[0]) < 1e-3
