"""What the causes in valves, lines, sensors and soft walls do, on the plants that have them."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from linearize.reduction import design_model
from workbench.effects.line_delay import SOUND_M_S
from workbench.gas_volume import PolytropicLevel
from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.simulation import inputs, simulate
from workbench.spool import EDGE, shut_while_stuck

DT = 1e-3
PWM, BELLOWS = "valve.pwm", "bellows.pressure_pa"
VOLTS, TANK = "valve.command_v", "reservoir.pressure_pa"


def joint(**values):
    """The soft joint with these values; an underscore for the dot."""
    named = {name.replace("__", "."): value for name, value in values.items()}
    return PLANTS["soft_joint"]().with_values(named).lean()


def tank(**values):
    named = {name.replace("__", "."): value for name, value in values.items()}
    return PLANTS["servo_reservoir"]().with_values(named).lean()


def run(plant, command, channel, start_pa=None):
    recording = Recording("run", DT, {channel: np.asarray(command, dtype=float)})
    x0 = np.array(plant.initial)
    if start_pa:
        gas = 2 if "reservoir.mass_kg" in plant.state_list else 1  # pressure and mass, or pressure
        x0[:gas] *= start_pa / x0[0]
    return simulate(plant, recording, x0)


def quantity(plant, result, name, *channels):
    """One quantity along a run."""
    x, u = result.rows(plant.model.states), result.rows(channels)
    d = np.zeros((0, len(result)))
    return plant.model.quantities(name).map(len(result))(x, u, d, plant.nominal[2]).full()[0]


def test_a_spool_with_play_moves_only_where_it_is_pushed():
    play = 0.03
    plant = joint(valve_hysteresis__play_share=play)
    triangle = 0.5 + 0.2 * np.interp(np.arange(8001) % 4000, [0, 1000, 3000, 4000], [0, 1, -1, 0])

    moved = quantity(plant, run(plant, triangle, PWM), PWM, PWM)

    up, down = np.gradient(triangle) > 1e-6, np.gradient(triangle) < -1e-6
    away = np.abs(np.abs(triangle - 0.5) - 0.2) > 2.2 * play  # from the reversals
    assert moved[4000:][(up & away)[4000:]] == pytest.approx(
        triangle[4000:][(up & away)[4000:]] - play, abs=1e-3
    )
    assert moved[4000:][(down & away)[4000:]] == pytest.approx(
        triangle[4000:][(down & away)[4000:]] + play, abs=1e-3
    )


def test_commands_within_the_play_move_nothing():
    plant = joint(valve_hysteresis__play_share=0.03)
    small = 0.5 + 0.029 * np.sin(0.02 * np.arange(3000))

    assert quantity(plant, run(plant, small, PWM), PWM, PWM) == pytest.approx(0.5, abs=1e-9)


def test_a_stuck_band_is_shut_inside_and_open_beyond():
    assert float(shut_while_stuck(0.029, 0.03)) == pytest.approx(1.0, abs=1e-9)
    assert float(shut_while_stuck(-0.4, 0.03)) == pytest.approx(1.0, abs=1e-9)
    assert float(shut_while_stuck(0.03 + EDGE, 0.03)) == 0.0
    assert float(shut_while_stuck(-0.4, 0.0)) == 0.0


def test_a_stuck_spool_of_the_reservoir_lets_no_air_out_until_the_command_has_left_the_band():
    plant = tank(valve_stuck_band__band_share=0.1, valve__leak_area_m2=0.0)
    held, let_go = (run(plant, np.full(500, u), VOLTS, 5e5)[TANK] for u in (3.8, 3.0))
    free = run(tank(valve__leak_area_m2=0.0), np.full(500, 3.8), VOLTS, 5e5)[TANK]

    assert held[-1] == pytest.approx(5e5, rel=1e-3)
    assert free[-1] < 4.5e5
    assert let_go[-1] < 3e5


@pytest.mark.parametrize("share", [0.2, 0.4])
def test_restrictions_scale_the_flow_of_their_own_path_alone(share):
    """From the atmosphere up by the supply, from the supply down by the exhaust, choked."""
    model = PLANTS["soft_joint"]().lean().model
    for field, opened, shut, p in (
        ("supply_restriction_share", 1.0, 0.0, 1.5e5),
        ("exhaust_restriction_share", 0.0, 1.0, 5e5),
    ):
        bare, narrow = joint(), joint(**{f"valve__{field}": share})
        flows = [
            [float(model.f(p, pwm, [], plant.nominal[2])[0]) for pwm in (opened, shut)]
            for plant in (bare, narrow)
        ]

        assert flows[1][0] == pytest.approx((1 - share) * flows[0][0], rel=2e-2)
        assert flows[1][1] == pytest.approx(flows[0][1], rel=1e-2)


@pytest.mark.parametrize(
    ("field", "value", "command_v", "pressure_pa", "expected"),
    [
        ("supply_restriction_share", 0.3, 10.0, 1.5e5, 0.7),
        ("supply_restriction_share", 0.3, 0.0, 5e5, 1.0),
        ("discharge_asymmetry", 0.15, 10.0, 1.5e5, 1.15),
        ("discharge_asymmetry", 0.15, 0.0, 5e5, 0.85),
        ("area_exponent_change", -0.6, 7.685, 1.5e5, 0.5 / (1 - 0.5**1.6)),  # s = 0.5
        ("area_exponent_change", -0.6, 10.0, 1.5e5, 1.0),
        ("critical_ratio_change", -0.15, 10.0, 2e5, 0.993938),
        ("critical_ratio_change", -0.15, 10.0, 0.8 * 7e5, 0.912522),
    ],
)
def test_the_flaws_of_the_five_port_valve_scale_the_flow_they_are_meant_to(
    field, value, command_v, pressure_pa, expected
):
    """Ratio of the pressure rates of the reservoir, without leak and heat."""
    still = {"valve__leak_area_m2": 0.0, "wall_heat__coefficient_w_m2_k": 0.0}
    x = np.array([pressure_pa, pressure_pa * 0.344e-3 / (288.0 * 293.15)])
    bare, flawed = tank(**still), tank(**still, **{f"valve__{field}": value})
    rates = [float(q.model.f(x, command_v, [], q.nominal[2])[0][0]) for q in (bare, flawed)]

    assert rates[1] / rates[0] == pytest.approx(expected, rel=1e-5)


def test_discharge_asymmetry_follows_the_direction_of_the_flow():
    """In with 1 + e, out with 1 - e, also where air flows back into the supply."""
    bare, uneven = joint(), joint(valve__discharge_asymmetry=0.15)
    for p, pwm, expected in ((2e5, 1.0, 1.15), (5e5, 0.0, 0.85), (6e5, 1.0, 0.85)):
        rates = [float(q.model.f(p, pwm, [], q.nominal[2])[0]) for q in (bare, uneven)]

        assert rates[1] / rates[0] == pytest.approx(expected, rel=3e-3)


def test_a_line_delays_by_three_milliseconds_a_metre_and_weakens_the_flow():
    plant = joint(line_delay__length_m=2.0)
    recording = Recording("step", DT, {PWM: np.where(np.arange(100) < 50, 0.5, 0.9)})
    late = inputs(plant, recording)[0][0]
    rates = [float(q.model.f(2e5, 0.9, [], q.nominal[2])[0]) for q in (joint(), plant)]

    assert pytest.approx(3e-3, rel=0.05) == 1.0 / SOUND_M_S
    assert late[54] == 0.5
    assert late[55] == pytest.approx(0.9 - 0.4 * (2.0 / SOUND_M_S / DT - 5.0))
    assert 0.9 < rates[1] / rates[0] < 0.99


def test_an_area_shape_bends_the_opening_and_keeps_its_ends():
    """1 - (1 - s)^(1 + e): 0 at 0, 1 at 1, above the straight line between."""
    straight, bent = joint(), joint(valve__area_exponent_change=0.6)
    rates = [
        [float(q.model.f(2e5, pwm, [], q.nominal[2])[0]) for pwm in (0.76, 1.0)]
        for q in (straight, bent)
    ]

    assert rates[1][0] / rates[0][0] == pytest.approx((1 - 0.5**1.6) / 0.5, rel=1e-2)
    assert rates[1][1] / rates[0][1] == pytest.approx(1.0, rel=1e-2)


def test_the_flow_shape_turns_the_nozzle_into_the_iso_law():
    """At r = 0.8 and b = 0.3 the share is 0.699854 (physics.md 10)."""
    plant = joint(valve__iso_share=1.0, valve__critical_ratio=0.3)
    p = 0.8 * 5.5e5
    choked, subsonic = (float(plant.model.f(q, 1.0, [], plant.nominal[2])[0]) for q in (1.1e5, p))

    assert subsonic / choked == pytest.approx(0.699854, rel=2e-3)


def test_a_creeping_wall_lets_the_pressure_sag_after_a_step_although_the_valve_is_shut():
    plant = joint(bellows_creep__creep_m3_pa=2e-10, bellows_creep__creep_time_s=1.0)
    shut = plant.with_values({"valve.flow_area_m2": 1e-9})
    pressure = run(shut, np.full(8001, 0.5), PWM, 4e5)[BELLOWS]
    expected = 4e5 * (0.5e-3 / (0.5e-3 + 2e-10 * (pressure[-1] - 1.013e5))) ** 1.4

    assert (np.diff(pressure) <= 0).all()
    assert pressure[-1] == pytest.approx(expected, rel=1e-3)
    assert pressure[-1] < 3.6e5


def test_the_soft_joint_keeps_its_energy_while_its_wall_gives_way():
    """d(p V)/(kappa - 1) + p dV = c_p sum(mdot T), at random states (physics.md 1.2)."""
    plant = joint(bellows__expansion_m3_pa=2.5e-10, bellows_creep__creep_m3_pa=2e-10)
    model, own, kappa = plant.model, plant.model.conditions["bellows"], 1.4
    rate = model.rates[model.states.index(BELLOWS)]
    grown = own.volume_rate_m3_s + own.compliance_m3_pa * rate
    stored_w = (rate * own.volume_m3 + own.pressure_pa * grown) / (kappa - 1)
    work_w = own.pressure_pa * grown
    flow = model.flows["valve", "MassFlow", "bellows"]
    heat_capacity = kappa / (kappa - 1) * own.gas_constant_j_kg_k
    balance = ca.vertcat(stored_w + work_w, heat_capacity * flow * 293.15)
    both = ca.Function("both", [*model.symbols], [balance])
    rng = np.random.default_rng(8)
    for _ in range(50):
        x = [rng.uniform(1e5, 5.5e5), rng.uniform(0, 4e5)]
        gained, carried = both(x, rng.uniform(0, 1), [], plant.nominal[2]).full().ravel()

        assert gained == pytest.approx(carried, rel=1e-10, abs=1e-9)


def test_a_sensor_scale_multiplies_what_is_read_and_not_what_is():
    scaled = tank(**{"sensor_scale@reservoir.pressure__scale_change": 0.05})
    command = np.full(300, 6.0)

    assert run(scaled, command, VOLTS)[TANK] == pytest.approx(
        1.05 * run(tank(), command, VOLTS)[TANK], rel=1e-12
    )


def test_a_spool_lag_on_a_pwm_command_is_first_order():
    plant = joint(valve_lag__time_constant_s=0.02)
    result = run(plant, np.full(200, 0.9), PWM)
    time_s = DT * np.arange(200)

    assert result["valve_lag.lagged_share"] == pytest.approx(
        0.9 - 0.4 * np.exp(-time_s / 0.02), abs=1e-4
    )


def test_a_design_does_without_play_and_sensor_lag_even_before_a_spool_lag():
    values = {
        "sensor_lag@chamber_a.pressure.time_constant_s": 10e-3,
        "valve_hysteresis.play_share": 0.02,
    }
    flawed = PLANTS["servo_drive"]().with_values(values | {"valve_lag.time_constant_s": 0.01})
    design = design_model(flawed)

    assert set(design.states) == set(design_model(PLANTS["servo_drive"]()).states)
    assert {"valve_hysteresis", "sensor_lag@chamber_a.pressure"} <= {
        each.what for each in design.left_out
    }


def polytropic(drive):
    parts = (
        replace(part, level=PolytropicLevel()) if hasattr(part, "level") else part
        for part in drive.parts
    )
    return replace(drive, parts=tuple(parts))


@pytest.mark.parametrize(("pressure_pa", "gas_k"), [(1e5, 187.0), (5.65e5, 293.15)])
def test_the_polytropic_level_ties_the_temperature_to_the_pressure(pressure_pa, gas_k):
    """T(1 bar) = 187 K for ever (erratum E002-7)."""
    found = PolytropicLevel().temperature_k(pressure_pa, 1e-4, None)

    assert float(found) == pytest.approx(gas_k, abs=0.5)


def test_the_polytropic_drive_moves_as_the_full_one_but_for_a_few_millimetres(drive):
    """Physics.md 6: 1.4 mm on average and 3.4 mm at most over 8 s of the paper's sine."""
    command = 4.95 + 0.8 * np.sin(np.pi * DT * np.arange(8001))
    recording = Recording("sine", DT, {VOLTS: command})
    full, reduced = (simulate(q, recording)["slide.position_m"] for q in (drive, polytropic(drive)))
    off_mm = 1e3 * np.abs(full - reduced)

    assert off_mm.mean() == pytest.approx(1.4, rel=0.3)
    assert off_mm.max() == pytest.approx(3.4, rel=0.3)


@pytest.mark.parametrize(
    ("start_bar", "bar_per_s"), [(1.0, 0.44), (3.0, 0.37), (5.65, 0.0), (7.0, -0.24)]
)
def test_a_closed_polytropic_chamber_never_rests_except_at_its_reference(
    drive, start_bar, bar_per_s
):
    """Erratum E002-7, physics.md 1.2 level 2: the full chamber a, always towards P_0."""
    shut = polytropic(drive).with_values({"valve.leak_area_m2": 0.0})
    states, x = shut.model.states, shut.initial
    x[states.index("chamber_a.pressure_pa")] = start_bar * 1e5
    x[states.index("slide.position_m")] = 0.290
    rates = shut.model.f(x, 4.95, [], shut.nominal[2])[0].full().ravel()

    assert "chamber_a.mass_kg" not in states
    assert rates[states.index("chamber_a.pressure_pa")] / 1e5 == pytest.approx(bar_per_s, abs=0.006)
