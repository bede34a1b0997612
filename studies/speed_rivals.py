"""Rivals of the controllers' solvers, on the same programs: for speed and for exactness.

OSQP as the package offers it, with its factors kept; cvxpy with Clarabel, the exact answer; IPOPT
on the nonlinear program; DAQP with twenty binaries; real-time iteration on the whole plant.
Times are CPU time of the calling thread over whole calls from Python, since other work on the
machine would count in wall time; what a rival does in threads of its own is not counted against it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import casadi as ca
import numpy as np

from controllers.condensed import Program
from controllers.linear_mpc import LinearMpc
from controllers.mpc_spec import MpcSpec
from controllers.nonlinear_mpc import NonlinearMpc, along
from controllers.positioning import STATES
from controllers.rollout import Rollout, advance_of
from linearize.discrete import sampled
from linearize.reduction import closed_command
from linearize.shift_modes import gearbox_modes, valve_flows
from workbench.plant import Plant

BLOCKS, BLOCK, BINARY = 10, 4, 16  # ten moves of two valves over 40 ms
LOOSER = dict(eps_abs=1e-5, eps_rel=1e-5, polishing=True, max_iter=2000, verbose=False)
Limited = tuple[Program, np.ndarray, np.ndarray, np.ndarray]
"""A program with its gradient and sides (low, high), whose optimum without limits breaks one."""


def limited(programs: Sequence[Program], number: int, seed: int = 0) -> Iterator[Limited]:
    """Of so many states drawn over the whole range those in which a limit is active."""
    rng = np.random.default_rng(seed)
    for _ in range(number):
        program = programs[rng.integers(len(programs))]
        pressures = rng.uniform(2e5, 6.9e5, 2)
        x = np.array([rng.uniform(0.05, 0.24), rng.uniform(-1.0, 1.0), *pressures])
        place_m = np.clip(x[0] + rng.uniform(-0.03, 0.03), 0.002, 0.288)
        unforced = program.unforced(x, 0.0)
        targets = np.tile([place_m, 0.0, 5e5, 5e5], program.horizon)
        g = program.gradient(unforced, targets, 0.0, 0.0)
        if not program.keeps(program.unlimited(g), unforced, 0.0):
            yield program, g, *program.limits.bounds(unforced, 0.0)


def exact(program: Program, g: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """The first opening by cvxpy and Clarabel."""
    import cvxpy as cp

    z, root = cp.Variable(len(g)), np.linalg.cholesky(program.hessian).T
    below, above = np.isfinite(low), np.isfinite(high)
    sides = [program.rows[below] @ z >= low[below], program.rows[above] @ z <= high[above]]
    cost = 0.5 * cp.sum_squares(root @ z) + g @ z
    cp.Problem(cp.Minimize(cost), sides).solve(solver=cp.CLARABEL)
    return float(z.value[0])


def kept_osqp(cases: Sequence[Limited]) -> tuple[np.ndarray, np.ndarray]:
    """First openings by OSQP and times; a solver for each program is set up beforehand."""
    import osqp
    import scipy.sparse as sp

    solvers: dict[int, Any] = {}
    for program, g, low, high in cases:
        if id(program) not in solvers:
            solver = solvers[id(program)] = osqp.OSQP()
            H, rows = sp.csc_matrix(np.triu(program.hessian)), sp.csc_matrix(program.rows)
            solver.setup(H, g, rows, low, high, **LOOSER)

    def solved(case: Limited) -> float:
        program, g, low, high = case
        solver = solvers[id(program)]
        solver.update(q=g, l=low, u=high)
        return float(solver.solve(raise_error=False).x[0])

    return timed(solved, cases)


def timed(call: Callable[[Any], float], cases: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """What a call gives for each case, and its CPU time in s, shapes (n,)."""
    found, times = [], []
    for case in cases:
        begun = time.thread_time()
        found.append(call(case))
        times.append(time.thread_time() - begun)
    return np.array(found), np.array(times)


@dataclass(frozen=True, kw_only=True)
class WholePlantMpc(NonlinearMpc):
    """Real-time iteration on the whole plant, whose state is told to it."""

    state: np.ndarray

    def _predicted(self, program, asked, now, before):
        steady = np.full(program.horizon, now.opening_v)
        openings = before.shifted().openings if before else steady
        return along(program, self.rollout, self.state, openings, [0.0, asked.force_n])

    def told(self, state: np.ndarray) -> WholePlantMpc:
        """The same with another state."""
        return replace(self, state=state)


def on_whole_plant(reduced: NonlinearMpc, plant: Plant, spec: MpcSpec) -> WholePlantMpc:
    """The design on all states of a plant: gas masses, dead zone and bristle too."""
    model, (_, d, p) = plant.model, plant.nominal
    x, command, *rest = model.symbols
    opening, given = ca.SX.sym("opening"), ca.SX.sym("given", 2)
    rates = ca.substitute([model.rates], [*rest], [ca.DM(d), ca.DM(p)])[0]
    rates = ca.substitute(rates, command, opening + closed_command(plant))
    advance = advance_of(x, opening, given, rates, spec.sample_time_s, 1e-3)
    rollout = Rollout(advance, spec.horizon, tuple(map(model.states.index, STATES)))
    parts = {f.name: getattr(reduced, f.name) for f in fields(reduced)} | {"rollout": rollout}
    return WholePlantMpc(**parts, state=np.zeros(len(model.states)))


def by_ipopt(design: NonlinearMpc, calls: int) -> np.ndarray:
    """Times of the unlinearised program from near-by states, each from the last optimum."""
    program, advance = design.programs.forward[1], design.rollout.advance
    n = program.horizon
    u, start, states = ca.MX.sym("u", n), ca.MX.sym("start", 4), []
    x = start
    for i in range(n):
        x = advance(x, u[i], ca.DM([1.0, 0.0]))
        states.append(x)
    off = ca.vertcat(*states) - np.tile([0.16, 0.0, 5.9e5, 5.0e5], n)
    cost = ca.bilin(ca.DM(program.Q), off, off) + program.R * ca.sumsqr(u)
    cost += program.S * ca.sumsqr(ca.diff(u))
    quiet = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False, "expand": True}
    solver = ca.nlpsol("exact", "ipopt", {"x": u, "p": start, "f": cost}, quiet)
    last = [np.zeros(n)]

    def solved(k: int) -> float:
        given = [0.145 + 2e-4 * k, 0.1, 5.9e5, 5.0e5]
        bounds = {"lbx": program.limits.openings[0], "ubx": program.limits.openings[1]}
        last[0] = solver(x0=last[0], p=given, **bounds)["x"]
        return float(last[0][0])

    return timed(solved, range(calls))[1]


def binary_program(plant: Plant):
    """H of twenty binaries, ten moves of two valves over 40 ms, and g of a state.

    A convex quadratic cost on one affine mode; it knows neither landing nor stops.
    """
    mode = gearbox_modes(plant)["Low side 1 charges 2 charges"]
    step, flows = sampled(mode, 1e-3), valve_flows(plant)
    off, on = flows(0.0, 3e5), flows(1.0, 3e5)
    x_free, G = np.eye(4), np.zeros((4, 2 * BLOCKS))
    free, forced, drift, constant = [], [], [], np.zeros(4)
    for k in range(BLOCKS * BLOCK):
        G = step.F @ G
        for valve in (0, 1):
            G[:, 2 * (k // BLOCK) + valve] += step.G[:, valve] * (on - off)[valve]
        constant = step.F @ constant + step.offset + step.G @ off
        x_free = step.F @ x_free
        free.append(x_free)
        forced.append(G.copy())
        drift.append(constant)
    free, forced, drift = np.array(free), np.array(forced), np.array(drift)
    weight = np.array([0.0, 0.0, 1e6, 1e2])
    H = np.einsum("kir,i,kis->rs", forced, weight, forced) + 1e-3 * np.eye(2 * BLOCKS)

    def g(x: np.ndarray) -> np.ndarray:
        return np.einsum("kir,i,ki->r", forced, weight, free @ x + drift)

    return 0.5 * (H + H.T), g


def by_binaries(plant: Plant, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest distance of a binary from 0 and 1, and times, at each state by DAQP."""
    import daqp

    H, g = binary_program(plant)
    sense = np.full(2 * BLOCKS, BINARY, dtype=np.int32)
    low, high, A = np.zeros(2 * BLOCKS), np.ones(2 * BLOCKS), np.zeros((0, 2 * BLOCKS))

    def solved(x: np.ndarray) -> float:
        z, _, flag, _ = daqp.solve(H, g(x), A, high, low, sense)
        return float(np.minimum(abs(z), abs(z - 1.0)).max()) if flag == 1 else np.inf

    return timed(solved, places)


def whole_calls(
    controller: LinearMpc, record, names: tuple[str, ...], number: int
) -> tuple[np.ndarray, list]:
    """CPU time of every call that is at work over a step of the plant, and what each notes."""
    begins = int(np.argmax(np.diff(record[f"reference.{STATES[0]}"]) > 0.0)) - 20
    every = max(round(controller.sample_time_s / record.sample_time_s), 1)
    places = record.rows(names)[:, begins::every].T[:number]
    wanted = record[f"reference.{STATES[0]}"][begins::every]
    from workbench.contracts import Estimate

    command, times, notes = controller.start(), [], []
    for k, x in enumerate(places):
        seen = Estimate(names, x, np.eye(len(x)))
        coming = wanted[k : k + controller.preview][None]
        asked = controller.told(x) if isinstance(controller, WholePlantMpc) else controller
        begun = time.thread_time()
        command = asked.step(command, coming, seen)
        times.append(time.thread_time() - begun)
        notes.append(command.notes)
    working = [not note.get("resting") for note in notes]
    return np.array(times)[working], [n for n, w in zip(notes, working, strict=True) if w]
