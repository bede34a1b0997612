"""The servo drive of paper 002 against a flat oracle and the numbers of physics.md 7 and 10."""

from dataclasses import replace

import casadi as ca
import numpy as np
import oracle_servo_drive as oracle
import pytest
from scipy.optimize import brentq

from workbench.effects.bristle_friction import blend
from workbench.recording import Recording
from workbench.simulation import simulate

DT = 1e-3
COMMAND, POSITION, VELOCITY = "valve.command_v", "slide.position_m", "slide.velocity_m_s"
PRESSURES = ("chamber_a.pressure_pa", "chamber_b.pressure_pa")
ORACLE_STATES = (
    POSITION,
    VELOCITY,
    PRESSURES[0],
    "chamber_a.mass_kg",
    PRESSURES[1],
    "chamber_b.mass_kg",
    "friction.deflection_m",
)


def run(drive, command_v):
    return simulate(drive, Recording("run", DT, {COMMAND: np.asarray(command_v, dtype=float)}))


def sine(amplitude_v, duration_s=4.0):
    return 4.95 + amplitude_v * np.sin(np.pi * DT * np.arange(round(duration_s / DT) + 1))


def quantity(drive, result, *names):
    """Quantities along a run, one per row."""
    x, u = result.rows(drive.model.states), result.rows(drive.model.commands)
    d = np.zeros((0, len(result)))
    return drive.model.quantities(*names).map(len(result))(x, u, d, drive.nominal[2]).full()


def random_states():
    """States in the oracle's order and commands, into both stops too."""
    rng = np.random.default_rng(11)
    for _ in range(300):
        y = rng.uniform(-1e-4, 0.2901)
        pressures = rng.uniform(0.8e5, 7.4e5, 2)
        volumes = oracle.V_AD + oracle.S_P * y, oracle.V_BD + oracle.S_P * (oracle.L_P - y)
        m_a, m_b = pressures * volumes / (oracle.R * rng.uniform(240, 350, 2))
        v, z = rng.normal(0, 0.3) * rng.choice([1e-3, 0.1, 1.0]), rng.uniform(-5e-5, 5e-5)
        yield np.array([y, v, pressures[0], m_a, pressures[1], m_b, z]), rng.uniform(0, 10)


def test_the_composed_drive_has_the_rates_of_the_flat_one(drive):
    """To 1e-7: the friction carries a negligible force of 1e-6 N against division by zero."""
    model, p = drive.model, drive.nominal[2]
    order = [ORACLE_STATES.index(name) for name in model.states]
    for x, u in random_states():
        ours = model.f(x[order], u, [], p)[0].full().ravel()
        size = np.array([1.0, 10.0, 1e5, 1e-3, 1e5, 1e-3, 1.0])[order]

        np.testing.assert_allclose(ours / size, oracle.rates(x, u)[order] / size, 1e-7, 1e-7)


@pytest.mark.parametrize(
    ("share", "expected"), [(0.9, 0.0), (0.925, 0.1464), (0.95, 0.5), (0.975, 0.8536), (1.0, 1.0)]
)
def test_the_bristle_turns_from_elastic_to_plastic(share, expected):
    for sign in (1.0, -1.0):
        assert float(blend(sign * share, sign * 0.1, 1.0)) == pytest.approx(expected, abs=1e-4)
        assert float(blend(sign * share, -sign * 0.1, 1.0)) == 0.0


def sliding_friction_n(drive, velocity_m_s):
    """Friction against the motion once the bristle has settled."""
    x, u, d, p = drive.model.symbols
    force = drive.model.flows["friction", "Force", "slide"]
    bristle = drive.model.states.index("friction.deflection_m")
    sliding = ca.Function("sliding", [x, u, d, p], [-force, drive.model.rates[bristle]])
    at = drive.initial
    at[drive.model.states.index(VELOCITY)] = velocity_m_s

    def values(z):
        at[bristle] = z
        return [float(v) for v in sliding(at, 4.95, [], drive.nominal[2])]

    side = np.sign(velocity_m_s) * 1e-4
    return values(brentq(lambda z: values(z)[1], 1e-3 * side, side, xtol=1e-15))[0]


@pytest.mark.parametrize(
    ("speed_m_s", "forward_n", "backward_n"),
    [(1e-9, 50.97, 46.15), (0.024, 37.78, 34.56), (0.1, 32.95, 30.44), (0.5, 51.36, 47.31)],
)
def test_friction_has_the_stribeck_curve_of_table_5(drive, speed_m_s, forward_n, backward_n):
    assert sliding_friction_n(drive, speed_m_s) == pytest.approx(forward_n, abs=0.02)
    assert -sliding_friction_n(drive, -speed_m_s) == pytest.approx(backward_n, abs=0.02)


def test_friction_takes_energy_at_every_speed(drive):
    for v in (-1.0, -0.1, -0.02, -1e-3, -1e-6, 1e-6, 1e-3, 0.02, 0.1, 1.0):
        assert sliding_friction_n(drive, v) * v > 0


def test_the_sine_of_the_paper_moves_the_slide_as_told(drive):
    """Physics.md 7: 12..224 mm, -0.53..0.47 m/s, 4.9..6.6 and 4.9..6.3 bar, 280..307 K, 64 N."""
    result = run(drive, sine(0.8))
    a, b = (result[name] for name in PRESSURES)
    warm = quantity(drive, result, "chamber_a.temperature_k", "chamber_b.temperature_k")
    y, v = result[POSITION], result[VELOCITY]
    seen = [np.ptp(y), v.min(), v.max(), a.min(), a.max(), b.min(), b.max()]
    told = [0.212, -0.53, 0.47, 4.9e5, 6.6e5, 4.9e5, 6.3e5]

    assert seen == pytest.approx(told, rel=0.2)
    assert [warm.min(), warm.max()] == pytest.approx([280.0, 307.0], rel=0.02)
    assert np.abs(oracle.S_P * (a - b)).max() == pytest.approx(64.0, rel=0.2)


def test_a_sine_of_one_volt_reaches_both_ends(drive):
    y = run(drive, sine(1.0))[POSITION]

    assert y.min() < 0.0
    assert y.max() > oracle.L_P


def test_the_closed_valve_rests_at_the_pressure_that_the_paper_prints(drive):
    """60 s at u_0 = 4.98 V from 3 bar: 5.65 bar, where equal leaks balance."""
    parts = (
        replace(part, initial_pressure_pa=3e5) if hasattr(part, "initial_pressure_pa") else part
        for part in drive.parts
    )
    result = run(replace(drive, parts=tuple(parts)), np.full(60_001, 4.98))

    assert [result[name][-1] for name in PRESSURES] == pytest.approx([5.65e5] * 2, rel=1e-3)


def stick_slip(drive, command_v, duration_s):
    """Share of time in motion and pauses per second, from the first motion to the end.

    In motion: faster than 1 mm/s.  A pause: slower, for however long; a stop: for 10 ms or more.
    """
    no_leak = drive.with_values({"valve.leak_area_m2": 0.0})
    result = run(no_leak, np.full(round(duration_s / DT) + 1, command_v))
    before_end = result[POSITION] < 0.28
    v = np.abs(result[VELOCITY][before_end])
    slow = v[np.argmax(v > 1e-3) :] < 1e-3
    edges = np.flatnonzero(np.diff([0, *slow, 0]))
    lengths_s = DT * (edges[1::2] - edges[::2])
    total_s = DT * len(slow)
    return 1 - slow.mean(), len(lengths_s) / total_s, (lengths_s >= 0.01).sum() / total_s, v.max()


@pytest.mark.parametrize(
    ("command_v", "duration_s", "moving", "pauses_per_s"),
    [
        (5.372, 20.0, (0.05, 0.45), (2, 12)),
        (5.40, 7.0, (0.4, 0.75), (30, 80)),
        (5.45, 3.0, (0.75, 0.97), (20, 45)),
        (5.50, 2.0, (0.9, 1.0), (0, 6)),
    ],
)
def test_above_the_dead_zone_the_slide_sticks_and_slips(
    drive, command_v, duration_s, moving, pauses_per_s
):
    """Physics.md 7, as a picture: mostly standing with jumps, then ever fewer pauses."""
    share, pauses, _, _ = stick_slip(drive, command_v, duration_s)

    assert moving[0] <= share <= moving[1]
    assert pauses_per_s[0] <= pauses <= pauses_per_s[1]


def test_just_above_the_dead_zone_the_slide_stops_for_long_and_jumps(drive):
    """About 1 to 3 stops a second of 10 ms and more, jumps of 0.15 m/s."""
    _, _, stops, fastest = stick_slip(drive, 5.372, 20.0)

    assert 0.3 < stops < 4.0
    assert fastest == pytest.approx(0.15, rel=0.2)
