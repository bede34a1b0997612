"""Study ``estimators``: velocity, pressures, consistency and modes on true runs.

Every piece is kept in the folder, so that a second start goes on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from estimators.tuning import own_noise
from studies.estimator_benches import (
    BENCHES,
    consistent,
    derivative_rmse,
    made,
    start,
    tuned,
)
from studies.estimator_claims import (
    ALL,
    REDUCED,
    consistency_claims,
    consistency_text,
    courses,
    mode_claims,
    modes_text,
    position_claims,
    position_text,
    summary,
    velocity_claims,
    velocity_text,
)
from studies.estimator_modes import RUNS, modes_named
from studies.estimator_positions import AWAY, LATE, by_position_alone
from studies.estimator_runs import follow, nees, rmse, whiteness
from studies.estimator_truths import (
    DRAWN,
    EXACT,
    TrueRun,
    counted,
    gearbox_runs,
    servo_runs,
)
from studies.kept import Kept
from studies.study import Extent, Outcome, Study
from studies.versions import work_folder

JUDGED = ("ekf", "ukf", "mhe")  # for consistency; the others do not know the disturbance
RUNS_DRAWN = {Extent.QUICK: 10, Extent.FULL: RUNS}
RUNS_OF_A_PLANT = {Extent.QUICK: 3, Extent.FULL: 10}  # besides the one that tunes
SAMPLES = 1000  # of a run for consistency: a rest and a move
EVERY = 10  # samples of the error that is kept
VELOCITIES = {"servo_drive": "slide.velocity_m_s", "gearbox": "main_piston.velocity_m_s"}
POSITION_ROWS = {"servo_drive": 0, "gearbox": 2}


@dataclass(frozen=True)
class Work:
    """Where pieces are kept, how much is run, and who is told."""

    folder: Path
    extent: Extent
    kept: Kept
    say: Callable[[str], None]

    def piece(self, key: str, made: Callable[[], Mapping[str, Any]]) -> Mapping[str, Any]:
        """A piece that is kept, or is made now."""
        if key not in self.kept:
            self.say(key)
            self.kept.add(key, {"found": made()})
        return self.kept.rows[key]["found"]


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """All parts of the study, piece by piece."""
    place = work_folder(folder)
    work = Work(place, extent, Kept(place / "rows.jsonl"), say)
    consistency = {kind: _consistency(work, kind) for kind in (EXACT, DRAWN)}
    white = {kind: _coloured(work, kind) for kind in (EXACT, DRAWN)}
    velocity = {plant: _velocity(work, plant) for plant in VELOCITIES}
    exact = {
        "servo_drive": servo_runs(EXACT, RUNS, work.folder)[: RUNS_DRAWN[extent]],
        "gearbox": gearbox_runs(EXACT, RUNS_OF_A_PLANT[extent], work.folder),
    }
    alone = by_position_alone(work.piece, exact)
    modes = modes_named(work.piece, work.folder, RUNS_OF_A_PLANT[extent], say)
    claims = (
        *velocity_claims(velocity),
        *position_claims(alone),
        *consistency_claims(consistency[EXACT]),
        *mode_claims(modes),
    )
    text = "\n\n".join(
        (
            velocity_text(velocity),
            consistency_text(consistency, white),
            position_text(alone),
            modes_text(modes),
        )
    )
    numbers = {
        "velocity": {
            plant: {n: v if np.isfinite(v) else None for n, v in rows.items()}
            for plant, rows in velocity.items()
        },
        "consistency": {k: {n: summary(r) for n, r in v.items()} for k, v in consistency.items()},
        "coloured_lags": white,
        "position_only": alone,
        "modes": modes,
    }
    from studies.figures.consistency import consistency_figure

    curves = {name: courses(rows) for name, rows in consistency[EXACT].items()}
    figures = {"consistency": consistency_figure(curves, EVERY * 1e-3, 4)}
    return Outcome(text, claims, figures, numbers)


def _consistency(work: Work, kind: str) -> dict[str, list[Mapping[str, Any]]]:
    """By estimator a row per run: squared error over covariance, and which samples count."""
    count = RUNS if kind == EXACT else RUNS_DRAWN[work.extent]
    runs, found = servo_runs(kind, RUNS, work.folder)[:count], {}
    for name in JUDGED:
        estimator = consistent(name)
        found[name] = [
            work.piece(f"consistency {kind} {name} {k}", lambda e=estimator, r=r: _run(e, r))
            for k, r in enumerate(runs)
        ]
    return found


def _coloured(work: Work, kind: str) -> dict[str, float]:
    """Share of lags at which the innovations of the first run are correlated, by estimator."""
    first, found = servo_runs(kind, RUNS, work.folder)[0], {}

    def one(estimator: Any) -> dict[str, float]:
        run = follow(estimator, first.commands[:, :SAMPLES], first.measured[:, :SAMPLES], 1)
        return {"share": float(np.mean(whiteness(run.innovations[:, LATE:])))}

    for name in JUDGED:
        piece = work.piece(f"whiteness {kind} {name}", lambda name=name: one(consistent(name)))
        found[name] = piece["share"]
    return found


def _run(estimator: Any, whole: TrueRun) -> dict[str, Any]:
    cut = {name: row[:SAMPLES] for name, row in whole.truth.items()}
    found = follow(estimator, whole.commands[:, :SAMPLES], whole.measured[:, :SAMPLES], EVERY)
    moving = (counted(whole.mode, AWAY) & (whole.mode != 1))[:SAMPLES]
    asked = slice(EVERY, None, EVERY)
    return {
        "nees": [*map(float, nees(found, cut)[asked])],
        "nis": [*map(float, found.nis[asked])],
        "moving": [*map(int, moving[asked])],
    }


def _velocity(work: Work, plant: str) -> dict[str, Any]:
    """RMS errors of the velocity by estimator and of the best filtered derivative, drawn truth."""
    count = RUNS_OF_A_PLANT[work.extent] + 1
    make = servo_runs if plant == "servo_drive" else gearbox_runs
    of = RUNS if plant == "servo_drive" else count
    first, *runs = make(DRAWN, of, work.folder)[:count]
    lean, velocity = BENCHES[plant]().lean(), VELOCITIES[plant]
    noise = work.piece(f"noise {plant}", lambda: tuned(lean, first, SAMPLES, work.say))
    found = {
        "derivative": work.piece(
            f"derivative {plant} {count}",
            lambda: {"rmse": derivative_rmse(runs, POSITION_ROWS[plant], velocity, LATE)},
        )["rmse"]
    }
    for name in ALL:
        estimator = made(name, lean, noise, start(lean))
        if name in REDUCED:
            own = work.piece(f"noise {plant} {name}", partial(_own, estimator, first, work.say))
            estimator = estimator.retuned(own)
        errors = [
            work.piece(f"velocity {plant} {name} {k}", partial(_error, estimator, r, velocity))[
                "rmse"
            ]
            for k, r in enumerate(runs)
        ]
        kept = np.array([np.nan if each is None else each for each in errors])
        found[name] = float(np.sqrt(np.mean(np.square(kept))))  # NaN where a run was lost
    return found


def _own(estimator: Any, first: TrueRun, say: Callable[[str], None]) -> dict[str, float]:
    """Process noise under which an estimator finds the start of a run likeliest."""
    u, y = first.commands[:, :SAMPLES], first.measured[:, :SAMPLES]
    return dict(own_noise(estimator, u, y, say).process_noise)


def _error(estimator: Any, r: TrueRun, state: str) -> dict[str, float | None]:
    """RMS error of a state, none where the estimator was lost."""
    try:
        found = follow(estimator, r.commands, r.measured, 0)
    except ArithmeticError:
        return {"rmse": None}
    return {"rmse": rmse((found.state(state) - r.truth[state])[LATE:])}


STUDY = Study(
    name="estimators",
    question="what do estimators know of velocity, pressures and modes, and do they know how well?",
    source="physics.md 2; Bar-Shalom, Li and Kirubarajan 2001, Sec. 5.4 and 11.6",
    run=run,
    plants=("servo_drive", "gearbox"),
    seeds="of the truth's cases, and the number of each run",
)
