"""Linear MPC of the servo drive at its limits, horizon 30: DAQP, the usual solver, beside OSQP.

OSQP is there twice: as the package offers it, which keeps nothing between two programs, and with
its factors kept and looser tolerances, which is as fast as it gets.  Sixty states drawn over the
whole range; counted are those in which a limit is active.  The error is that of
the first opening against the same program solved by cvxpy with Clarabel.

Run it with ``pytest tests/benchmarks -s --benchmark-enable``.  Process time counts, because other
work on the machine would count in wall time; nothing is asserted about it.
"""

import time

import cvxpy as cp
import numpy as np
import osqp
import pytest
import scipy.sparse as sp

from controllers.condensed import MpcSpec
from controllers.linear_mpc import limited_plan, linear_mpc
from controllers.program_solvers import Osqp
from linearize.standard import standard_modes
from workbench.plants.servo_drive import servo_drive

MILLIVOLT = 1e-3
SETTINGS = dict(eps_abs=1e-5, eps_rel=1e-5, polishing=True, max_iter=2000, verbose=False)


@pytest.fixture(scope="module")
def programs():
    made = linear_mpc(standard_modes(servo_drive()), MpcSpec(horizon=30))
    return made.programs.forward


def cases(programs):
    """Program, gradient and sides where the optimum without limits breaks one."""
    rng = np.random.default_rng(0)
    for _ in range(60):
        program = programs[rng.integers(len(programs))]
        pressures = rng.uniform(2e5, 6.9e5, 2)
        x = np.array([rng.uniform(0.05, 0.24), rng.uniform(-1.0, 1.0), *pressures])
        place_m = np.clip(x[0] + rng.uniform(-0.03, 0.03), 0.002, 0.288)
        unforced = program.unforced(x, 0.0)
        targets = np.tile([place_m, 0.0, 5e5, 5e5], program.horizon)
        g = program.gradient(unforced, targets, 0.0, 0.0)
        low, high = program.bounds(unforced, 0.0)
        at = program.rows @ (-program.inverse @ g)
        if (at < low).any() or (at > high).any():
            yield program, g, low, high


def by_osqp(solvers, program, g, low, high):
    if program.horizon not in solvers.setdefault(id(program), {}):
        solver = osqp.OSQP()
        H, rows = sp.csc_matrix(np.triu(program.H)), sp.csc_matrix(program.rows)
        solver.setup(H, g, rows, low, high, **SETTINGS)
        solvers[id(program)][program.horizon] = solver
    solver = solvers[id(program)][program.horizon]
    begun = time.process_time()
    solver.update(q=g, l=low, u=high)
    found = solver.solve(raise_error=False).x[0]
    return found, time.process_time() - begun


def by_our_osqp(program, g, low, high):
    begun = time.process_time()
    z, _ = Osqp().solved(program, g, low, high, None)
    return z[0], time.process_time() - begun


def by_daqp(program, g, low, high):
    begun = time.process_time()
    plan, notes = limited_plan(program, g, low, high, None, 0.0)
    assert notes["fallback"] == 0.0
    return plan.openings[0], time.process_time() - begun


def exact(program, g, low, high):
    z, root = cp.Variable(len(g)), np.linalg.cholesky(program.H).T
    below, above = np.isfinite(low), np.isfinite(high)
    sides = [program.rows[below] @ z >= low[below], program.rows[above] @ z <= high[above]]
    cost = 0.5 * cp.sum_squares(root @ z) + g @ z
    cp.Problem(cp.Minimize(cost), sides).solve(solver=cp.CLARABEL)
    return z.value[0]


def test_a_step_at_a_limit_is_exact_to_a_millivolt(benchmark, programs):
    every = list(cases(programs))
    assert len(every) > 20
    chosen = every if benchmark.enabled else every[:5]
    solvers: dict = {}
    rows = [(exact(*c), *by_daqp(*c), *by_our_osqp(*c), *by_osqp(solvers, *c)) for c in chosen]
    truth, ours, our_s, other, other_s, theirs, their_s = np.array(rows).T
    benchmark.pedantic(by_daqp, every[0], rounds=20)
    if benchmark.enabled:
        found_by = {
            "DAQP": (ours, our_s),
            "OSQP": (other, other_s),
            "OSQP, factors kept": (theirs, their_s),
        }
        for name, (found, spent) in found_by.items():
            median, p99 = 1e3 * np.median(spent), 1e3 * np.percentile(spent, 99)
            worst_mv = 1e3 * np.abs(found - truth).max()
            print(f"\n{name}: median {median:.3f} ms, p99 {p99:.3f} ms, off by {worst_mv:.2g} mV")

    assert np.abs(ours - truth).max() < MILLIVOLT
    assert np.abs(other - truth).max() < MILLIVOLT
