"""Designs on the bench of a plant that follows a reference: runs, figures of each, and a table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite

import numpy as np

from estimators import ESTIMATORS
from estimators.ahead import in_time
from estimators.per_mode import chosen_per_mode
from estimators.raw import RAW, RawMeasurement
from estimators.scheduled_kalman import ScheduledKalman
from studies.asked_lines import within
from studies.closed_loop_check import every_loop
from studies.closed_loop_metrics import air_used_kg, rise_s, step_figures, valve_switches
from studies.controller_calls import Answered, calls
from studies.following import BAND, BENCHES, TICK_S, WITHIN, Task, leg_of
from studies.tables import NEVER
from studies.text import clock, columns, number, shown
from workbench.closed_loop import Hardware, LoopRecord, close_loop
from workbench.contracts import Command, Controller, Estimate, Estimator
from workbench.filtering import consistent_start
from workbench.plant import Plant, require
from workbench.units import suffix

SLOWER, AT_LEAST = 0.2, 3  # share of the open valve's time, and samples of the controller
LATE_S = 0.1  # the end of a step, where its final error is


@dataclass(frozen=True)
class Followed(Answered):
    """One run: its figures by full name in SI, and what of them is asked at most."""

    design: str
    estimator: str
    scenario: str
    figures: Mapping[str, float]
    asked: Mapping[str, float]
    solve_median_s: float
    solve_p99_s: float
    estimate_median_s: float

    @property
    def reached(self) -> bool:
        """True when every figure is as asked."""
        return all(self.holds(name) for name in self.asked)

    def holds(self, name: str) -> bool:
        """Whether a figure is as asked; what never ends is not, whatever the open valve does."""
        return isfinite(self.figures[name]) and within(self.figures[name], self.asked[name])


@dataclass(frozen=True)
class FollowingCheck:
    """Runs and their records, in the same order."""

    rows: tuple[Followed, ...]
    records: tuple[LoopRecord, ...]

    goal = "missed: what the column 'at most' says"

    @property
    def text(self) -> str:
        """A line for each figure that something is asked of."""
        return following_table(self.rows)


@dataclass(frozen=True)
class Held:
    """One command, whatever happens: the open valve."""

    value: np.ndarray
    sample_time_s: float
    preview: int = 1

    def start(self) -> Command:
        return Command(self.value)

    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        return last


def check_followed(
    plant: Plant,
    designs: Mapping[str, Controller],
    estimators: Iterable[str],
    scenarios: Iterable[str],
    *,
    believed: Plant | None = None,
    seed: int = 0,
) -> FollowingCheck:
    """Every design with every estimator in every task of the plant's bench.

    Parameters
    ----------
    believed
        The plant in the estimators, the same one by default.

    Raises
    ------
    UnknownNameError
        If there is no such task or estimator.
    """
    truth, model, rows, records = plant.lean(), (believed or plant).lean(), [], []
    tasks = tasks_of(believed or plant)
    require(scenarios := tuple(scenarios), tasks, "the list of scenarios")
    asked = [tasks[name] for name in scenarios]
    for design, estimator, observer, task in every_loop(
        designs, estimators, asked, observer_of, model
    ):
        controller = designs[design]
        record = followed(truth, controller, observer, task, seed)
        rows.append(measured(truth, record, task, design, estimator, controller))
        records.append(record)
    return FollowingCheck(tuple(rows), tuple(records))


def tasks_of(plant: Plant) -> dict[str, Task]:
    """The tasks of a plant's bench by name."""
    return {task.name: task for task in BENCHES[plant.name].tasks(plant)}


@lru_cache(maxsize=8)
def observer_of(name: str, plant: Plant, sample_time_s: float) -> Estimator:
    """An estimator of the registry for the sensors of the plant's bench, made once; `raw` is none.

    ``name`` may also choose by mode, see :mod:`estimators.per_mode`.

    Raises
    ------
    UnknownNameError
        If there is no such estimator, or no such mode.
    """
    if name == RAW:
        return RawMeasurement(names=plant.measured, sample_time_s=sample_time_s)
    bench = BENCHES[plant.name]
    common = {"plant": plant, "sample_time_s": sample_time_s}
    noise, process = bench.noise(plant), bench.process(plant)

    def made(one: str) -> Estimator:
        require((one,), ESTIMATORS, "the list of estimators")
        return ESTIMATORS[one](**common, measurement_noise=noise, process_noise=process)

    finder = ScheduledKalman(**common, measurement_noise=noise, process_noise={})
    return in_time(chosen_per_mode(name, finder, made), plant)


def followed(
    plant: Plant, controller: Controller, estimator: Estimator, task: Task, seed: int
) -> LoopRecord:
    """One run, from rest at the start of the reference."""
    bench = BENCHES[plant.name]
    return close_loop(
        plant,
        controller,
        estimator,
        task.reference,
        afterwards=task.afterwards,
        initial=consistent_start(plant, task.begin),
        hardware=Hardware(noise=bench.noise(plant)),
        sample_time_s=bench.sample_time_s,
        seed=seed,
    )


def measured(
    plant: Plant,
    record: LoopRecord,
    task: Task,
    design: str,
    estimator: str,
    controller: Controller,
) -> Followed:
    """The figures of one run, and what is asked of them."""
    figures, asked = _KINDS[plant.name](plant, record, task, controller.sample_time_s)
    figures["air_kg"] = air_used_kg(plant, record, BENCHES[plant.name].sample_time_s)
    names = plant.model.commands
    figures["switches"] = sum(valve_switches(plant, record.recording[n], n) for n in names)
    return Followed(
        design=design,
        estimator=estimator,
        scenario=task.name,
        figures=figures,
        asked={**task.asked, **asked},
        **calls(record),
        estimate_median_s=float(np.median(record.estimate_time_s)),
    )


Figures = tuple[dict[str, float], dict[str, float]]


def _place(plant: Plant, record: LoopRecord, task: Task, controller_s: float) -> Figures:
    ((name, wanted),) = task.reference.items()
    if task.ends_at_rest:
        return _place_step(record.recording[name], wanted, task, suffix(name)), {}
    return _errors(np.abs(record.recording[name] - wanted), task, suffix(name)), {}


def _place_step(place: np.ndarray, wanted: np.ndarray, task: Task, unit: str) -> dict[str, float]:
    found = step_figures(place, wanted, task.judged_s, WITHIN[unit], unit)
    way = abs(float(wanted[-1] - wanted[0]))
    return {**found, "overshoot_share": found[f"overshoot_{unit}"] / way}


def _foot(plant: Plant, record: LoopRecord, task: Task, controller_s: float) -> Figures:
    """Distance of the true foot from where the wanted angles put it."""
    found = foot_m(plant, record.recording.rows(task.reference))
    wanted = foot_m(plant, np.array([*task.reference.values()]))
    return _errors(np.linalg.norm(found - wanted, axis=1), task, "m"), {}


def foot_m(plant: Plant, angles_rad: np.ndarray) -> np.ndarray:
    """Places of a leg's foot, shape (n, 3), at angles of its joints, shape (3, n)."""
    geometry = leg_of(plant).geometry
    return np.array([[float(x) for x in geometry.foot_m(angles)] for angles in angles_rad.T])


def _errors(error: np.ndarray, task: Task, unit: str) -> dict[str, float]:
    judged = error[round(task.judged_s / TICK_S) :]
    rmse = float(np.sqrt(np.mean(judged**2)))
    return {f"rmse_{unit}": rmse, f"largest_error_{unit}": float(judged.max())}


def _step(plant: Plant, record: LoopRecord, task: Task, controller_s: float) -> Figures:
    """Of a step of pressure, beside the open valve on the same plant."""
    ((name, wanted),) = task.reference.items()
    tick_s, way = BENCHES[plant.name].sample_time_s, float(wanted[-1] - task.begin[name])
    gone = record.recording[name] - wanted[-1]
    outside = np.flatnonzero(np.abs(gone) > BAND * abs(way))
    settled_s = tick_s * (outside[-1] + 1) if outside[-1] + 1 < len(gone) else np.inf
    over_pa = max(float((np.sign(way) * gone).max()), 0.0)
    open_s = _open_valve_s(plant, task, controller_s)
    longest_s = open_s + max(SLOWER * open_s, AT_LEAST * controller_s)
    late = -round(LATE_S / tick_s)
    figures = {
        "rise_s": rise_s(1.0 + gone / way, tick_s),
        "settling_s": settled_s,
        "overshoot_pa": over_pa,
        "overshoot_share": over_pa / abs(way),
        "final_error_pa": float(np.abs(gone[late:]).max()),
        "limit_cycle_pa": float(np.ptp(gone[late:])),
    }
    return figures, {"settling_s": longest_s}


def _open_valve_s(plant: Plant, task: Task, controller_s: float) -> float:
    """When the fully open valve has brought the pressure into the band; infinite if never."""
    ((name, wanted),) = task.reference.items()
    (signal,) = plant.commands
    way = float(wanted[-1] - task.begin[name])
    drive = signal.upper if way > 0.0 else signal.lower
    held = Held(np.array([drive]), controller_s)
    record = followed(plant, held, observer_of(RAW, plant, controller_s), task, 0)
    inside = np.abs(record.recording[name] - wanted[-1]) <= BAND * abs(way)
    return float(np.argmax(inside)) * BENCHES[plant.name].sample_time_s if inside.any() else np.inf


_KINDS: dict[str, Callable[[Plant, LoopRecord, Task, float], Figures]] = {
    "crr_rig": _place,
    "crr_arm": _place,
    "crr_leg": _foot,
    "soft_joint": _step,
}

HEAD = ("design", "estimator", "scenario", "figure", "found", "at most", "met")


def following_table(rows: Iterable[Followed]) -> str:
    """The runs as text."""
    rows = [*rows]
    unit, factor = clock(row.solve_p99_s for row in rows)
    head = (*HEAD, f"ctrl {unit}", f"p99 {unit}")
    return columns(head, [line for row in rows for line in _lines(row, factor)])


def _lines(row: Followed, factor: float) -> Iterable[tuple[str, ...]]:
    """With wall times by the factor of their unit."""
    times = (number(factor * row.solve_median_s), number(factor * row.solve_p99_s))
    for name, most in row.asked.items():
        found = row.figures[name]
        unit = suffix(name)
        words = name.removesuffix(f"_{unit}").replace("_", " ")
        met = "yes" if row.holds(name) else "no"
        said = NEVER if found == np.inf else shown(found, name)
        told = (words, said, shown(most, name), met)
        yield (row.design, row.estimator, row.scenario, *told, *times)
