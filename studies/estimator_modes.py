"""How often interacting models name the true mode: a slide, two valves, a spool that sticks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from estimators.interacting_models import PROBABILITY
from studies.estimator_benches import BENCHES, made, start
from studies.estimator_runs import Followed, follow
from studies.estimator_truths import (
    DRAWN,
    SLIDES,
    VALVES,
    TrueRun,
    counted,
    gearbox_runs,
    servo_runs,
    soft_joint_runs,
)
from workbench.plant import Plant
from workbench.plants.soft_joint import NEUTRAL, OVERLAP

LEFT_OUT_S = 10e-3
RUNS = 50  # of the drive, as the whole study makes them
NOISE = {  # what a bank must bear besides the switches: drawn parameters, as shares of the scale
    "velocity_m_s": 0.5,
    "velocity_rad_s": 0.5,
    "pressure_pa": 0.3,
}
Piece = Callable[[str, Callable[[], Mapping[str, Any]]], Mapping[str, Any]]


def modes_named(
    piece: Piece, folder: Path, count: int, say: Callable[[str], None]
) -> dict[str, dict[str, float]]:
    """By what is told apart: share of samples with the right mode, samples counted, phases."""
    say("modes by interacting models")
    return {
        "stick or slide": _shares(
            piece, "servo_drive", servo_runs(DRAWN, RUNS, folder)[:count], partial(_by, SLIDES)
        ),
        "valves of the gearbox": _shares(
            piece, "gearbox", gearbox_runs(DRAWN, count + 1, folder)[1:], partial(_by, VALVES)
        ),
        "fill, shut or vent": _shares(piece, "soft_joint", soft_joint_runs(count), _spool),
    }


def _shares(
    piece: Piece,
    name: str,
    runs: Sequence[TrueRun],
    named: Callable[[Followed, TrueRun], np.ndarray],
) -> dict[str, float]:
    plant = BENCHES[name]().lean()
    rows = [
        piece(f"modes {name} {k}", partial(_run, plant, run, named)) for k, run in enumerate(runs)
    ]
    total = {key: float(sum(row[key] for row in rows)) for key in rows[0]}
    return {
        "share": total["right"] / total["judged"],
        "counted": total["judged"] / total["samples"],
        "phases": total["phases"],
    }


def _run(
    plant: Plant, run: TrueRun, named: Callable[[Followed, TrueRun], np.ndarray]
) -> dict[str, int]:
    states = zip(plant.model.states, plant.scale, strict=True)
    noise = {n: NOISE.get(n.rpartition(".")[2], 0.0) * float(size) for n, size in states}
    estimator = made("imm", plant, noise, start(plant))
    found = follow(estimator, run.commands, run.measured, 0)
    judged = counted(run.mode, round(LEFT_OUT_S / run.sample_time_s))
    right = named(found, run) == run.mode
    return {
        "right": int((right & judged).sum()),
        "judged": int(judged.sum()),
        "samples": len(judged),
        "phases": int(np.count_nonzero(np.diff(run.mode)) + 1),
    }


def _by(labels: Sequence[str], found: Followed, run: TrueRun) -> np.ndarray:
    """The likeliest regime by its place among the labels, (n,)."""
    return np.argmax([found.notes[PROBABILITY + label] for label in labels], axis=0)


def _spool(found: Followed, run: TrueRun) -> np.ndarray:
    """Vents, shut or fills: as commanded, but for a spool that stays shut, (n,)."""
    sent = np.concatenate([[NEUTRAL], run.commands[0, :-1]])
    past = sent - NEUTRAL
    commanded = np.where(past > OVERLAP, 2, np.where(past < -OVERLAP, 0, 1))
    stuck = found.notes[PROBABILITY + "stays shut"] > 0.5
    return np.where(stuck, 1, commanded)
