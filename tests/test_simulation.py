"""Simulation against what must be conserved, and against a tight reference solution."""

import pickle

import casadi as ca
import numpy as np
import pytest
from reference_solution import reference

from workbench.air import HEAT_CAPACITY_RATIO
from workbench.compiled import compiled
from workbench.effect import Force, HeatFlow, MassFlow
from workbench.parts import Body, Chamber
from workbench.plant import Plant, Signal
from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.rosenbrock import controlled_step
from workbench.simulation import simulate

DT = 1e-3
COMMAND, POSITION, PRESSURE = "valve.command_v", "slide.position_m", "chamber_a.pressure_pa"
AIR_J_KG_K, ROOM_K = 287.0, 293.15


def commanded(values, sample_time_s=DT):
    return Recording("commands", sample_time_s, {COMMAND: np.asarray(values, dtype=float)})


def times(duration_s):
    return DT * np.arange(round(duration_s / DT) + 1)


def sine(duration_s):
    return 4.95 + 0.8 * np.sin(np.pi * times(duration_s))


def full_voltage(duration_s):
    return np.where(times(duration_s) % 1.0 < 0.5 - 1e-9, 10.0, 0.0)


def closed_chamber(mass_kg):
    """A chamber without valve, leak or heat, and the body that closes it."""
    chamber = Chamber(
        name="chamber", body="piston", side=1, area_m2=1e-3, stroke_m=0.2, initial_position_m=0.1,
        dead_volume_m3=1e-9,
    )  # fmt: skip
    return Plant(
        name="closed_chamber",
        parts=(Body(name="piston", mass_kg=mass_kg, initial_position_m=0.1), chamber),
        commands=(Signal("nothing.at_all_v", 0.0),),
        measured=("chamber.pressure_pa",),
    )


def moved(plant, velocity_m_s, duration_s, sample_time_s):
    """States by name while the piston moves, from 1 bar and 100 cm3."""
    start = dict(zip(plant.model.states, plant.initial, strict=True))
    start["piston.velocity_m_s"] = velocity_m_s
    nothing = np.zeros(round(duration_s / sample_time_s) + 1)
    given = Recording("nothing", sample_time_s, {"nothing.at_all_v": nothing})
    return simulate(plant, given, np.array([*start.values()]))


def test_a_closed_chamber_keeps_its_gas_and_without_heat_its_p_v_to_the_1_4():
    """A free piston thrown against the gas; our own step at 0.02 ms."""
    plant = closed_chamber(mass_kg=0.5)
    seen = moved(plant, velocity_m_s=-8.0, duration_s=0.02, sample_time_s=2e-5)
    volume_m3 = 1e-9 + 1e-3 * seen["piston.position_m"]
    adiabat = seen["chamber.pressure_pa"] * volume_m3**HEAT_CAPACITY_RATIO

    assert volume_m3.min() < 0.7 * volume_m3[0]
    np.testing.assert_allclose(seen["chamber.mass_kg"], seen["chamber.mass_kg"][0], rtol=1e-9)
    np.testing.assert_allclose(adiabat, adiabat[0], rtol=1e-8)


def test_halving_a_volume_adiabatically_gives_2_639_bar_and_387_kelvin():
    plant = closed_chamber(mass_kg=1e9)  # so heavy that the gas does not slow it
    seen = moved(plant, velocity_m_s=-1.0, duration_s=0.05, sample_time_s=1e-4)
    pressure_pa, mass_kg = seen["chamber.pressure_pa"][-1], seen["chamber.mass_kg"][-1]

    assert pressure_pa == pytest.approx(2.63902e5, rel=2e-5)  # 1e-5 is dead volume
    assert pressure_pa * 5e-5 / (mass_kg * AIR_J_KG_K) == pytest.approx(386.81, abs=0.01)


def powers(plant):
    """Energy stored in J, and what crosses the border in W: enthalpy, heat, friction and stops."""
    model = plant.model
    values = dict(zip(model.parameters, ca.vertsplit(model.symbols[3]), strict=True))
    now = model.conditions
    terms = [t for effect in plant.with_values(values).effects for t in effect.terms(now)]
    enthalpy = heat = work = 0.0
    for term in terms:
        if isinstance(term, MassFlow) and term.balance.startswith("chamber"):
            c_p = now[term.balance].gas_constant_j_kg_k * HEAT_CAPACITY_RATIO / 0.4
            enthalpy += c_p * term.value * term.temperature_k
        elif isinstance(term, HeatFlow):
            heat += term.value
        elif isinstance(term, Force):
            work += term.value * now["slide"].velocity_m_s
    gas = sum(now[c].pressure_pa * now[c].volume_m3 / 0.4 for c in ("chamber_a", "chamber_b"))
    kinetic = 0.5 * values["slide.mass_kg"] * now["slide"].velocity_m_s ** 2
    return gas + kinetic, ca.vertcat(enthalpy, heat, work)


def test_no_energy_is_lost_or_made_over_the_sine(drive):
    """Kinetic energy and gas against enthalpy, heat, friction and stops, to 1e-6 of the enthalpy.

    Our own step at 1/16 ms, with the powers integrated as states beside the plant's own.
    """
    model, (_, _, p) = drive.model, drive.nominal
    stored, power = powers(drive)
    x, u, d, ps = model.symbols
    passed = ca.SX.sym("passed_j", 3)
    wide = np.append(model.tolerances, [np.inf] * 3)
    symbols, dt = (ca.vertcat(x, passed), u, d, ps), DT / 16
    step = controlled_step(symbols, ca.vertcat(model.rates, power), dt, wide)
    commands = np.repeat(sine(4.0)[:-1], 16)[None]
    start = np.append(drive.initial, np.zeros(3))
    end = compiled(step).mapaccum(commands.shape[1])(start, commands, [], p)[:, -1].full().ravel()
    energy = ca.Function("energy", [x, u, d, ps], [stored])
    gained_j = float(energy(end[:-3], 4.95, [], p) - energy(drive.initial, 4.95, [], p))
    size_j = np.abs(end[-3:]).max()

    assert size_j > 10.0
    assert gained_j == pytest.approx(end[-3:].sum(), abs=1e-6 * size_j)


def errors(drive, command, contact=False):
    """Largest and mean error of the position in m, largest of the pressures in Pa."""
    result = simulate(drive, commanded(command))
    exact = dict(zip(drive.model.states, reference(drive, command, DT, contact), strict=True))
    position_m = np.abs(result[POSITION] - exact[POSITION])
    pressures = ("chamber_a.pressure_pa", "chamber_b.pressure_pa")
    pressure_pa = np.max([np.abs(result[name] - exact[name]).max() for name in pressures])
    return position_m.max(), position_m.mean(), pressure_pa


FULL = pytest.mark.slow


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(sine(0.25), id="sine, first quarter second"),
        pytest.param(np.full(1501, 5.385), id="stick-slip, 1.5 s"),
        pytest.param(sine(4.0), id="sine, 4 s", marks=FULL),
        pytest.param(np.full(20_001, 5.385), id="stick-slip, 20 s", marks=FULL),
    ],
)
def test_sliding_and_sticking_stay_within_5_micrometres_and_100_pascal(drive, command):
    worst_m, _, pressure_pa = errors(drive, command)

    assert worst_m < 5e-6
    assert pressure_pa < 100.0


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(full_voltage(0.3), id="one impact"),
        pytest.param(full_voltage(4.0), id="eight strokes", marks=FULL),
    ],
)
def test_full_strokes_into_the_stops_stay_within_50_micrometres_on_average(drive, command):
    worst_m, mean_m, _ = errors(drive, command, contact=True)

    assert simulate(drive, commanded(command))[POSITION].max() > 0.29
    assert mean_m < 0.05e-3
    assert worst_m < 0.5e-3


def test_a_run_is_the_same_whether_at_once_or_sample_by_sample(drive):
    command = full_voltage(0.3)
    at_once = simulate(drive, commanded(command)).rows(drive.model.states)
    step, x = drive.model.step(DT), drive.initial
    for u in command[:-1]:
        x = step(x, u, [], drive.nominal[2]).full().ravel()

    np.testing.assert_array_equal(x, at_once[:, -1])


@pytest.mark.parametrize("command", [sine(1.0), full_voltage(1.0)], ids=["sine", "strokes"])
def test_the_lean_plant_runs_as_the_full_one_with_everything_at_null(command):
    full = PLANTS["servo_drive"]()
    lean, whole = (simulate(p, commanded(command)) for p in (full.lean(), full))

    for name in full.lean().model.states:
        size = np.abs(lean[name]).max()
        np.testing.assert_allclose(whole[name] / size, lean[name] / size, atol=1e-12, err_msg=name)


def test_a_simulation_that_runs_away_says_when():
    plant = closed_chamber(mass_kg=0.5)
    given = Recording("nothing", DT, {"nothing.at_all_v": np.zeros(20)})
    start = np.where(np.array(plant.model.states) == "piston.velocity_m_s", np.nan, plant.initial)

    with pytest.raises(ArithmeticError, match=r"closed_chamber: .* not finite from 0.001 s on"):
        simulate(plant, given, start)


def test_a_recording_without_the_command_is_refused_by_name(drive):
    with pytest.raises(KeyError, match=r"r has no valve.command_v; it has slide.position_m"):
        simulate(drive, Recording("r", DT, {POSITION: np.zeros(5)}))


def test_a_plant_travels_to_another_process_without_its_model(drive):
    """As joblib sends it: CasADi symbols cannot be pickled, and the model is built there."""
    here = simulate(drive, commanded(sine(0.05)))
    there = simulate(pickle.loads(pickle.dumps(drive)), commanded(sine(0.05)))

    np.testing.assert_array_equal(here[POSITION], there[POSITION])
