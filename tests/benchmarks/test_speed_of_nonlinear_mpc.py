"""Nonlinear MPC of the servo drive, horizon 30, beside linear MPC and IPOPT.

Whole calls from Python on the states that the full plant passes in a step of 100 mm: linear MPC,
real-time iteration on the reduced plant (4 states) and on the whole one (7 states, with gas masses,
dead zone and bristle), and the same nonlinear program brought to its optimum by IPOPT, begun from
the last plan.

Run it with ``pytest tests/benchmarks -s --benchmark-enable``.  Process time counts, because other
work on the machine would count in wall time; nothing is asserted about it.
"""

import time
from dataclasses import dataclass, fields, replace

import casadi as ca
import numpy as np
import pytest

from controllers.condensed import MpcSpec
from controllers.linear_mpc import linear_mpc
from controllers.nonlinear_mpc import NonlinearMpc, along, nonlinear_mpc
from controllers.positioning import STATES
from controllers.rollout import Rollout, advance_of
from linearize.reduction import closed_command
from linearize.standard import standard_modes
from studies.closed_loop_check import check
from workbench.contracts import Estimate
from workbench.plants.servo_drive import servo_drive

SPEC = MpcSpec(horizon=30)


@dataclass(frozen=True, kw_only=True)
class Whole(NonlinearMpc):
    """Real-time iteration on the whole plant, whose state is told to it."""

    state: np.ndarray

    def _predicted(self, program, now, force_n, before):
        openings = before.shifted().openings if before else np.full(30, now.opening_v)
        return along(program, self.rollout, self.state, openings, [0.0, force_n])


def whole_rollout(plant):
    model, (_, d, p) = plant.model, plant.nominal
    x, command, *rest = model.symbols
    opening, given = ca.SX.sym("opening"), ca.SX.sym("given", 2)
    rates = ca.substitute([model.rates], [*rest], [ca.DM(d), ca.DM(p)])[0]
    rates = ca.substitute(rates, command, opening + closed_command(plant))
    advance = advance_of(x, opening, given, rates, SPEC.sample_time_s, 1e-3)
    return Rollout(advance, SPEC.horizon, tuple(map(model.states.index, STATES)))


@pytest.fixture(scope="module")
def designs():
    hybrid = standard_modes(servo_drive())
    return linear_mpc(hybrid, SPEC), nonlinear_mpc(hybrid, SPEC)


@pytest.fixture(scope="module")
def record(designs):
    plant = servo_drive().lean()
    return check(plant, {"mpc": designs[0]}, ["ekf"], ["step"]).records[0].recording


def run(controller, record, rest=lambda controller, x: controller):
    """Process time of each call over the first 150 samples of the step, and what was noted."""
    names = servo_drive().lean().model.states
    begins = int(np.argmax(np.diff(record["reference.slide.position_m"]) > 0.0)) - 20
    places = record.rows(names)[:, begins::2].T[:150]
    wanted = record["reference.slide.position_m"][begins::2]
    command, times, notes = controller.start(), [], []
    for k, x in enumerate(places):
        seen = Estimate(names, x, np.eye(len(x)))
        coming = wanted[k : k + controller.preview][None]
        asked = rest(controller, x)
        begun = time.process_time()
        command = asked.step(command, coming, seen)
        times.append(time.process_time() - begun)
        notes.append(command.notes)
    working = [not note.get("resting") for note in notes]
    return np.array(times)[working], [n for n, works in zip(notes, working, strict=True) if works]


def by_ipopt(design, calls):
    """Process times of the unlinearised program from near-by states, each from the last optimum."""
    program, advance, n = design.programs.forward[1], design.rollout.advance, SPEC.horizon
    u, start, states = ca.MX.sym("u", n), ca.MX.sym("start", 4), []
    x = start
    for i in range(n):
        x = advance(x, u[i], ca.DM([1.0, 0.0]))
        states.append(x)
    off = ca.vertcat(*states) - np.tile([0.16, 0.0, 5.9e5, 5.0e5], n)
    cost = ca.bilin(ca.DM(program.Q), off, off) + program.R * ca.sumsqr(u)
    cost += program.S * ca.sumsqr(ca.diff(u))
    quiet = {"ipopt.print_level": 0, "print_time": False, "expand": True}
    solver = ca.nlpsol("exact", "ipopt", {"x": u, "p": start, "f": cost}, quiet)
    last, times = np.zeros(n), []
    for k in range(calls):
        begun = time.process_time()
        given = [0.145 + 2e-4 * k, 0.1, 5.9e5, 5.0e5]
        bounds = {"lbx": program.openings[0], "ubx": program.openings[1]}
        last = solver(x0=last, p=given, **bounds)["x"]
        times.append(time.process_time() - begun)
    return np.array(times)


def test_a_step_of_nonlinear_mpc_beside_linear_mpc_and_ipopt(benchmark, designs, record):
    linear, nonlinear = designs
    parts = {f.name: getattr(nonlinear, f.name) for f in fields(nonlinear)}
    parts |= dict(rollout=whole_rollout(servo_drive().lean()), state=np.zeros(7))
    figures = {
        "linear MPC": run(linear, record),
        "real-time iteration, 4 states": run(nonlinear, record),
        "real-time iteration, 7 states": run(
            Whole(**parts), record, lambda whole, x: replace(whole, state=x)
        ),
    }
    benchmark.pedantic(run, (nonlinear, record), rounds=3 if benchmark.enabled else 1)
    if benchmark.enabled:
        rows = {name: times for name, (times, _) in figures.items()}
        for name, times in (rows | {"IPOPT, 4 states": by_ipopt(nonlinear, 20)}).items():
            median, p99 = 1e3 * np.median(times), 1e3 * np.percentile(times, 99)
            print(f"\n{name}: median {median:.3f} ms, p99 {p99:.3f} ms")

    for times, notes in figures.values():
        assert len(times) > 30
        assert all(note["fallback"] == 0.0 for note in notes)
