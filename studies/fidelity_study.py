"""Study ``fidelity``: what each physical effect of the design model is worth for control.

Paper 000 asks for the value of fidelity and answers it with a simulated joint that does not hold
its place.  Here the model that designs and estimates lacks one effect at a time, and closes the
loop on the servo drive that has them all: LQ with the extended Kalman filter, every gain,
compensation and prediction from the poorer model, parameters of the drive drawn as in study
``controllers``, 5.8 kg.  An effect is worth modelling where the loop without it is clearly worse.

The end stops stay, since they bound the modes; a closed centre without any leak has no operating
point, so a tenth of the leak is left.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from studies.controllers_study import DESIGNS
from studies.draws import kept_rows
from studies.kept import Row
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns, number
from studies.yardsticks import FINAL, LARGE, ONE, PAYLOAD_KG, RISE, draw_of, measured, medians
from workbench.plant import Plant

DRAWS = {Extent.QUICK: 3, Extent.FULL: 20}
DESIGN = "lq"
WHOLE = "nothing"
FRICTION = ("friction.coulomb_force_n", "friction.stiction_excess_n")
DEAD_VOLUMES = ("chamber_a.dead_volume_m3", "chamber_b.dead_volume_m3")
LEAK = "valve.leak_area_m2"
JUDGED = (LARGE, ONE, FINAL, RISE)
WORTH = {"dead zone of the valve": LARGE, "dry friction": LARGE, "dead volumes": ONE}
"""What is worth modelling, and the figure that says so."""
CLEAR = 2.0  # times as large: an effect that is clearly worth modelling
SAME = 0.1  # share of a figure that is no difference


def _less(factor: float, *names: str) -> Callable[[Plant], Plant]:
    """A plant with so much of the named values."""
    return lambda plant: plant.with_values({name: factor * plant.values[name] for name in names})


LACKING: Mapping[str, Callable[[Plant], Plant]] = {
    WHOLE: lambda plant: plant,
    "dead zone of the valve": lambda plant: plant.without("valve_dead_zone"),
    "curve of the valve's area": lambda plant: plant.with_values({"valve.area_exponent": 1.0}),
    "leak of the valve": _less(0.1, LEAK),
    "dead volumes": _less(0.05, *DEAD_VOLUMES),
    "heat of the walls": lambda plant: plant.without("wall_heat"),
    "stiction": _less(0.0, "friction.stiction_excess_n"),
    "dry friction": _less(0.0, *FRICTION),
    "all friction": lambda plant: plant.without("friction"),
}
"""What the design model lacks, and how it is taken away."""


@dataclass(frozen=True)
class Poorer:
    """One draw with one thing lacking in the model."""

    lacking: str
    number: int


def worked(piece: Poorer) -> Row:
    """The yardsticks of one draw; None for a figure that it does not have."""
    draw = draw_of(piece.number, PAYLOAD_KG)
    method, numbers = DESIGNS[DESIGN]
    poorer = replace(draw, believed=LACKING[piece.lacking](draw.believed))
    found = measured(poorer, method, numbers)
    return {"found": {mark: found[mark] if np.isfinite(found[mark]) else None for mark in JUDGED}}


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Every lack with every draw; what is kept in the folder is not done again."""
    pieces = {f"{name} {k}": Poorer(name, k) for k in range(DRAWS[extent]) for name in LACKING}
    rows = kept_rows(folder, worked, pieces, say)
    found: dict[str, list[Mapping[str, Any]]] = {name: [] for name in LACKING}
    for piece, row in zip(pieces.values(), rows, strict=True):
        found[piece.lacking].append(row["found"])
    return outcome(found)


def outcome(rows: Mapping[str, Sequence[Mapping[str, Any]]]) -> Outcome:
    """Table, claims, figure and numbers."""
    from studies.figures.fidelity import fidelity_figure

    found = {name: medians(of_one, JUDGED) for name, of_one in rows.items()}
    whole = found[WHOLE]
    worse = {name: {m: v[m] / whole[m] for m in JUDGED} for name, v in found.items()}
    head = ("the design model lacks", *JUDGED)
    table = [
        (name, *(f"{number(v[m], 3)} ({number(worse[name][m], 2)} x)" for m in JUDGED))
        for name, v in found.items()
    ]
    count = len(rows[WHOLE])
    told = f"medians over {count} draws with {PAYLOAD_KG:g} kg, in brackets against the whole model"
    figure = fidelity_figure({n: w for n, w in worse.items() if n != WHOLE}, JUDGED)
    text = f"{columns(head, table)}\n{told}"
    return Outcome(text, (*_claims(worse),), {"fidelity": figure}, {"medians": found})


def _claims(worse: Mapping[str, Mapping[str, float]]) -> Sequence[Claim]:
    def told(name: str, mark: str) -> str:
        return f"{number(worse[name][mark], 3)} times as large"

    needed = [
        Claim(f"without {name}, {mark} is at least {CLEAR:g} times as large",
              told(name, mark), worse[name][mark] >= CLEAR)
        for name, mark in WORTH.items()
    ]  # fmt: skip
    heat = worse["heat of the walls"][LARGE]
    best = min(worse, key=lambda name: worse[name][LARGE])
    return [
        *needed,
        Claim(f"heat of the walls is not: {LARGE} changes by less than {SAME:.0%}",
              told("heat of the walls", LARGE), abs(heat - 1.0) < SAME),
        Claim(f"no model that lacks something is better by {SAME:.0%}",
              f"{best}: {told(best, LARGE)}", worse[best][LARGE] > 1.0 - SAME),
    ]  # fmt: skip


STUDY = Study(
    name="fidelity",
    question="what is each physical effect of the design model worth for control?",
    source="paper 000, value of fidelity (S000-8, S000-9), asked of paper 002's drive",
    run=run,
    plants=("servo_drive",),
    seeds="draw k, from 0: 1001 + k",
)
