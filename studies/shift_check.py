"""Gear shifts in closed loop against the full nonlinear actuator: four shifts, what each is worth.

A shift is fast if it settles in 1.25 times the time of the open loop, which drives without brake;
soft if it lands with half of its speed, or 0.5 m/s; and no shift to Neutral goes past it by 0.5 mm.
The open loop is run on the same plant, so that the bounds follow a drawn plant and its supply.

Noise by physics.md section 2; the filter's process noise is chosen for a supply that is off by a
bar and friction by half.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from math import isfinite, nan

import numpy as np

from controllers.shift_prediction import drives
from estimators.ahead import in_time
from estimators.shift_filter import ShiftFilter
from linearize.shift_sample import half_stroke_m
from linearize.shifting import POSITION, PRESSURES, VELOCITY
from studies.asked_lines import within
from studies.controller_calls import Answered, calls
from studies.text import clock, columns, number, until
from workbench.closed_loop import Hardware, LoopRecord, close_loop
from workbench.contracts import Command, Controller, Estimate, Estimator
from workbench.filtering import consistent_start
from workbench.plant import Plant
from workbench.plants.gearbox import COMMANDS, FINGER_M, FLOATING, MAIN
from workbench.rig import Rig

SAMPLE_TIME_S, LASTS_S, LATE_S = 2.5e-4, 0.08, 0.01
SETTLED_M, OVERSHOT_M = 0.3e-3, 0.5e-3
FEWER = 10  # plans judged at a sample, for a computer without time for all of them
SLOWER, SOFTER, SOFT_M_S = 1.25, 0.5, 0.5
BOUNDS = (
    f"bounds: {SLOWER:g} times the time of the open loop; {SOFTER:g} times its impact, "
    f"or {SOFT_M_S:g} m/s where that is more"
)
VALVES = ("valve_1.", "valve_2.")
OPEN_LOOP = "open_loop."  # before the names of its channels in the record of a shift
NOISE = {**dict.fromkeys(PRESSURES, 1e3), POSITION: 2e-5}
PROCESS = {
    "chamber_1.pressure_pa": 1e5,
    "chamber_2.pressure_pa": 1e5,
    POSITION: 1e-4,
    VELOCITY: 2.0,
}
SHIFTS = {"n-h": (0.0, 1.0), "h-n": (1.0, 0.0), "n-l": (0.0, -1.0), "l-n": (-1.0, 0.0)}
"""Start and target of each shift in half strokes, by its name on the command line."""


@dataclass(frozen=True)
class Drive:
    """The open loop: the commands that lead to the target, held."""

    commands: tuple[int, int]
    sample_time_s: float = 1e-3
    preview: int = 1

    def start(self) -> Command:
        return Command(np.zeros(2))

    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        return Command(np.array(self.commands, dtype=float))


@dataclass(frozen=True)
class Shift(Answered):
    """One shift in closed loop; times from the first sample.

    rise_s              from 10 to 90 % of the way
    settling_s          until the piston stays within 0.3 mm of its place
    impact_m_s          largest speed with which two parts meet: pistons, stops, shoulder
    overshoot_m         past Neutral; 0 for a shift to an end
    final_error_m       largest error over the last 10 ms
    way_m               from start to target
    air_kg, switches    taken from the supply, and how often the valves switch
    longest_s, hardest_m_s    bounds of time and impact, which follow from those of the open loop
    open_settling_s, open_impact_m_s    of the open loop on the same plant
    """

    design: str
    scenario: str
    rise_s: float
    settling_s: float
    impact_m_s: float
    overshoot_m: float
    final_error_m: float
    way_m: float
    air_kg: float
    switches: float
    longest_s: float
    hardest_m_s: float
    solve_median_s: float
    solve_p99_s: float
    open_settling_s: float = nan
    open_impact_m_s: float = nan

    @property
    def overshoot_share(self) -> float:
        """Of the way."""
        return self.overshoot_m / self.way_m

    @property
    def reached(self) -> bool:
        """True when it ends, fast and soft and not past Neutral, whatever the open loop does."""
        soft = within(self.impact_m_s, self.hardest_m_s) and self.overshoot_m < OVERSHOT_M
        return isfinite(self.settling_s) and within(self.settling_s, self.longest_s) and soft


@dataclass(frozen=True)
class ShiftCheck:
    """Shifts and their records, in the same order."""

    rows: tuple[Shift, ...]
    records: tuple[LoopRecord, ...]

    goal = (
        "missed: 1.25 times the time of the open loop, half of its landing speed or 0.5 m/s, "
        "0.5 mm past Neutral"
    )

    @property
    def text(self) -> str:
        """All rows as a table, and what its bounds are."""
        return f"{shift_table(self.rows)}\n{BOUNDS}"


def check_shifts(
    plant: Plant,
    designs: Mapping[str, Controller],
    scenarios: Iterable[str],
    *,
    believed: Plant | None = None,
    seed: int = 0,
    strength: float = 1.0,
) -> ShiftCheck:
    """Every design in every shift, each beside the open loop.

    Parameters
    ----------
    believed
        The plant in the estimator, the same one by default.
    strength
        How far its valves may be off, see :class:`estimators.shift_filter.ShiftFilter`.
    """
    truth, model = plant.lean(), (believed or plant).lean()
    leading, rows, records = drives(plant, 1e-3), [], []
    for scenario in scenarios:
        target_m = SHIFTS[scenario][1] * half_stroke_m(plant)
        open_loop = Drive(leading[target_m])
        beside = run(truth, open_loop, shift_filter(model, 1e-3, strength), scenario, seed)
        bound = _measured(truth, beside, scenario)
        for design, controller in designs.items():
            observer = shift_filter(model, controller.sample_time_s, strength)
            record = run(truth, controller, observer, scenario, seed)
            rows.append(_bounded(_measured(truth, record, scenario), design, bound))
            records.append(_beside(record, beside))
    return ShiftCheck(tuple(rows), tuple(records))


def _bounded(shift: Shift, design: str, bound: Shift) -> Shift:
    """The shift of a design with what the open loop came to, and what that allows."""
    return replace(
        shift,
        design=design,
        longest_s=SLOWER * bound.settling_s,
        hardest_m_s=max(SOFTER * bound.impact_m_s, SOFT_M_S),
        open_settling_s=bound.settling_s,
        open_impact_m_s=bound.impact_m_s,
    )


def _beside(record: LoopRecord, open_loop: LoopRecord) -> LoopRecord:
    """The record with position and commands of the open loop in channels of its own."""
    other = {OPEN_LOOP + name: open_loop.recording[name] for name in (POSITION, *COMMANDS)}
    channels = {**record.recording.channels, **other}
    return replace(record, recording=replace(record.recording, channels=channels))


@cache
def shift_filter(plant: Plant, sample_time_s: float, strength: float = 1.0) -> Estimator:
    """The estimator of a plant, made once; where commands come late it hands on what they meet."""
    found = ShiftFilter(
        plant=plant,
        sample_time_s=sample_time_s,
        measurement_noise=NOISE,
        process_noise=PROCESS,
        strength=strength,
    )
    return in_time(found, plant)


def valves_off(rig: Rig) -> float:
    """How far valves may be off what a rig says, over what their plant says: 1 of a default rig.

    Less of a fitted one, as the root of the mean square over all that is uncertain of its valves.
    """
    plant, shares = rig.plant, []
    for name, known in plant.parameters.items():
        own = known.standard_deviation(plant.values[name])
        if name.startswith(VALVES) and own:
            shares.append(rig.standard_deviation(name) / own)
    return float(np.sqrt(np.mean(np.square(shares)))) if shares else 0.0


def run(
    plant: Plant, controller: Controller, estimator: Estimator, scenario: str, seed: int
) -> LoopRecord:
    """One shift from rest, vented, with the noise of the sensors."""
    start, target = (share * half_stroke_m(plant) for share in SHIFTS[scenario])
    n = round(LASTS_S / SAMPLE_TIME_S)
    places = {POSITION: start, f"{FLOATING}.position_m": max(start, 0.0)}
    places["finger.angle_rad"] = start / FINGER_M
    return close_loop(
        plant,
        controller,
        estimator,
        {POSITION: np.full(n, target)},
        initial=consistent_start(plant, places),
        hardware=Hardware(noise=NOISE),
        sample_time_s=SAMPLE_TIME_S,
        seed=seed,
    )


def _measured(plant: Plant, record: LoopRecord, scenario: str) -> Shift:
    """What one run shows; its bounds are infinite."""
    from studies.closed_loop_metrics import air_used_kg, rise_s

    recording, (start, target) = record.recording, SHIFTS[scenario]
    end_m = half_stroke_m(plant)
    gone = recording[POSITION] - target * end_m
    outside = np.flatnonzero(np.abs(gone) > SETTLED_M)
    settled = outside[-1] + 1 if len(outside) else 0
    past = np.sign(target - start) * gone if target == 0.0 else np.zeros(1)
    way = (target - start) * end_m
    return Shift(
        design="open loop",
        scenario=scenario,
        rise_s=rise_s(1.0 + gone / way, SAMPLE_TIME_S),
        settling_s=float(settled * SAMPLE_TIME_S) if settled < len(gone) else np.inf,
        impact_m_s=impact_m_s(record, end_m),
        overshoot_m=float(max(past.max(), 0.0)),
        final_error_m=float(np.abs(gone[-round(LATE_S / SAMPLE_TIME_S) :]).max()),
        way_m=abs(way),
        air_kg=air_used_kg(plant, record, SAMPLE_TIME_S),
        switches=float(np.abs(np.diff(recording.rows(plant.model.commands), prepend=0.0)).sum()),
        longest_s=np.inf,
        hardest_m_s=np.inf,
        **calls(record),
    )


def impact_m_s(record: LoopRecord, end_m: float) -> float:
    """Largest speed with which pistons meet each other, their stops, or the shoulder."""
    rows = record.recording
    x, v = rows[f"{MAIN}.position_m"], rows[f"{MAIN}.velocity_m_s"]
    x_f, v_f = rows[f"{FLOATING}.position_m"], rows[f"{FLOATING}.velocity_m_s"]
    pairs = (
        (x + end_m, -v),
        (end_m - x, v),
        (x_f, -v_f),
        (end_m - x_f, v_f),
        (x_f - x, v - v_f),
    )
    hardest = 0.0
    for gap, closing in pairs:
        met = np.flatnonzero((gap[:-1] > 0.0) & (gap[1:] <= 0.0))
        hardest = max([hardest, *closing[met], *closing[met + 1]])
    return float(hardest)


HEAD = ("design", "shift", "reached", "settle ms", "bound of time ms", "open loop ms",
        "impact m/s", "bound of impact m/s", "open loop m/s",
        "over mm", "air g", "switches")  # fmt: skip


def shift_table(rows: Iterable[Shift]) -> str:
    """The shifts as text, with bounds and open loop beside what they are for."""
    rows = [*rows]
    unit, factor = clock(row.solve_p99_s for row in rows)
    head = (*HEAD, f"ctrl {unit}", f"p99 {unit}")
    return columns(head, [_row(row, factor) for row in rows])


def _row(row: Shift, factor: float) -> tuple[str, ...]:
    """With wall times by the factor of their unit."""
    numbers = (
        1e3 * row.longest_s, 1e3 * row.open_settling_s,
        row.impact_m_s, row.hardest_m_s, row.open_impact_m_s,
        1e3 * row.overshoot_m, 1e3 * row.air_kg, row.switches,
        factor * row.solve_median_s, factor * row.solve_p99_s,
    )  # fmt: skip
    words = (row.design, row.scenario, "yes" if row.reached else "no")
    return (*words, until(1e3 * row.settling_s), *(number(value, 4) for value in numbers))
