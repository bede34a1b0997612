"""How far our compiled step is from C written by hand: ``floor.c``, in the same run.

Run it with ``pytest tests/benchmarks/test_floor.py -m "" -s --benchmark-enable``.  The floor has
the rates of ``model.f``, our steps and so our error; what ours takes beyond it is the price of code
that is generated from parts, and of calling it from CasADi.  Both take turns, because the speed of
a machine that does other work changes from second to second.
"""

import ctypes
import os
import time
from itertools import islice
from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from reference_solution import reference
from test_servo_drive import ORACLE_STATES, PRESSURES, random_states
from test_speed import CASES, DT, ours

from workbench import compiled
from workbench.air import CRITICAL_RATIO, HEAT_CAPACITY_RATIO, LAMINAR_RATIO, choked_constant
from workbench.effects.bristle_friction import BREAKAWAY_SHARE, NEGLIGIBLE_FORCE_N
from workbench.rosenbrock import FINER, LEVELS

COMMAND = np.ascontiguousarray(CASES["sine"][:1001])
ROUNDS = 30
BELOW_ANY_SENSOR = (1e-6, 5.0)  # m and Pa: where a step of either just passes, errors may differ


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The floor, compiled as our step is."""
    wanted = os.environ.get("CC", ""), os.environ.get("WORKBENCH_NO_COMPILER", "")
    compiler = compiled._compiler(*wanted)
    if not compiler:
        pytest.skip("there is no C compiler here")
    path = tmp_path_factory.mktemp("floor") / "floor.so"
    code = Path(__file__).with_name("floor.c").read_text(encoding="utf-8")
    compiled._compile(code, path, (*compiler, "-O2", "-std=c11", *compiled.FLAGS))
    found = ctypes.CDLL(str(path))
    column, number = np.ctypeslib.ndpointer(float, flags="C"), ctypes.c_double
    found.rates.argtypes = [column, column, number, column]
    found.simulate.argtypes = [
        column, column, ctypes.c_long, number, ctypes.c_int, ctypes.c_int, column,
    ]  # fmt: skip
    found.rates.restype = found.simulate.restype = None
    return found


def constants(drive):
    """The plant's values as ``Drive`` of floor.c, which is doubles only: its names in its order."""
    v, k = drive.values, HEAT_CAPACITY_RATIO
    gas = next(part.gas_constant_j_kg_k for part in drive.parts if part.name == "chamber_a")
    cracking, cooled = v["valve.cracking_ratio"], CRITICAL_RATIO ** ((k - 1.0) / k)
    static_n = v["friction.coulomb_force_n"] + v["friction.stiction_excess_n"]
    breakaway_m = v["friction.breakaway_deflection_m"]
    rest = v["wall_heat.reference_pressure_pa"] * v["wall_heat.reference_temperature_k"]
    filled = dict(
        supply_pa=v["supply.pressure_pa"],
        supply_k=v["supply.temperature_k"],
        atmosphere_pa=v["atmosphere.pressure_pa"],
        atmosphere_k=v["atmosphere.temperature_k"],
        gas_constant=gas,
        kappa=k,
        temperature_exponent=(k - 1.0) / k,
        choked_constant=choked_constant(gas),
        critical_ratio=CRITICAL_RATIO,
        laminar_ratio=LAMINAR_RATIO,
        subsonic_factor=cooled / CRITICAL_RATIO / sqrt(1.0 - cooled),
        centre_v=v["valve.centre_v"],
        half_width_v=v["valve_dead_zone.half_width_v"],
        full_v=v["valve.full_v"],
        area_exponent=v["valve.area_exponent"],
        flow_m2=v["valve.discharge_coefficient"] * v["valve.flow_area_m2"],
        leak_m2=v["valve.leak_area_m2"],
        supply_fraction=v["valve.supply_fraction"],
        exhaust_fraction=v["valve.exhaust_fraction"],
        supply_critical_ratio=v["valve.supply_critical_ratio"],
        exhaust_critical_ratio=v["valve.exhaust_critical_ratio"],
        cracking_ratio=cracking,
        regular_ratio=min(LAMINAR_RATIO * cracking, cracking - 1e-4),
        subsonic_index=v["valve.subsonic_index"],
        area_m2=v["chamber_a.area_m2"],
        perimeter_m=sqrt(4.0 * pi * v["chamber_a.area_m2"]),
        stroke_m=v["chamber_a.stroke_m"],
        dead_a_m3=v["chamber_a.dead_volume_m3"],
        dead_b_m3=v["chamber_b.dead_volume_m3"],
        per_kg=1.0 / v["slide.mass_kg"],
        film=v["wall_heat.coefficient_w_m2_k"] / sqrt(rest),
        forward=direction(v, +1.0),
        backward=direction(v, -1.0),
        per_stribeck_s_m=1.0 / v["friction.stribeck_velocity_m_s"],
        limit_m_n=breakaway_m / (static_n + NEGLIGIBLE_FORCE_N),
        breakaway_share=BREAKAWAY_SHARE,
        stiffness_n_m=static_n / breakaway_m,
        damping_n_s_m=static_n / breakaway_m * v["friction.bristle_time_s"],
        stop_n_m=v["stops.stiffness_n_m"],
        stop_n_s_m=v["stops.damping_n_s_m"],
        per_tolerance=1.0 / drive.model.tolerances,
    )
    return np.hstack([*filled.values()])


def direction(v, side):
    """Coulomb force and excess of static friction in N, viscous friction in N s/m."""
    share = side * v["friction.asymmetry"]
    coulomb_n = v["friction.coulomb_force_n"] * (1.0 + v["friction.coulomb_weight"] * share)
    excess_n = v["friction.stiction_excess_n"] * (1.0 + v["friction.excess_weight"] * share)
    return coulomb_n + NEGLIGIBLE_FORCE_N, excess_n, v["friction.viscous_n_s_m"] * (1.0 + share)


def by_hand(drive, library, command):
    """What runs the floor over a command: states at every sample, shape (n, n_x)."""
    filled, x = constants(drive), np.empty((len(command), len(drive.model.states)))
    x[0] = drive.initial

    def run():
        library.simulate(filled, command, len(command), DT, LEVELS, FINER, x)
        return x

    return run


def test_the_floor_has_the_rates_of_the_plant(drive, library):
    model, p, filled = drive.model, drive.nominal[2], constants(drive)
    order = [ORACLE_STATES.index(name) for name in model.states]
    found = np.empty(len(order))
    for state, u in islice(random_states(), 100):
        x = state[order]
        library.rates(filled, x, u, found)

        np.testing.assert_allclose(found, model.f(x, u, [], p)[0].full().ravel(), 1e-9)


@pytest.mark.slow
@pytest.mark.benchmark(timer=time.process_time)
def test_a_second_of_the_sine_by_hand_and_by_us(benchmark, drive, library):
    by_us = ours(drive, drive.model.compiled_block(DT), COMMAND)
    floor = by_hand(drive, library, COMMAND)
    benchmark.pedantic(floor, rounds=ROUNDS, warmup_rounds=1)
    exact = reference(drive, COMMAND, DT)
    own, least = worst(drive, by_us().full() - exact[:, 1:]), worst(drive, floor().T - exact)
    if benchmark.enabled:
        took_us = np.array([[spent_us(by_us), spent_us(floor)] for _ in range(ROUNDS)])
        (own_us, least_us), ratio = took_us.min(axis=0), np.median(took_us[:, 0] / took_us[:, 1])
        benchmark.extra_info.update(ours_us=own_us, floor_us=least_us, ours_over_floor=ratio)
        print(f"\nours {own_us:.2f}, floor {least_us:.2f} us a sample at best; ours takes "
              f"{ratio:.1f} times as long (median of {ROUNDS} turns); worst error of ours "
              f"{own[0]:.3g} m, {own[1]:.3g} Pa, of the floor {least[0]:.3g} m, {least[1]:.3g} Pa"
        )  # fmt: skip

    assert (least <= np.maximum(own, BELOW_ANY_SENSOR)).all()


def worst(drive, error):
    """Largest error of the position in m and of the pressures in Pa."""
    size = np.abs(error).max(axis=1)
    kinds = ("slide.position_m",), PRESSURES
    return np.array([max(size[drive.model.states.index(name)] for name in kind) for kind in kinds])


def spent_us(run):
    """Process time of one run, in microseconds per sample."""
    start = time.process_time()
    run()
    return 1e6 * (time.process_time() - start) / (len(COMMAND) - 1)
