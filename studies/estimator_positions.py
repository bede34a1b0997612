"""What the position alone tells of both pressures: of the drive, and of the gearbox.

The estimators start with both chambers half a bar off, so that what they know of the pressures in
motion is not from their start.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from estimators.scheduled_kalman import standard_bank
from linearize.analysis import analyse_all
from linearize.modes import HybridModel
from linearize.standard import standard_modes
from studies.estimator_benches import NUMERICAL, at_rest, disturbed_drive, made, start
from studies.estimator_runs import follow, rmse
from studies.estimator_truths import GEARBOX_PRESSURES, TrueRun, counted
from workbench.parts import Chamber
from workbench.plant import Plant
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import OUTPUTS, servo_drive

OFF_PA, LATE = 0.5e5, 200  # how far off the start is; first sample that is judged
DRIVE_PA, VENTED_PA = 5.6e5, 1.013e5  # at which the true drive and the true gearbox start
AWAY = 50  # samples from the last change between rest and motion of the drive
MOVING_M_S = 0.05  # of the gearbox, whose strokes last 50 ms
CONTACTS = {"velocity_m_s": 0.3, "pressure_pa": 0.1}  # shares of a scale, per root of a second:
# two integrators differ where the gearbox meets its stops
WARMTH = 0.1  # of a gas mass, which follows from the pressure


@dataclass(frozen=True)
class PositionBench:
    """A plant that is known by its position alone.

    row             of the position among the outputs of a run
    estimator       name of the one that is judged; ``modes`` are those that are analysed
    moving          where a run counts, (n,)
    """

    position: str
    row: int
    pressures: tuple[str, str]
    estimator: str
    made: Callable[[], Any]
    modes: Callable[[], HybridModel]
    moving: Callable[[TrueRun], np.ndarray]

    def observability(self) -> dict[str, Any]:
        """In how many modes the position alone sees all of the state."""
        reports = analyse_all(self.modes())
        full = [report.seen_from[self.position] == len(report.poles) for report in reports]
        blind = [report.name for report, whole in zip(reports, full, strict=True) if not whole]
        return {"modes": len(reports), "whole": int(sum(full)), "not": blind}

    def errors(self, estimator: Any, r: TrueRun) -> dict[str, float]:
        """RMS errors of both pressures in motion, none of a run without motion."""
        found = follow(estimator, r.commands, r.measured[self.row : self.row + 1], 0)
        moving = self.moving(r)
        moving[:LATE] = False
        a, b = ((found.state(name) - r.truth[name])[moving] for name in self.pressures)
        return {"a": rmse(a), "b": rmse(b)}


def _drive() -> Any:
    """By the unscented filter, which is told of the true disturbance.

    The extended one is sure of the speed of a slide that rests, puts the surprise of the first
    break-away into the pressures, and loses half of the runs unless it is told of 0.1 m/s per
    square root of a second.
    """
    plant = _alone(disturbed_drive(), OUTPUTS[0], DRIVE_PA)
    return made("ukf", plant, NUMERICAL | plant.process_noise, at_rest(plant) | _wide(plant))


def _gearbox() -> Any:
    plant = gearbox().lean()
    plant = _alone(plant, "main_piston.position_m", VENTED_PA)
    sizes = zip(plant.model.states, plant.scale, strict=True)
    noise = {n: CONTACTS.get(n.rpartition(".")[2], 0.0) * float(size) for n, size in sizes}
    return made("ekf", plant, noise, start(plant) | _wide(plant))


def _alone(plant: Plant, position: str, true_pa: float) -> Plant:
    """The plant with its position alone, and chambers half a bar above where they truly start."""
    parts = (
        replace(part, initial_pressure_pa=true_pa + OFF_PA) if _measured(plant, part) else part
        for part in plant.parts
    )
    return replace(plant, parts=tuple(parts), measured=(position,))


def _measured(plant: Plant, part: Any) -> bool:
    return isinstance(part, Chamber) and f"{part.name}.pressure_pa" in plant.measured


def _wide(plant: Plant) -> dict[str, float]:
    """Deviations at the start of gas that may be half a bar off."""
    pressures = [n for n in (*OUTPUTS[1:], *GEARBOX_PRESSURES) if n in plant.model.states]
    masses = {n.replace("pressure_pa", "mass_kg") for n in pressures}
    sizes = zip(plant.model.states, plant.initial, strict=True)
    return dict.fromkeys(pressures, OFF_PA) | {
        n: WARMTH * float(s) for n, s in sizes if n in masses
    }


def _drive_moves(r: TrueRun) -> np.ndarray:
    return counted(r.mode, AWAY) & (r.mode != 1)


def _gearbox_moves(r: TrueRun) -> np.ndarray:
    return np.abs(r.truth["main_piston.velocity_m_s"]) > MOVING_M_S


POSITION_BENCHES = {
    "servo_drive": PositionBench(
        OUTPUTS[0], 0, OUTPUTS[1:], "ukf", _drive, lambda: standard_modes(servo_drive().lean()),
        _drive_moves,
    ),
    "gearbox": PositionBench(
        "main_piston.position_m", 2, GEARBOX_PRESSURES, "ekf", _gearbox,
        lambda: standard_bank(gearbox().lean()), _gearbox_moves,
    ),
}  # fmt: skip


def by_position_alone(
    piece: Callable[[str, Callable[[], Mapping[str, Any]]], Mapping[str, Any]],
    runs: Mapping[str, Sequence[TrueRun]],
) -> dict[str, dict[str, Any]]:
    """By plant: its estimator, what is observable, and errors of the pressures, a row per run."""
    found = {}
    for name, bench in POSITION_BENCHES.items():
        key = f"{name}, {bench.estimator} by the position"
        seen, estimator = piece(f"observability {key}", bench.observability), bench.made()
        rows = [
            piece(f"pressures {key} {k}", partial(bench.errors, estimator, r))
            for k, r in enumerate(runs[name])
        ]
        found[name] = {"estimator": bench.estimator, "observability": seen, "runs": rows}
    return found
