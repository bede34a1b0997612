"""True runs on which estimators are judged: what the sensors read, and what was so.

They come from the truth simulators, whose code is not that of the model: a drive with the process
disturbance of physics.md section 2, a gearbox that is shifted, a soft joint whose spool sticks.
Runs are ``exact``, with the model's own parameters, or ``drawn``, off by their uncertainty and with
the small differences that every truth has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studies.truth import gearbox, gearbox_draw, gearbox_record, soft_joint_draw, soft_joint_record
from studies.truth.batch import stack
from studies.truth.case import generator
from studies.truth.draw import NOMINAL, draw, drive_of
from studies.truth.gearbox_run import open_loop
from studies.truth.instruments import quantised
from studies.truth.manoeuvre import training_reference
from studies.truth.run import closed_loop
from studies.truth.soft_joint import NEUTRAL
from workbench.plants.servo_drive import OUTPUTS as DRIVEN
from workbench.whole_file import whole_file

EXACT, DRAWN = "exact", "drawn"
SERVO_SAMPLES, GEARBOX_SAMPLES = 2000, 2000
HALF_WINDOW, RESTING_M_S = 5, 1e-3  # a slide rests where it moves less than this over 10 ms
SLIDES = ("slide -", "stick", "slide +")
VALVES = ("1 vents 2 vents", "1 vents 2 charges", "1 charges 2 vents", "1 charges 2 charges")
GEARBOX_PRESSURES = ("chamber_1.pressure_pa", "chamber_2.pressure_pa")


@dataclass(frozen=True)
class TrueRun:
    """One run, n samples.

    commands, measured    shapes (n_u, n) and (n_y, n)
    truth                 by state of the plant, (n,) each
    mode                  index of the true mode, (n,)
    """

    sample_time_s: float
    commands: np.ndarray
    measured: np.ndarray
    truth: Mapping[str, np.ndarray]
    mode: np.ndarray


def servo_runs(kind: str, count: int, folder: Path) -> list[TrueRun]:
    """The drive in the loop of its recordings, 2 s each, under the process disturbance."""

    def made() -> dict[str, np.ndarray]:
        cases = [draw(None, 5000 + k) for k in range(count)]
        drives = [drive_of(case) if kind == DRAWN else NOMINAL for case in cases]
        own = [
            [generator(None, case.seed, f"{purpose} of estimators") for case in cases]
            for purpose in ("noise", "disturbance")
        ]
        references = [
            training_reference(generator(None, case.seed, "training"))[:SERVO_SAMPLES]
            for case in cases
        ]
        run = closed_loop(drives, np.stack(references, axis=1), own[0], disturbances=own[1])
        read, true = run.readings, run.truth
        return dict(
            commands=read["command_v"][None],
            measured=np.stack([read["position_m"], read["pressure_a_pa"], read["pressure_b_pa"]]),
            truth=np.stack(
                [
                    true["position_m"],
                    true["velocity_m_s"],
                    true["true_pressure_a_pa"],
                    true["true_pressure_b_pa"],
                ]
            ),
        )

    names = (DRIVEN[0], "slide.velocity_m_s", *DRIVEN[1:])
    kept = _kept(folder / f"servo_{kind}_{count}.npz", made)
    return [
        TrueRun(1e-3, *_column(kept, k), _by_name(names, kept["truth"][..., k]),
                _sliding(kept["truth"][0, :, k]))
        for k in range(count)
    ]  # fmt: skip


def _sliding(position_m: np.ndarray) -> np.ndarray:
    """0, 1 or 2 where the slide goes down, rests or goes up, by its way over 10 ms."""
    ahead, behind = (np.roll(position_m, way * HALF_WINDOW) for way in (-1, 1))
    speed = (ahead - behind) / (2 * HALF_WINDOW * 1e-3)
    speed[:HALF_WINDOW], speed[-HALF_WINDOW:] = speed[HALF_WINDOW], speed[-HALF_WINDOW - 1]
    return 1 + np.where(np.abs(speed) < RESTING_M_S, 0, np.sign(speed)).astype(int)


def gearbox_runs(kind: str, count: int, folder: Path) -> list[TrueRun]:
    """The gearbox under the shifts of its training recordings, 2 s each; modes by valve."""

    def made() -> dict[str, np.ndarray]:
        cases = [gearbox_draw.draw(None, 5000 + k) for k in range(count)]
        boxes = [
            gearbox_draw.gearbox_of(case) if kind == DRAWN else gearbox_draw.NOMINAL
            for case in cases
        ]
        batch = stack(boxes)
        sent = [gearbox_record.commands(case, "training")[:GEARBOX_SAMPLES] for case in cases]
        sent = np.stack(sent, axis=2)
        every = tuple(range(GEARBOX_SAMPLES))
        read, states = open_loop(batch, sent, gearbox.at_rest(batch), keep=every)
        rng = np.random.default_rng(count)
        rows = [read["pressure_1_pa"], read["pressure_2_pa"], read["position_m"]]
        noise = (gearbox_record.PRESSURE_NOISE_PA,) * 2 + (gearbox_record.POSITION_NOISE_M,)
        grid = (gearbox_record.PRESSURE_STEP_PA,) * 2 + (gearbox_record.POSITION_STEP_M,)
        seen = [
            quantised(row + size * rng.standard_normal(row.shape), step)
            for row, size, step in zip(rows, noise, grid, strict=True)
        ]
        body = read["body"]
        lifts = np.stack([states[k].valve[1] for k in every])
        return dict(
            commands=sent.transpose(1, 0, 2),
            measured=np.stack(seen),
            truth=np.stack([body[:, 0], body[:, 3], *rows[:2]]),
            lifts=lifts.transpose(1, 0, 2),
        )

    names = ("main_piston.position_m", "main_piston.velocity_m_s", *GEARBOX_PRESSURES)
    kept = _kept(folder / f"gearbox_true_{kind}_{count}.npz", made)
    runs = []
    for k in range(count):
        on = (kept["lifts"][..., k] > gearbox.LIFT_M / 2).astype(int)
        truth = _by_name(names, kept["truth"][..., k])
        runs.append(TrueRun(1e-3, *_column(kept, k), truth, 2 * on[0] + on[1]))
    return runs


def soft_joint_runs(count: int) -> list[TrueRun]:
    """The soft joint with a spool that stays shut until the command has passed its band."""
    cases = [soft_joint_draw.draw("valve_stuck_band", 5000 + k) for k in range(count)]
    joints = stack([soft_joint_draw.joint_of(case) for case in cases])
    sent = np.stack([soft_joint_record.commands(case, "training") for case in cases], axis=1)
    read, _ = soft_joint_record.run(joints, sent)
    rng = np.random.default_rng(count)
    noise_pa = soft_joint_record.PRESSURE_NOISE_PA
    seen = read["pressure_pa"] + noise_pa * rng.standard_normal(sent.shape)
    seen = quantised(seen, soft_joint_record.PRESSURE_STEP_PA)
    runs = []
    for k in range(count):
        past, edge = sent[:, k] - NEUTRAL, joints.overlap_share[k]
        loose = -past > edge + joints.stuck_band_share[k]
        mode = np.where(past > edge, 2, np.where(loose, 0, 1))
        truth = {"bellows.pressure_pa": read["true_pressure_pa"][:, k]}
        runs.append(TrueRun(1.0 / 400, sent[None, :, k], seen[None, :, k], truth, mode))
    return runs


def counted(mode: np.ndarray, left_out: int) -> np.ndarray:
    """Samples that are not among the first ones of a phase, (n,)."""
    found = np.ones(len(mode), dtype=bool)
    for first in (0, *(np.flatnonzero(np.diff(mode)) + 1)):
        found[first : first + left_out] = False
    return found


def _column(kept: Mapping[str, np.ndarray], k: int) -> tuple[np.ndarray, np.ndarray]:
    return kept["commands"][..., k], kept["measured"][..., k]


def _by_name(names: Iterable[str], rows: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip(names, rows, strict=True))


def _kept(path: Path, made: Callable[[], dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Arrays of a file, which is made where it is not there."""
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        arrays = made()
        with whole_file(path) as unfinished, unfinished.open("wb") as file:
            np.savez(file, **arrays)
    with np.load(path) as file:
        return {name: file[name] for name in file.files}
