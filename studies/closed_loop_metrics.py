"""What a closed-loop run is judged by: metrics of a record, and their table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf, isnan, nan
from typing import TYPE_CHECKING

import numpy as np

from linearize.axes import stroke_m
from linearize.reduction import closed_command
from linearize.standard import POSITION, PRESSURES, SUPPLY
from studies.asked_lines import within
from studies.controller_calls import Answered, calls
from studies.scenarios import LATE_S, SAMPLE_TIME_S, Scenario
from studies.text import clock, columns, until
from workbench.closed_loop import LoopRecord
from workbench.effects.timing import sent_at_s
from workbench.effects.valve_command import DeadZone
from workbench.plant import Plant

if TYPE_CHECKING:
    from studies.specification import Limit

SETTLED_M, GOAL_CYCLE_M = 0.2e-3, 0.1e-3
LOST_SHARE = 0.1  # of the amplitude: a reference that is followed worse than this is lost
OVERLAP = "valve.overlap_share"
MARGIN_M, LOWEST_PA, BELOW_SUPPLY_PA = 2e-3, 1.2e5, 5e3


@dataclass(frozen=True)
class Metrics(Answered):
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
    activity_v, switches
        Sum of all changes of the command; how often the valve goes over from one side to the other.
    violation_s
        Time outside the limits of position and pressures, or outside those of a specification.
    amplitude_m, way_m
        Of a reference that does not end at rest, and of a step; NaN for the other one.
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
    switches: float
    violation_s: float
    solve_median_s: float
    solve_p99_s: float
    estimate_median_s: float
    amplitude_m: float = nan
    way_m: float = nan

    @property
    def overshoot_share(self) -> float:
        """Of the way."""
        return self.overshoot_m / self.way_m

    @property
    def ends_at_rest(self) -> bool:
        """True where the reference stands still at the end."""
        return isnan(self.amplitude_m)

    @property
    def reached(self) -> bool | None:
        """True when a step ends within 0.2 mm without a limit cycle above 0.1 mm.

        A reference that does not end at rest has no such goal: None, or False where it is lost.
        """
        if self.ends_at_rest:
            return self.final_error_m < SETTLED_M and self.limit_cycle_m < GOAL_CYCLE_M
        followed = self.rmse_m <= LOST_SHARE * self.amplitude_m
        return None if followed else False


def measure(
    plant: Plant,
    record: LoopRecord,
    scenario: Scenario,
    design: str,
    estimator: str,
    limits: Sequence[Limit] = (),
) -> Metrics:
    """The metrics of one run, against the limits of a specification too if there are any."""
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
        switches=valve_switches(plant, command[0]),
        violation_s=_violation_s(plant, record, limits),
        **calls(record),
        estimate_median_s=float(np.median(record.estimate_time_s)),
        amplitude_m=nan if scenario.ends_at_rest else float(np.ptp(wanted) / 2.0),
        way_m=float(np.ptp(wanted)) if scenario.ends_at_rest else nan,
    )


def _step_metrics(position: np.ndarray, wanted: np.ndarray, scenario: Scenario) -> dict[str, float]:
    """Those of a step; NaN where the reference does not end at rest."""
    if not scenario.ends_at_rest:
        return dict.fromkeys(
            ("rise_s", "overshoot_m", "settling_s", "final_error_m", "limit_cycle_m"), np.nan
        )
    return step_figures(position, wanted, scenario.begins_s, SETTLED_M)


def step_figures(
    position: np.ndarray, wanted: np.ndarray, begins_s: float, within: float, unit: str = "m"
) -> dict[str, float]:
    """What a step of the reference is judged by, settled within a band; both rows are (n,)."""
    late = round(LATE_S / SAMPLE_TIME_S)
    begins, size = round(begins_s / SAMPLE_TIME_S), wanted[-1] - wanted[0]
    share, error = (position - wanted[0]) / size, position - wanted
    outside = np.flatnonzero(np.abs(error) > within)
    settled = outside[-1] + 1 if len(outside) else begins
    return {
        "rise_s": rise_s(share, SAMPLE_TIME_S),
        f"overshoot_{unit}": float(max(share.max() - 1.0, 0.0) * abs(size)),
        "settling_s": (settled - begins) * SAMPLE_TIME_S if settled < len(error) else inf,
        f"final_error_{unit}": float(np.abs(error[-late:]).max()),
        f"limit_cycle_{unit}": float(np.ptp(position[-late:])),
    }


def rise_s(share: np.ndarray, sample_time_s: float) -> float:
    """From 10 to 90 % of the way, ``share`` of it by sample, shape (n,); NaN if never there."""
    if not share.max() > 0.9:
        return nan
    return float(np.argmax(share > 0.9) - np.argmax(share > 0.1)) * sample_time_s


def valve_switches(plant: Plant, command_v: np.ndarray, name: str | None = None) -> float:
    """How often a proportional valve goes over from one side to the other, its dead zone between.

    A command within the dead zone opens neither side, and counts as none; ``command_v``, that of
    ``name`` or of the only valve, is (n,).
    """
    centre_v, half_v = _shut(plant, name or plant.commands[0].name)
    opening_v = command_v - centre_v
    sides = np.sign(opening_v[np.abs(opening_v) > half_v])
    return float(np.count_nonzero(np.diff(sides)))


def _shut(plant: Plant, name: str) -> tuple[float, float]:
    """Centre and half width of the commands under which a valve opens neither side."""
    centre_v = closed_command(plant, name)
    for effect in plant.effects:
        if isinstance(effect, DeadZone) and effect.signal == name:
            return centre_v + float(effect.shift_v), float(effect.half_width_v)
    return centre_v, float(plant.values.get(OVERLAP, 0.0))


def air_used_kg(plant: Plant, record: LoopRecord, sample_time_s: float = SAMPLE_TIME_S) -> float:
    """Air taken from the supply: the flows that leave its balance, summed over the run.

    Under the commands as they arrived; those that were sent belong to later states.
    """
    import casadi as ca

    model, (_, d, p) = plant.model, plant.nominal
    leaving = sum(
        flow for (_, kind, at), flow in model.flows.items() if kind == "MassFlow" and at == "supply"
    )
    taken = ca.Function("taken", [*model.symbols], [-leaving])
    u, x = _arrived(plant, record, sample_time_s), record.recording.rows(model.states)
    return float(taken.map(x.shape[1])(x, u, d, p).full().sum() * sample_time_s)


def _arrived(plant: Plant, record: LoopRecord, sample_time_s: float) -> np.ndarray:
    """The commands behind all that delays them, nominal before the first, shape (n_u, n)."""
    samples = np.arange(len(record.recording))
    rows = [
        np.interp(
            sent_at_s(plant.members, name, sample_time_s * samples) / sample_time_s,
            [-1, *samples],
            [nominal, *record.recording[name]],
        )
        for name, nominal in zip(plant.model.commands, plant.nominal[0], strict=True)
    ]
    return np.array(rows)


def _violation_s(plant: Plant, record: LoopRecord, limits: Sequence[Limit] = ()) -> float:
    position, pressures = record.recording[POSITION], record.recording.rows(PRESSURES)
    highest_pa = plant.values[SUPPLY] - BELOW_SUPPLY_PA
    outside = (position < MARGIN_M) | (position > stroke_m(plant) - MARGIN_M)
    outside |= ((pressures < LOWEST_PA) | (pressures > highest_pa)).any(axis=0)
    for limit in limits:
        outside |= ~within(record.recording[limit.figure], limit.most, limit.least)
    return float(outside.sum() * SAMPLE_TIME_S)


LABELS = ("design", "estimator", "scenario")
ANSWERS = {True: "yes", False: "no", None: "-"}
COLUMNS = {
    "rise_s": ("rise ms", 1e3),
    "overshoot_m": ("over mm", 1e3),
    "settling_s": ("settle ms", 1e3),
    "final_error_m": ("final mm", 1e3),
    "limit_cycle_m": ("cycle mm", 1e3),
    "rmse_m": ("RMSE mm", 1e3),
    "air_kg": ("air g", 1e3),
    "activity_v": ("moves V", 1.0),
    "switches": ("switches", 1.0),
    "violation_s": ("limits ms", 1e3),
}
CLOCKS = {"solve_median_s": "ctrl", "solve_p99_s": "p99", "estimate_median_s": "est"}


def table(rows: Iterable[Metrics]) -> str:
    """The rows as text, one line each, in millimetres, milliseconds and grams."""
    rows = [*rows]
    unit, factor = clock(getattr(row, key) for row in rows for key in CLOCKS)
    shown = COLUMNS | {key: (f"{name} {unit}", factor) for key, name in CLOCKS.items()}
    head = [*LABELS, "reached", *(label for label, _ in shown.values())]
    lines = []
    for row in rows:
        words = [getattr(row, label) for label in LABELS]
        words.append(ANSWERS[row.reached])
        words += [until(factor * getattr(row, key)) for key, (_, factor) in shown.items()]
        lines.append(words)
    return columns(head, lines)
