"""The smooth sine of the servo drive by us and by others, in one run: speed beside error.

Run it with ``pytest tests/benchmarks/test_rivals.py -s --benchmark-enable``.  Every rival gets the
rates of ``model.f`` and the sine as its own interface takes it: python-control and the one call of
cvodes as a function of time, the others held between samples as ours is.  Each error is that
against a tight solution with the same command; tolerances are the loosest that come near ours.
do-mpc is no dependency: its line is left out where it is not installed.  ``test_speed.py`` has
scipy restarted at every sample.
"""

import time

import casadi as ca
import control
import numpy as np
import pytest
from reference_solution import reference
from scipy.integrate import solve_ivp

from workbench.model import run_of

DT = 1e-3
SAMPLES = 1001
TIME_S = DT * np.arange(SAMPLES)
MIDDLE_V, HEIGHT_V = 4.95, 0.8
HELD_V = MIDDLE_V + HEIGHT_V * np.sin(np.pi * TIME_S)
RELATIVE, SHARE = 1e-5, 1e-7  # tolerances of the rivals, the second of a state's typical size


def smooth_v(t):
    return MIDDLE_V + HEIGHT_V * np.sin(np.pi * t)


def rates_at(drive, u):
    """dx/dt at a state, with the command as a function of time."""
    f, p = drive.model.f, drive.nominal[2]
    return lambda t, x: f(x, u(t), [], p)[0].full().ravel()


def by_ours(drive, block):
    run = run_of(block, SAMPLES - 1)
    p, none = drive.nominal[2], np.zeros((0, SAMPLES - 1))
    return lambda: run(drive.initial, HELD_V[None, :-1], none, p).full()


def by_scipy(drive, method, share=SHARE, relative=RELATIVE):
    slopes = drive.model.jacobians
    p = drive.nominal[2]

    def run():
        found = solve_ivp(
            rates_at(drive, smooth_v),
            (0.0, TIME_S[-1]),
            drive.initial,
            method,
            t_eval=TIME_S[1:],
            jac=lambda t, x: slopes(x, smooth_v(t), [], p)[0].full(),
            rtol=relative,
            atol=share * drive.scale,
        )
        return found.y

    return run


def by_python_control(drive):
    f, p = drive.model.f, drive.nominal[2]
    n = len(drive.model.states)
    system = control.nlsys(
        lambda t, x, u, params: f(x, u, [], p)[0].full().ravel(), None, inputs=1, states=n
    )
    options = dict(rtol=RELATIVE, atol=SHARE * drive.scale)

    def run():
        found = control.input_output_response(
            system, TIME_S, smooth_v(TIME_S), drive.initial,
            solve_ivp_method="LSODA", solve_ivp_kwargs=options,
        )  # fmt: skip
        return found.states[:, 1:]

    return run


def by_cvodes(drive):
    x, u, _, p = drive.model.symbols
    t = ca.SX.sym("t")
    rates = ca.substitute(drive.model.rates, u, MIDDLE_V + HEIGHT_V * ca.sin(np.pi * t))
    ode = {"x": x, "t": t, "p": p, "ode": rates}
    options = {"reltol": RELATIVE, "abstol": 1e-9, "max_num_steps": 100_000}
    solver = ca.integrator("cvodes", "cvodes", ode, 0.0, list(TIME_S[1:]), options)
    return lambda: solver(x0=drive.initial, p=drive.nominal[2])["xf"].full()


def by_do_mpc(drive):
    do_mpc = pytest.importorskip("do_mpc")
    model = do_mpc.model.Model("continuous", "SX")
    names = [name.replace(".", "_") for name in drive.model.states]
    x = [model.set_variable("_x", name) for name in names]
    u = model.set_variable("_u", "command")
    rates = drive.model.f(ca.vertcat(*x), u, [], drive.nominal[2])[0]
    for k, name in enumerate(names):
        model.set_rhs(name, rates[k])
    model.setup()
    simulator = do_mpc.simulator.Simulator(model)
    simulator.settings.t_step = DT
    simulator.settings.reltol, simulator.settings.abstol = RELATIVE, 1e-9
    simulator.setup()

    def run():
        simulator.reset_history()
        simulator.x0 = drive.initial
        states = [simulator.make_step(np.array([[v]])).ravel() for v in HELD_V[:-1]]
        return np.array(states).T

    return run


RIVALS = {
    "ours, virtual machine": lambda drive: by_ours(drive, drive.model.block(DT)),
    "ours, machine code": lambda drive: by_ours(drive, drive.model.compiled_block(DT)),
    "scipy LSODA, one call": lambda drive: by_scipy(drive, "LSODA"),
    "scipy Radau, one call": lambda drive: by_scipy(drive, "Radau"),
    "python-control": by_python_control,
    "casadi cvodes, one call": by_cvodes,
    "do-mpc": by_do_mpc,
}
HELD = ("ours, virtual machine", "ours, machine code", "do-mpc")


@pytest.fixture(scope="module")
def took_s():
    """Process time of each rival so far, by name: ours come first."""
    return {}


@pytest.mark.slow
@pytest.mark.benchmark(timer=time.process_time)
@pytest.mark.parametrize("name", RIVALS)
def test_a_second_of_the_sine(benchmark, drive, took_s, name):
    run = RIVALS[name](drive)
    quick = name.startswith("ours") or "cvodes" in name
    found = benchmark.pedantic(run, rounds=5 if quick else 1, warmup_rounds=int(quick))
    exact = reference(drive, HELD_V, DT)[:, 1:] if name in HELD else smooth_reference(drive)
    off = np.abs(found - exact)
    error_mm, error_pa = 1e3 * off[0].max(), off[pressures(drive)].max()
    if benchmark.enabled:
        took_s[name] = benchmark.stats.stats.min
        ratio = took_s[name] / took_s["ours, virtual machine"]
        speed = TIME_S[-1] / took_s[name]
        print(f"\n{name}: {speed:.2f} times real time, {ratio:.2f} times our virtual machine's "
              f"time; worst {error_mm:.5f} mm, {error_pa:.0f} Pa")  # fmt: skip

    assert error_mm < 0.02 and error_pa < 400.0


def pressures(drive):
    return [k for k, name in enumerate(drive.model.states) if name.endswith("pressure_pa")]


def smooth_reference(drive):
    return by_scipy(drive, "Radau", share=1e-10, relative=1e-9)()
