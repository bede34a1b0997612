"""Study ``control-speed``: how long a whole call of each MPC takes, beside rivals in the same run.

Linear and nonlinear MPC of the servo drive, horizon 30, on the states that its plant passes in a
step of 100 mm, and on states at the limits; hybrid MPC of the gearbox from Low to Neutral.  Times
are CPU time of whole calls from Python, so that other work on the machine does not count, and of
the thread that calls: those that linear algebra keeps for large matrices spin for milliseconds
after a small one, beside the call and not in it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from controllers.design_file import design
from controllers.linear_mpc import limited_plan, linear_mpc
from controllers.mpc_spec import MpcSpec
from controllers.nonlinear_mpc import nonlinear_mpc
from controllers.program_solvers import Osqp
from linearize.shifting import STATES as SHIFT_STATES
from linearize.standard import standard_modes
from studies.closed_loop_check import check
from studies.shift_check import FEWER, SAMPLE_TIME_S, run, shift_filter
from studies.speed_rivals import (
    by_binaries,
    by_ipopt,
    exact,
    kept_osqp,
    limited,
    on_whole_plant,
    timed,
    whole_calls,
)
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns, number
from workbench.contracts import Estimate
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import servo_drive

if TYPE_CHECKING:
    from controllers.hybrid_mpc import HybridMpc

SPEC = MpcSpec(horizon=30)
STATES_DRAWN = {Extent.QUICK: 60, Extent.FULL: 600}
ROUNDS = {Extent.QUICK: 3, Extent.FULL: 20}  # of every run of whole calls
CALLS = 150  # of one run
LINEAR, AT_LIMITS = "linear MPC, whole call", "linear MPC at its limits, DAQP"
OURS_OSQP, KEPT_OSQP = "the same, OSQP with polish", "the same, OSQP with factors kept"
CVXPY = "the same, cvxpy with Clarabel"
NONLINEAR, WHOLE = "nonlinear MPC, 4 states, whole call", "nonlinear MPC, 7 states, whole call"
IPOPT = "the same on 4 states to its optimum, IPOPT"
HYBRID, BINARIES = "hybrid MPC, whole call", "20 binaries, DAQP, no landing and no stops"
FEWER_JUDGED = f"the same, {FEWER} plans judged"
MEDIAN_S, P99_S, NONLINEAR_S, SAMPLE_S, MILLIVOLT = 1e-4, 6e-4, 1e-3, 1e-3, 1e-3


@dataclass(frozen=True)
class Timed:
    """CPU times of calls, s, shape (n,), and the largest error of the input, V; NaN if not asked.

    ``sound`` is False where a call had no answer.
    """

    times_s: np.ndarray
    off_v: float = np.nan
    sound: bool = True

    @property
    def median_s(self) -> float:
        return float(np.median(self.times_s))

    @property
    def p99_s(self) -> float:
        return float(np.percentile(self.times_s, 99))


Rows = Mapping[str, Timed]


def measured(extent: Extent, say: Callable[[str], None]) -> dict[str, Timed]:
    """All rows, one after the other in this process."""
    say("linear MPC at its limits")
    rows = at_limits(STATES_DRAWN[extent])
    say("whole calls of linear and nonlinear MPC")
    rows |= on_the_drive(ROUNDS[extent])
    say("hybrid MPC")
    return rows | on_the_gearbox(ROUNDS[extent])


def at_limits(number: int) -> dict[str, Timed]:
    """The program of linear MPC at its limits by all its solvers, against the exact answer."""
    programs = linear_mpc(standard_modes(servo_drive()), SPEC).programs.forward
    cases = [*limited(programs, number)]
    truth, exact_s = timed(lambda case: exact(*case), cases)
    by_daqp, daqp_s = timed(
        lambda case: limited_plan(*case, None, 0.0)[0].openings[0],
        cases,
    )
    by_osqp, osqp_s = timed(lambda case: Osqp().solved(*case, None)[0][0], cases)
    by_kept, kept_s = kept_osqp(cases)
    return {
        AT_LIMITS: Timed(daqp_s, float(np.abs(by_daqp - truth).max())),
        OURS_OSQP: Timed(osqp_s, float(np.abs(by_osqp - truth).max())),
        KEPT_OSQP: Timed(kept_s, float(np.abs(by_kept - truth).max())),
        CVXPY: Timed(exact_s, 0.0),
    }


def on_the_drive(rounds: int, by_rival: int = 20) -> dict[str, Timed]:
    """Whole calls over a step of the whole plant, and so many of IPOPT, which are slow."""
    hybrid, plant = standard_modes(servo_drive()), servo_drive().lean()
    linear, nonlinear = linear_mpc(hybrid, SPEC), nonlinear_mpc(hybrid, SPEC)
    whole = on_whole_plant(nonlinear, plant, SPEC)
    record = check(plant, {"mpc": linear}, ["ekf"], ["step"]).records[0].recording
    rows = {}
    for name, made in ((LINEAR, linear), (NONLINEAR, nonlinear), (WHOLE, whole)):
        runs = [whole_calls(made, record, plant.model.states, CALLS) for _ in range(rounds)]
        sound = all(note["fallback"] == 0.0 for _, notes in runs for note in notes)
        rows[name] = Timed(np.concatenate([times for times, _ in runs]), sound=sound)
    return rows | {IPOPT: Timed(by_ipopt(nonlinear, by_rival))}


def on_the_gearbox(rounds: int) -> dict[str, Timed]:
    """A shift from Low to Neutral, on the states that the whole plant passes."""
    plant = gearbox().lean()
    made = design("hybrid-mpc", gearbox()).controller
    record = run(plant, made, shift_filter(plant, made.sample_time_s), "l-n", 0)
    every = round(made.sample_time_s / SAMPLE_TIME_S)
    places = record.recording.rows(SHIFT_STATES)[:, ::every].T[:60]
    fewer = design("hybrid-mpc", gearbox(), {"judged": FEWER}).controller
    rows = {}
    for name, each in ((HYBRID, made), (FEWER_JUDGED, fewer)):
        rows[name] = Timed(np.concatenate([_shift_calls(each, places) for _ in range(rounds)]))
    far, rival_s = by_binaries(gearbox(), places)
    return rows | {BINARIES: Timed(rival_s, sound=bool(far.max() < 1e-6))}


def _shift_calls(made: HybridMpc, places: np.ndarray) -> np.ndarray:
    command, times = made.start(), []
    for x in places:
        seen = Estimate(SHIFT_STATES, x, np.eye(4))
        begun = time.thread_time()
        command = made.step(command, np.array([[0.0]]), seen)
        times.append(time.thread_time() - begun)
    return np.array(times)


def outcome(rows: Rows) -> Outcome:
    """Table, claims and numbers."""
    head = ("what", "calls", "median ms", "p99 ms", "worst ms", "input off by mV")
    lines = [(name, *_told(row)) for name, row in rows.items()]
    numbers = {
        name: {"median_s": row.median_s, "p99_s": row.p99_s, "worst_s": float(row.times_s.max())}
        for name, row in rows.items()
    }
    return Outcome(columns(head, lines), (*_claims(rows),), {}, numbers)


def _told(row: Timed) -> tuple[str, ...]:
    times = (row.median_s, row.p99_s, float(row.times_s.max()))
    off = "-" if np.isnan(row.off_v) else number(1e3 * row.off_v, 2)
    return (str(len(row.times_s)), *(number(1e3 * t, 3) for t in times), off)


def _claims(rows: Rows) -> Iterator[Claim]:
    def told(row: Timed) -> str:
        return f"{number(1e3 * row.median_s, 3)} ms, p99 {number(1e3 * row.p99_s, 3)} ms"

    linear, limits, fast = rows[LINEAR], rows[AT_LIMITS], rows[NONLINEAR]
    holds = linear.median_s < MEDIAN_S and linear.p99_s < P99_S
    yield Claim("linear MPC, horizon 30: median under 0.1 ms, p99 0.6 ms", told(linear), holds)
    found = f"{number(1e3 * limits.off_v, 2)} mV"
    yield Claim("its input is within 1 mV of the exact one", found, limits.off_v < MILLIVOLT)
    others = {name: rows[name].median_s for name in (OURS_OSQP, KEPT_OSQP, CVXPY)}
    found = ", ".join(
        f"{n.partition(', ')[2]} {s / limits.median_s:.1f} x" for n, s in others.items()
    )
    quicker = all(s > limits.median_s for s in others.values())
    yield Claim("at the limits DAQP is the quickest", found, quicker)
    found = f"{told(fast)}; 7 states {told(rows[WHOLE])}"
    holds = fast.median_s < NONLINEAR_S
    yield Claim("nonlinear MPC on 4 states: median under 1 ms", found, holds)
    hybrid = rows[HYBRID]
    yield Claim("hybrid MPC: p99 under its sample of 1 ms", told(hybrid), hybrid.p99_s < SAMPLE_S)
    fewer = rows[FEWER_JUDGED]
    claim = f"hybrid MPC with {FEWER} plans judged: the same"
    yield Claim(claim, told(fewer), fewer.p99_s < SAMPLE_S)
    unsound = [name for name, row in rows.items() if not row.sound]
    yield Claim("every call has an answer", ", ".join(unsound) or "all", not unsound)


STUDY = Study(
    name="control-speed",
    question="how long does a whole call of each MPC take, beside rivals in the same run?",
    source="no paper: the rivals of the design reference, section on speed",
    plants=("servo_drive", "gearbox"),
    seeds="states at the limits: 0",
    run=lambda folder, extent, say: outcome(measured(extent, say)),
)
