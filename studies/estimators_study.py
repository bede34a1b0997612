"""Study ``estimators``: velocity, pressures, consistency and modes on true runs.

Every piece is kept in the folder, so that a second start goes on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from linearize.analysis import analyse_all
from linearize.standard import standard_modes
from studies.estimator_benches import (
    BENCHES,
    NUMERICAL,
    at_rest,
    consistent,
    derivative_rmse,
    made,
    position_only,
    start,
    tuned,
)
from studies.estimator_modes import modes_named
from studies.estimator_runs import band, follow, nees, rmse
from studies.estimator_truths import (
    DRAWN,
    EXACT,
    TrueRun,
    counted,
    gearbox_runs,
    servo_runs,
)
from studies.kept import Kept
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns, number, percent
from workbench.plants.servo_drive import OUTPUTS, servo_drive

JUDGED = ("ekf", "ukf", "mhe")  # for consistency; the others do not know the disturbance
ALL = ("kalman", "ekf", "ukf", "imm", "mhe")
RUNS = 50
RUNS_DRAWN = {Extent.QUICK: 10, Extent.FULL: RUNS}
RUNS_OF_A_PLANT = {Extent.QUICK: 3, Extent.FULL: 10}  # besides the one that tunes
SAMPLES = 1000  # of a run for consistency: a rest and a move
EVERY = 10  # samples of the error that is kept
AWAY = 50  # samples from the last change between rest and motion
LATE = 200  # first sample that is judged for velocity and pressure
VELOCITIES = {"servo_drive": "slide.velocity_m_s", "gearbox": "main_piston.velocity_m_s"}
POSITION_ROWS = {"servo_drive": 0, "gearbox": 2}
HALF, NEAR_PA = 0.5, 0.15e5
NAMED = 0.95


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
    work = Work(folder / "work", extent, Kept(folder / "work" / "rows.jsonl"), say)
    consistency = {kind: _consistency(work, kind) for kind in (EXACT, DRAWN)}
    velocity = {plant: _velocity(work, plant) for plant in VELOCITIES}
    seen = work.piece("observability by the position", _observability)
    alone = _position_only(work)
    modes = modes_named(work.piece, work.folder, RUNS_OF_A_PLANT[extent], say)
    claims = (
        *_velocity_claims(velocity),
        *_position_claims(seen, alone),
        *_consistency_claims(consistency[EXACT]),
        *_mode_claims(modes),
    )
    text = "\n\n".join(
        (
            _velocity_text(velocity),
            _consistency_text(consistency),
            _position_text(seen, alone),
            _modes_text(modes),
        )
    )
    numbers = {
        "velocity": velocity,
        "consistency": {k: {n: _summary(r) for n, r in v.items()} for k, v in consistency.items()},
        "position_only": {"observability": seen, "runs": alone},
        "modes": modes,
    }
    from studies.figures.consistency import consistency_figure

    curves = {name: _courses(rows) for name, rows in consistency[EXACT].items()}
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


def _courses(rows: Sequence[Mapping[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Mean over the runs that move at a sample, NaN where fewer than half do, and how many."""
    values, moving = (np.array([row[key] for row in rows]) for key in ("nees", "moving"))
    there = moving.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(there >= len(rows) / 2, (values * moving).sum(axis=0) / there, np.nan)
    return mean, there


def _summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Means over moving samples of all runs, and the share of samples inside their own band."""
    values, nis, moving = (
        np.array([row[key] for row in rows], dtype=float) for key in ("nees", "nis", "moving")
    )
    mean, there = _courses(rows)
    judged = [(m, *band(4, n)) for m, n in zip(mean, there, strict=True) if np.isfinite(m)]
    inside = [low <= m <= high for m, low, high in judged]
    low, high = band(4, len(rows))
    return {
        "nees": float(values[moving > 0].mean()),
        "low": low,
        "high": high,
        "inside": float(np.mean(inside)) if inside else float("nan"),
        "nis": float(nis[moving > 0].mean()),
        "runs": len(rows),
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
        errors = [
            work.piece(
                f"velocity {plant} {name} {k}",
                lambda r=r, name=name: {"rmse": _error(name, lean, noise, r, velocity)},
            )["rmse"]
            for k, r in enumerate(runs)
        ]
        found[name] = float(np.sqrt(np.mean(np.square(errors))))
    return found


def _error(name: str, plant: Any, noise: Mapping[str, float], r: TrueRun, state: str) -> float:
    found = follow(made(name, plant, noise, start(plant)), r.commands, r.measured, 0)
    return rmse((found.state(state) - r.truth[state])[LATE:])


def _observability() -> dict[str, Any]:
    """In how many modes of the drive the position alone sees all of the state."""
    plant = servo_drive().lean()
    reports = analyse_all(standard_modes(plant))
    full = [report.seen_from[OUTPUTS[0]] == len(report.poles) for report in reports]
    stuck = [report.name for report, whole in zip(reports, full, strict=True) if not whole]
    return {"modes": len(reports), "whole": int(sum(full)), "not": stuck}


def _position_only(work: Work) -> list[Mapping[str, Any]]:
    """Errors of both pressures in motion from the position alone, a row per run."""
    plant = position_only()
    noise = NUMERICAL | plant.process_noise
    wide = at_rest(plant) | dict.fromkeys(OUTPUTS[1:], 0.3e5)
    wide |= {n: 0.05 * float(s) for n, s in zip(plant.model.states, plant.initial, strict=True)
             if n.endswith(".mass_kg")}  # fmt: skip
    estimator = made("ekf", plant, noise, wide)

    def one(r: TrueRun) -> dict[str, float]:
        found = follow(estimator, r.commands, r.measured[:1], 0)
        moving = counted(r.mode, AWAY) & (r.mode != 1)
        moving[:LATE] = False
        errors = [(found.state(name) - r.truth[name])[moving] for name in OUTPUTS[1:]]
        return {"a": rmse(errors[0]), "b": rmse(errors[1])}

    count = RUNS_OF_A_PLANT[work.extent]
    runs = servo_runs(EXACT, RUNS, work.folder)[:count]
    return [work.piece(f"position only {k}", lambda r=r: one(r)) for k, r in enumerate(runs)]


def _velocity_claims(found: Mapping[str, Mapping[str, float]]) -> Iterator[Claim]:
    for plant, rows in found.items():
        told = ", ".join(f"{name} {number(rows[name] / rows['derivative'], 3)}" for name in ALL)
        yield Claim(
            f"{plant}: the EKF's velocity error is below half of the filtered derivative's",
            told,
            rows["ekf"] < HALF * rows["derivative"],
        )


def _position_claims(
    seen: Mapping[str, Any], alone: Sequence[Mapping[str, float]]
) -> Iterator[Claim]:
    worst = max(max(row["a"], row["b"]) for row in alone)
    yield Claim(
        "servo_drive, position alone: pressures in motion within 0.15 bar",
        f"{1e-5 * worst:.3f} bar RMS in the worst of {len(alone)} runs",
        worst < NEAR_PA,
    )
    yield Claim(
        "servo_drive, position alone: all modes that slide are observable",
        f"{seen['whole']} of {seen['modes']} modes; not: sticking",
        all("stick" in name for name in seen["not"]),
    )


def _consistency_claims(found: Mapping[str, Sequence[Mapping[str, Any]]]) -> Iterator[Claim]:
    for name, rows in found.items():
        s = _summary(rows)
        yield Claim(
            f"{name}: NEES over {s['runs']} runs inside its 95 % band",
            f"{s['nees']:.2f} of {s['low']:.2f} to {s['high']:.2f}",
            s["low"] <= s["nees"] <= s["high"],
        )


def _mode_claims(found: Mapping[str, Mapping[str, float]]) -> Iterator[Claim]:
    for what, row in found.items():
        yield Claim(
            f"IMM names {what} in 95 % of samples", percent(row["share"], 1), row["share"] >= NAMED
        )


def _velocity_text(found: Mapping[str, Mapping[str, float]]) -> str:
    head = ("velocity RMSE m/s, drawn truth", "derivative", *ALL)
    lines = [
        (plant, *(number(rows[name], 3) for name in ("derivative", *ALL)))
        for plant, rows in found.items()
    ]
    return f"{columns(head, lines)}\nthe derivative has the lag that is best for it"


def _consistency_text(found: Mapping[str, Mapping[str, Sequence[Mapping[str, Any]]]]) -> str:
    head = ("truth", "estimator", "runs", "NEES", "band", "samples inside", "NIS of 3")
    lines = []
    for kind, rows in found.items():
        for name, several in rows.items():
            s = _summary(several)
            ends = f"{s['low']:.2f} to {s['high']:.2f}"
            lines.append(
                (kind, name, str(s["runs"]), number(s["nees"], 3), ends,
                 percent(s["inside"]), number(s["nis"], 3))
            )  # fmt: skip
    return f"{columns(head, lines)}\nposition, velocity and pressures in motion; drawn not judged"


def _position_text(seen: Mapping[str, Any], alone: Sequence[Mapping[str, float]]) -> str:
    lines = [
        (str(k), number(1e-5 * row["a"], 3), number(1e-5 * row["b"], 3))
        for k, row in enumerate(alone)
    ]
    told = f"the position alone sees the whole state in {seen['whole']} of {seen['modes']} modes"
    return f"{told}\n{columns(('run', 'pressure a RMSE bar', 'pressure b RMSE bar'), lines)}"


def _modes_text(found: Mapping[str, Mapping[str, float]]) -> str:
    head = ("IMM names", "right", "counted", "phases")
    lines = [
        (what, percent(r["share"], 1), percent(r["counted"]), f"{r['phases']:.0f}")
        for what, r in found.items()
    ]
    return f"{columns(head, lines)}\nwithout the first 10 ms of each phase"


STUDY = Study(
    name="estimators",
    question="what do estimators know of velocity, pressures and modes, and do they know how well?",
    source="physics.md 2; Bar-Shalom, Li and Kirubarajan 2001, Sec. 5.4 and 11.6",
    run=run,
)
