"""Each design with each estimator against the full nonlinear plant: scenarios, metrics, table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from math import inf

import numpy as np

from estimators import ESTIMATORS
from estimators.ahead import in_time
from linearize.standard import POSITION, PRESSURES, VELOCITY
from workbench.closed_loop import Hardware, LoopRecord, close_loop
from workbench.contracts import Controller, Estimator
from workbench.effects.forces import EndStops
from workbench.filtering import consistent_start
from workbench.plant import Plant

SAMPLE_TIME_S = 1e-3
POSITION_NOISE_M, POSITION_GRID_M, PRESSURE_NOISE_PA = 5e-6, 5e-6, 500.0
LATE_S = 0.4  # the end of a run, where a limit cycle is looked for
SETTLED_M, GOAL_CYCLE_M = 0.2e-3, 0.1e-3
MARGIN_M, LOWEST_PA, HIGHEST_PA = 2e-3, 1.2e5, 6.95e5
PROCESS_NOISE = {VELOCITY: 0.1, **dict.fromkeys(PRESSURES, 1e3)}


@dataclass(frozen=True)
class Scenario:
    """A reference of the position, shape (n,), on the plant's clock; it starts at rest there.

    ``begins_s`` is when it begins to move, ``judged_s`` from when on tracking is judged.
    """

    name: str
    reference_m: np.ndarray
    begins_s: float
    judged_s: float


def step_scenario(stroke_m: float) -> Scenario:
    """A step of 100 mm about the middle of the stroke, after 0.1 s, watched for 1.2 s."""
    time_s = SAMPLE_TIME_S * np.arange(1300)
    start_m = stroke_m / 2 - 0.05
    return Scenario("step", start_m + 0.1 * (time_s >= 0.1), 0.1, 0.1)


def sine_scenario(stroke_m: float) -> Scenario:
    """A 0.5 Hz sine of 80 mm about the middle, two periods, judged after half a period."""
    time_s = SAMPLE_TIME_S * np.arange(4000)
    return Scenario("sine", stroke_m / 2 + 0.08 * np.sin(np.pi * time_s), 0.0, 1.0)


SCENARIOS: dict[str, Callable[[float], Scenario]] = {
    "step": step_scenario,
    "sine": sine_scenario,
}


@dataclass(frozen=True)
class Metrics:
    """One row of the table; what makes no sense for a scenario is NaN.

    Attributes
    ----------
    rise_s, settling_s
        From 10 to 90 % of the step; from the step until the error stays below 0.2 mm.
    overshoot_m, final_error_m, limit_cycle_m
        Past the target; largest error and peak-to-peak motion over the last 0.4 s.
    rmse_m
        Root of the mean squared error once tracking is judged.
    air_kg
        Taken from the supply.
    activity_v
        Sum of all changes of the command.
    violation_s
        Time outside the limits of position and pressures.
    solve_median_s, solve_p99_s
        Wall time of one controller step.
    """

    design: str
    estimator: str
    scenario: str
    rise_s: float
    overshoot_m: float
    settling_s: float
    final_error_m: float
    limit_cycle_m: float
    rmse_m: float
    air_kg: float
    activity_v: float
    violation_s: float
    solve_median_s: float
    solve_p99_s: float
    estimate_median_s: float

    @property
    def reached(self) -> bool:
        """True when a step ends within 0.2 mm without a limit cycle above 0.1 mm."""
        calm = np.isnan(self.limit_cycle_m) or self.limit_cycle_m < GOAL_CYCLE_M
        return bool(calm and (np.isnan(self.final_error_m) or self.final_error_m < SETTLED_M))


@dataclass(frozen=True)
class Check:
    """Metrics and records of all runs, in the same order."""

    rows: tuple[Metrics, ...]
    records: tuple[LoopRecord, ...]

    @property
    def best(self) -> Metrics:
        """The run with the smallest final error that reaches the goal, else the smallest of all."""
        steps = [row for row in self.rows if not np.isnan(row.final_error_m)] or self.rows
        return min(steps, key=lambda row: (not row.reached, row.final_error_m))


def sensors(plant: Plant) -> Hardware:
    """Noise and resolution by quantity.  Source: physics.md section 2."""
    positions = [name for name in plant.measured if name.endswith("_m")]
    pressures = [name for name in plant.measured if name.endswith("_pa")]
    noise = dict.fromkeys(positions, POSITION_NOISE_M) | dict.fromkeys(pressures, PRESSURE_NOISE_PA)
    return Hardware(noise=noise, resolution=dict.fromkeys(positions, POSITION_GRID_M))


def standard_estimator(name: str, plant: Plant, sample_time_s: float) -> Estimator:
    """An estimator of the registry for the sensors and the usual process noise.

    Raises
    ------
    KeyError
        If there is no such estimator.
    """
    if name not in ESTIMATORS:
        raise KeyError(f"no estimator {name}; there is {', '.join(ESTIMATORS)}")
    hardware, lean = sensors(plant), plant.lean()
    coarse = {key: grid / 12**0.5 for key, grid in hardware.resolution.items()}
    noise = {key: float(np.hypot(s, coarse.get(key, 0.0))) for key, s in hardware.noise.items()}
    process = {key: size for key, size in PROCESS_NOISE.items() if key in lean.model.states}
    found = ESTIMATORS[name](
        plant=lean, sample_time_s=sample_time_s, measurement_noise=noise, process_noise=process
    )
    return in_time(found, lean)


def check(
    plant: Plant,
    designs: Mapping[str, Controller],
    estimators: Iterable[str],
    scenarios: Iterable[str],
    *,
    believed: Plant | None = None,
    seed: int = 0,
) -> Check:
    """Every design with every estimator in every scenario.

    Parameters
    ----------
    plant
        The plant that moves, at its full level.
    believed
        The plant in the estimators, the same one by default.
    """
    truth, model = plant.lean(), (believed or plant).lean()
    stroke_m = next(e.upper_m for e in plant.effects if isinstance(e, EndStops))
    names, rows, records = [*scenarios], [], []
    for design, controller in designs.items():
        for estimator in estimators:
            observer = standard_estimator(estimator, model, controller.sample_time_s)
            for scenario in (SCENARIOS[name](stroke_m) for name in names):
                record = run(truth, controller, observer, scenario, seed)
                rows.append(measure(truth, record, scenario, design, estimator))
                records.append(record)
    return Check(tuple(rows), tuple(records))


def run(
    plant: Plant, controller: Controller, estimator: Estimator, scenario: Scenario, seed: int
) -> LoopRecord:
    """One run, from rest at the start of the reference."""
    return close_loop(
        plant,
        controller,
        estimator,
        {POSITION: scenario.reference_m},
        initial=consistent_start(plant, {POSITION: scenario.reference_m[0]}),
        hardware=sensors(plant),
        sample_time_s=SAMPLE_TIME_S,
        seed=seed,
    )


def measure(
    plant: Plant, record: LoopRecord, scenario: Scenario, design: str, estimator: str
) -> Metrics:
    """The metrics of one run."""
    recording, wanted = record.recording, scenario.reference_m
    position, error = recording[POSITION], recording[POSITION] - wanted
    command = recording.rows(plant.model.commands)
    judged = error[round(scenario.judged_s / SAMPLE_TIME_S) :]
    return Metrics(
        design=design,
        estimator=estimator,
        scenario=scenario.name,
        **_step_metrics(position, wanted, scenario),
        rmse_m=float(np.sqrt(np.mean(judged**2))),
        air_kg=air_used_kg(plant, record),
        activity_v=float(np.abs(np.diff(command)).sum()),
        violation_s=_violation_s(plant, record),
        solve_median_s=float(np.median(record.control_time_s)),
        solve_p99_s=float(np.percentile(record.control_time_s, 99)),
        estimate_median_s=float(np.median(record.estimate_time_s)),
    )


def _step_metrics(position: np.ndarray, wanted: np.ndarray, scenario: Scenario) -> dict[str, float]:
    """Those of a step; NaN where the reference does not end at rest."""
    late = round(LATE_S / SAMPLE_TIME_S)
    if np.ptp(wanted[-late:]) > 0.0:
        return dict.fromkeys(
            ("rise_s", "overshoot_m", "settling_s", "final_error_m", "limit_cycle_m"), np.nan
        )
    begins, size = round(scenario.begins_s / SAMPLE_TIME_S), wanted[-1] - wanted[0]
    share, error = (position - wanted[0]) / size, position - wanted
    outside = np.flatnonzero(np.abs(error) > SETTLED_M)
    settled = outside[-1] + 1 if len(outside) else begins
    rose = share.max() > 0.9
    return {
        "rise_s": float(np.argmax(share > 0.9) - np.argmax(share > 0.1)) * SAMPLE_TIME_S
        if rose
        else np.nan,
        "overshoot_m": float(max(share.max() - 1.0, 0.0) * abs(size)),
        "settling_s": (settled - begins) * SAMPLE_TIME_S if settled < len(error) else inf,
        "final_error_m": float(np.abs(error[-late:]).max()),
        "limit_cycle_m": float(np.ptp(position[-late:])),
    }


def air_used_kg(plant: Plant, record: LoopRecord) -> float:
    """Air taken from the supply: the flows that leave its balance, summed over the run."""
    import casadi as ca

    model, (_, d, p) = plant.model, plant.nominal
    leaving = sum(
        flow for (_, kind, at), flow in model.flows.items() if kind == "MassFlow" and at == "supply"
    )
    taken = ca.Function("taken", [*model.symbols], [-leaving])
    u, x = record.recording.rows(model.commands), record.recording.rows(model.states)
    return float(taken.map(x.shape[1])(x, u, d, p).full().sum() * SAMPLE_TIME_S)


def _violation_s(plant: Plant, record: LoopRecord) -> float:
    stroke_m = next(e.upper_m for e in plant.effects if isinstance(e, EndStops))
    position, pressures = record.recording[POSITION], record.recording.rows(PRESSURES)
    outside = (position < MARGIN_M) | (position > stroke_m - MARGIN_M)
    outside |= ((pressures < LOWEST_PA) | (pressures > HIGHEST_PA)).any(axis=0)
    return float(outside.sum() * SAMPLE_TIME_S)


COLUMNS = {
    "rise_s": ("rise ms", 1e3),
    "overshoot_m": ("over mm", 1e3),
    "settling_s": ("settle ms", 1e3),
    "final_error_m": ("final mm", 1e3),
    "limit_cycle_m": ("cycle mm", 1e3),
    "rmse_m": ("RMSE mm", 1e3),
    "air_kg": ("air g", 1e3),
    "activity_v": ("moves V", 1.0),
    "violation_s": ("limits ms", 1e3),
    "solve_median_s": ("ctrl us", 1e6),
    "solve_p99_s": ("p99 us", 1e6),
    "estimate_median_s": ("est us", 1e6),
}


def table(rows: Iterable[Metrics]) -> str:
    """The rows as text, one line each, in millimetres, milliseconds, grams and microseconds."""
    labels = [f.name for f in fields(Metrics) if f.name not in COLUMNS]
    lines = ["".join(f"{label:>10}" for label in [*labels, *(c for c, _ in COLUMNS.values())])]
    for row in rows:
        words = [f"{getattr(row, label):>10}" for label in labels]
        values = [(getattr(row, key) * factor) for key, (_, factor) in COLUMNS.items()]
        words += [f"{'-' if np.isnan(value) else format(value, '.4g'):>10}" for value in values]
        lines.append("".join(words))
    return "\n".join(lines)
