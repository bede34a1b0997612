"""Study ``mode-count``: how many modes along the stroke a controller needs.

The stiffness of the air goes with one over the volume of each chamber, so the standard modes cut
the stroke of the servo drive into thirds and controllers mix their gains between them.  Here the
same designs stand on one part, on three, on nine: steps near both ends and in the middle, and sines
over nearly the whole stroke, on the drive with drawn parameters, 5.8 kg.  How well the modes
predict, and how many that takes, is asked by study ``mode-placement``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from controllers import CONTROLLERS
from controllers.spec import replaced
from linearize.axes import drive_axis, stroke_m
from linearize.modes import HybridModel, hybrid_modes
from studies.closed_loop_check import standard_estimator
from studies.controllers_study import DESIGNS
from studies.draws import kept_rows
from studies.kept import Row
from studies.scenarios import SAMPLE_TIME_S, Scenario
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns, number
from studies.yardsticks import PAYLOAD_KG, Closed, draw_of, medians, sine
from workbench.plant import Plant

DRAWS = {Extent.QUICK: 3, Extent.FULL: 20}
COMPARED = ("lq", "mpc")
PLACES = (1, 2, 3, 9)
NEAR_END_M, STEP_M, WIDE_M = 0.01, 0.04, 0.13
END, MIDDLE, HALF, ONE = (
    "steps at the ends: overshoot (mm)",
    "step in the middle: overshoot (mm)",
    "130 mm at 0.5 Hz: RMSE (mm)",
    "130 mm at 1 Hz: RMSE (mm)",
)
JUDGED = (END, MIDDLE, HALF, ONE)
ENOUGH = 0.15  # share by which a sine is followed worse at the most with a single part


@dataclass(frozen=True)
class Parted:
    """One design on so many parts of the stroke, with one draw."""

    design: str
    places: int
    number: int

    @property
    def key(self) -> str:
        return f"{self.design} {self.places} {self.number}"


def parted_modes(plant: Plant, places: int) -> HybridModel:
    """Valve x friction x equal parts of the stroke: nine modes a part."""
    named = tuple(f"part {k + 1}" for k in range(places))
    axis = replace(drive_axis(plant), places=named)
    cuts = {
        axis.command: axis.valve_cut(),
        axis.velocity: axis.friction_cut(),
        axis.position: axis.place_cut(),
    }
    return hybrid_modes(plant, cuts, axis.point)


def worked(piece: Parted) -> Row:
    """The figures of one draw; None where the loop was lost."""
    draw = draw_of(piece.number, PAYLOAD_KG)
    method, numbers = DESIGNS[piece.design]
    found = CONTROLLERS[method]
    spec = replaced(found.spec(), numbers, method)
    controller = found.design(parted_modes(draw.believed, piece.places), spec)
    estimator = standard_estimator("ekf", draw.believed, controller.sample_time_s)
    truth = draw.plant.lean()
    loop = Closed(truth, controller, estimator, piece.number)
    far = stroke_m(truth) - NEAR_END_M
    try:
        ends = [step(NEAR_END_M, STEP_M), step(far, -STEP_M)]
        values = {
            END: 1e3 * max(loop.metrics(each).overshoot_m for each in ends),
            MIDDLE: 1e3 * loop.metrics(step(far / 2.0, STEP_M)).overshoot_m,
            HALF: 1e3 * loop.metrics(sine(truth, 0.5, WIDE_M)).rmse_m,
            ONE: 1e3 * loop.metrics(sine(truth, 1.0, WIDE_M)).rmse_m,
        }
    except ArithmeticError:
        values = {}
    return {"found": {mark: values.get(mark) for mark in JUDGED}}


def step(start_m: float, size_m: float) -> Scenario:
    """A step after 0.1 s, watched for 1.2 s."""
    time_s = SAMPLE_TIME_S * np.arange(1300)
    return Scenario("step", start_m + size_m * (time_s >= 0.1), 0.1, 0.1)


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Every number of parts with every draw; what is kept in the folder is not done again."""
    asked = [Parted(n, p, k) for k in range(DRAWS[extent]) for n in COMPARED for p in PLACES]
    rows = kept_rows(folder, worked, {piece.key: piece for piece in asked}, say)
    found: dict[tuple[str, int], list[Mapping[str, Any]]] = {}
    for piece, row in zip(asked, rows, strict=True):
        found.setdefault((piece.design, piece.places), []).append(row["found"])
    return outcome(found)


def outcome(rows: Mapping[tuple[str, int], Sequence[Mapping[str, Any]]]) -> Outcome:
    """Table, claims, figure and numbers."""
    from studies.figures.mode_count import mode_count_figure

    found = {key: medians(of_one, JUDGED) for key, of_one in rows.items()}
    head = ("design", "parts", "modes", *JUDGED)
    lines = [
        (name, str(places), str(9 * places), *(number(values[mark], 3) for mark in JUDGED))
        for (name, places), values in found.items()
    ]
    count = len(next(iter(rows.values())))
    told = f"medians over {count} draws with {PAYLOAD_KG:g} kg"
    curves = {
        name: {mark: [found[name, places][mark] for places in PLACES] for mark in JUDGED}
        for name in COMPARED
    }
    figures = {"mode_count": mode_count_figure(PLACES, curves)}
    numbers = {f"{name} on {places}": values for (name, places), values in found.items()}
    text = f"{columns(head, lines)}\n{told}"
    return Outcome(text, (*_claims(found),), figures, {"medians": numbers})


def _claims(found: Mapping[tuple[str, int], Mapping[str, float]]) -> Iterator[Claim]:
    """That more parts are not worth having, for each design and sine."""
    for name in COMPARED:
        for mark in (HALF, ONE):
            single = found[name, PLACES[0]][mark]
            best = min(found[name, places][mark] for places in PLACES)
            yield Claim(
                f"{name}, {mark}: one part within {ENOUGH:.0%} of the best number of parts",
                f"{number(single, 3)} against {number(best, 3)}",
                single <= (1.0 + ENOUGH) * best)  # fmt: skip


STUDY = Study(
    name="mode-count",
    question="how many modes along the stroke does a controller need?",
    source="physics.md 4.3 (modes of the servo drive); paper 003 has two positions",
    run=run,
    plants=("servo_drive",),
    seeds="draw k, from 0: 1001 + k",
)
