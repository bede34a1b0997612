"""Study ``robustness``: one design over a thousand drives whose parameters nobody knows exactly.

LQ with an extended Kalman filter positions the servo drive at 1 kHz: 60 mm, watched for 2 s.  The
drive that moves has every uncertain parameter drawn from its standard deviation; design and filter
know the nominal ones.  Draws are done by all cores at once, are kept one by one, and are the same
however many workers there are.  Lines are the yardsticks of study ``controllers``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from studies.asked_lines import within
from studies.checking import drawn
from studies.closed_loop_check import standard_estimator
from studies.draws import kept_rows
from studies.kept import Row
from studies.robustness import Line, Robustness
from studies.scenarios import SAMPLE_TIME_S, Scenario
from studies.study import Claim, Extent, Outcome, Study
from studies.verdicts import drawn_values
from studies.yardsticks import Closed, figures_of
from workbench.rig import Rig, default_rig

DRAWS = {Extent.QUICK: 60, Extent.FULL: 1000}
FIRST_SEED = 5001  # of draws that no design was tuned on
WATCHED_S, BEGINS_S, STEP_M = 2.0, 0.1, 0.06
DESIGN = "lq"
LIMITS = {
    "rise (ms)": ("rise_s", 1e3, 200.0),
    "overshoot (mm)": ("overshoot_m", 1e3, 3.0),
    "final error (mm)": ("final_error_m", 1e3, 0.1),
    "motion at rest (mm)": ("limit_cycle_m", 1e3, 0.1),
    "air (g)": ("air_kg", 1e3, 2.0),
}
"""Figure, factor and limit: rise and motion at rest as in ``controllers``, twice its final error
(95 % of its draws within that); overshoot and air are chosen."""
RARE = 0.05  # of the draws, that may miss a line


@dataclass(frozen=True)
class Draw:
    """One drive, by the number of its seed."""

    number: int


@lru_cache(maxsize=1)
def _prepared() -> tuple[Rig, Any, Any]:
    """Rig, controller and estimator: once in every process."""
    from controllers.design_file import design
    from studies.controllers_study import DESIGNS
    from workbench.plants.servo_drive import servo_drive

    rig = default_rig(servo_drive())
    method, numbers = DESIGNS[DESIGN]
    controller = design(method, rig.plant, numbers).controller
    return rig, controller, standard_estimator("ekf", rig.plant, controller.sample_time_s)


def measured(draw: Draw) -> Row:
    """The figures of one draw, and how far its parameters were off in standard deviations.

    None stands for a figure that the run does not have, and for all of a loop that was lost.
    """
    rig, controller, estimator = _prepared()
    plant = drawn(rig, np.random.default_rng(FIRST_SEED + draw.number))
    off = {name: deviations for name, (_, deviations) in drawn_values(rig, plant).items()}
    truth, scenario = plant.lean(), step_of(rig)
    try:
        row = Closed(truth, controller, estimator, draw.number).metrics(scenario)
        values = {name: getattr(row, key) * by for name, (key, by, _) in LIMITS.items()}
    except ArithmeticError:
        values = dict.fromkeys(LIMITS, np.nan)
    found = {name: float(v) if np.isfinite(v) else None for name, v in values.items()}
    return {"found": found, "deviations": off}


def step_of(rig: Rig) -> Scenario:
    """60 mm about the middle of the stroke after 0.1 s."""
    from linearize.axes import stroke_m

    time_s = SAMPLE_TIME_S * np.arange(round(WATCHED_S / SAMPLE_TIME_S))
    start_m = stroke_m(rig.plant) / 2.0 - STEP_M / 2.0
    return Scenario("step", start_m + STEP_M * (time_s >= BEGINS_S), BEGINS_S, BEGINS_S)


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """All draws; what is kept in the folder is not done again."""
    draws = {f"draw {k}": Draw(k) for k in range(DRAWS[extent])}
    return outcome(kept_rows(folder, measured, draws, say, "draws"))


def summary(rows: Sequence[Mapping[str, Any]]) -> Robustness:
    """The lines over all draws."""
    lines = []
    for name, (_, _, limit) in LIMITS.items():
        found = figures_of([row["found"] for row in rows], name)
        lines.append(Line(name, f"at most {limit:g}", found, ~within(found, limit)))
    names = dict.fromkeys(name for row in rows for name in row["deviations"])
    off = {name: np.array([row["deviations"].get(name, 0.0) for row in rows]) for name in names}
    return Robustness(tuple(lines), off)


def outcome(rows: Sequence[Mapping[str, Any]]) -> Outcome:
    """Table, claims, figure and numbers of all draws."""
    from studies.figures.robustness import influence_figure, spread_figure

    found = summary(rows)
    lost = [k + 1 for k, row in enumerate(rows) if None in row["found"].values()]
    claims = [
        Claim(
            f"{line.name} {line.asked}, in all but {RARE:.0%} of the draws",
            f"{line.probability:.1%} miss it ({line.interval[0]:.1%} to {line.interval[1]:.1%})",
            line.probability <= RARE,
        )
        for line in found.lines
    ]
    claims.append(Claim("no draw is lost", ", ".join(map(str, lost)) or "none", not lost))
    numbers = {
        line.name: {
            "probability": line.probability,
            "interval": line.interval,
            "worst draw": int(line.worst[0]) + 1,
            "influences": dict(found.influences(line)),
        }
        for line in found.lines
    }
    limits = {name: limit for name, (_, _, limit) in LIMITS.items()}
    figures = {"spread": spread_figure(found, limits), "influences": influence_figure(found)}
    return Outcome(found.text, tuple(claims), figures, numbers)


STUDY = Study(
    name="robustness",
    question="how often does one design miss its lines over drives that nobody knows exactly?",
    source="issue of the studies; Clopper and Pearson 1934",
    run=run,
    plants=("servo_drive",),
    seeds="draw k, from 0: 5001 + k",
)
