"""Each design with each estimator against the full nonlinear plant: scenarios, metrics, table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from estimators import ESTIMATORS
from estimators.ahead import in_time
from estimators.per_mode import chosen_per_mode
from estimators.raw import RAW, RawMeasurement
from estimators.scheduled_kalman import ScheduledKalman, noise_for
from linearize.axes import stroke_m
from linearize.standard import POSITION, PRESSURES, VELOCITY
from studies.closed_loop_metrics import Metrics, measure, table
from studies.scenarios import SAMPLE_TIME_S, SCENARIOS, Scenario
from workbench.closed_loop import Hardware, LoopRecord, close_loop
from workbench.contracts import Controller, Estimator
from workbench.errors import Message, UnknownNameError, listed, nearest
from workbench.filtering import consistent_start
from workbench.plant import Plant

if TYPE_CHECKING:
    from studies.specification import Limit

Asked = TypeVar("Asked")  # a scenario of a slide, or a task of a bench
POSITION_NOISE_M, POSITION_GRID_M, PRESSURE_NOISE_PA = 5e-6, 5e-6, 500.0
PROCESS_NOISE = {VELOCITY: 0.1, **dict.fromkeys(PRESSURES, 1e3)}


@dataclass(frozen=True)
class Check:
    """Metrics and records of all runs, in the same order."""

    rows: tuple[Metrics, ...]
    records: tuple[LoopRecord, ...]

    goal = "missed: 0.2 mm at the end of a step, no limit cycle above 0.1 mm, no reference lost"

    @property
    def text(self) -> str:
        """All rows as a table."""
        return table(self.rows)

    @property
    def best(self) -> Metrics:
        """The run with the smallest final error that reaches the goal, else the smallest of all."""
        steps = [row for row in self.rows if row.ends_at_rest] or self.rows
        return min(steps, key=lambda row: (not row.reached, row.final_error_m))


def sensors(plant: Plant) -> Hardware:
    """Noise and resolution by quantity.

    The resolution of the position is paper 002's; the noise is chosen (physics.md section 2).
    """
    positions = [name for name in plant.measured if name.endswith("_m")]
    pressures = [name for name in plant.measured if name.endswith("_pa")]
    noise = dict.fromkeys(positions, POSITION_NOISE_M) | dict.fromkeys(pressures, PRESSURE_NOISE_PA)
    return Hardware(noise=noise, resolution=dict.fromkeys(positions, POSITION_GRID_M))


def noise_of(plant: Plant) -> dict[str, float]:
    """Standard deviation by output: noise, and what the resolution adds to it."""
    hardware = sensors(plant)
    coarse = {key: grid / 12**0.5 for key, grid in hardware.resolution.items()}
    return {key: float(np.hypot(s, coarse.get(key, 0.0))) for key, s in hardware.noise.items()}


@lru_cache(maxsize=8)
def standard_estimator(name: str, plant: Plant, sample_time_s: float) -> Estimator:
    """An estimator of the registry for the sensors and the usual process noise; `raw` is none.

    ``name`` may also choose by mode, see :mod:`estimators.per_mode`.

    Raises
    ------
    UnknownNameError
        If there is no such estimator, or no such mode.
    """
    if name == RAW:
        return RawMeasurement(names=plant.measured, sample_time_s=sample_time_s)
    lean, noise = plant.lean(), noise_of(plant)
    process = {key: size for key, size in PROCESS_NOISE.items() if key in lean.model.states}

    def made(one: str) -> Estimator:
        if one not in ESTIMATORS:
            what = f"no estimator {one}; there is {listed(ESTIMATORS)}"
            raise UnknownNameError(Message(what, nearest=nearest(one, ESTIMATORS)))
        return ESTIMATORS[one](
            plant=lean,
            sample_time_s=sample_time_s,
            measurement_noise=noise,
            process_noise=noise_for(ESTIMATORS[one], lean, process),
        )

    finder = ScheduledKalman(
        plant=lean, sample_time_s=sample_time_s, measurement_noise=noise, process_noise={}
    )
    return in_time(chosen_per_mode(name, finder, made), lean)


def check(
    plant: Plant,
    designs: Mapping[str, Controller],
    estimators: Iterable[str],
    scenarios: Iterable[str],
    *,
    believed: Plant | None = None,
    seed: int = 0,
    limits: Sequence[Limit] = (),
) -> Check:
    """Every design with every estimator in every scenario.

    Parameters
    ----------
    plant
        The plant that moves, at its full level.
    believed
        The plant in the estimators, the same one by default.
    limits
        Of a specification, which count besides the plant's own.
    """
    truth, model = plant.lean(), (believed or plant).lean()
    chosen = [SCENARIOS[name](stroke_m(plant)) for name in scenarios]
    rows, records = [], []
    every = every_loop(designs, estimators, chosen, standard_estimator, model)
    for design, estimator, observer, scenario in every:
        record = run(truth, designs[design], observer, scenario, seed)
        rows.append(measure(truth, record, scenario, design, estimator, limits))
        records.append(record)
    return Check(tuple(rows), tuple(records))


def every_loop(
    designs: Mapping[str, Controller],
    estimators: Iterable[str],
    scenarios: Iterable[Asked],
    made: Callable[[str, Plant, float], Estimator],
    believed: Plant,
) -> Iterator[tuple[str, str, Estimator, Asked]]:
    """(design, estimator, the estimator itself, scenario) of all loops, designs outermost.

    ``made`` gives an estimator by its name, the plant that it knows, and its sample time.
    """
    estimators, scenarios = tuple(estimators), tuple(scenarios)
    for design, controller in designs.items():
        for name in estimators:
            estimator = made(name, believed, controller.sample_time_s)
            yield from ((design, name, estimator, scenario) for scenario in scenarios)


def run(
    plant: Plant, controller: Controller, estimator: Estimator, scenario: Scenario, seed: int
) -> LoopRecord:
    """One run, from rest at the start of the reference."""
    return close_loop(
        plant,
        controller,
        estimator,
        {POSITION: scenario.reference_m},
        afterwards={POSITION: scenario.afterwards_m},
        initial=consistent_start(plant, {POSITION: scenario.reference_m[0]}),
        hardware=sensors(plant),
        sample_time_s=SAMPLE_TIME_S,
        seed=seed,
    )
