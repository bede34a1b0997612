"""Open-loop recordings of the true rig, as papers 000 and 001 made them on theirs.

The rig is ``studies/truth``, with the small differences of its drawn cases: a valve of second
order, walls that take heat, a bent area law, slow sensors, friction along the stroke.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.papers.loops import Pid
from studies.truth import crr_rig as true
from studies.truth.batch import stack
from studies.truth.crr_rig_draw import draw, rig_of
from studies.truth.crr_rig_integrate import advance, bench, observed, open_loop
from studies.truth.crr_rig_record import (
    COMMAND_STEP_V,
    POSITION_NOISE_M,
    PRESSURE_NOISE_PA,
    PRESSURE_STEP_PA,
)
from studies.truth.instruments import quantised
from workbench.contracts import Estimate

FIXED_KG = 1e12  # a piston that does not move
SUBSTEPS = 10  # of a millisecond where the piston is fixed; half as many change nothing


@dataclass(frozen=True)
class Runs:
    """What the sensors show of several runs, shape (n_samples, n_runs), and the true rig.

    supply_pa, velocity_m_s    without noise
    """

    rig: true.CrrRig
    command_v: np.ndarray
    position_m: np.ndarray
    velocity_m_s: np.ndarray
    cap_pa: np.ndarray
    rod_side_pa: np.ndarray
    supply_pa: np.ndarray


def true_rig(seed: int) -> true.CrrRig:
    """The rig with its small differences, nothing hidden."""
    return rig_of(draw(None, seed))


def recorded(
    rig: true.CrrRig,
    command_v: np.ndarray,
    start_m: np.ndarray,
    start_pa: np.ndarray | float = true.REST_PA,
    *,
    fixed: bool = False,
    supply_pa: np.ndarray | None = None,
    substeps: int = 25,
    seed: int = 0,
) -> Runs:
    """Open-loop runs at 1 kHz from rest.

    Parameters
    ----------
    command_v
        Shape (n_samples, n_runs).
    start_m
        Shape (n_runs,).
    start_pa
        Of both chambers, a number or shape (2, n_runs).
    supply_pa
        Of each run, shape (n_runs,); the rig's own by default.
    """
    n = command_v.shape[1]
    own = replace(rig, moving_mass_kg=FIXED_KG) if fixed else rig
    supplied = np.full(n, own.supply_pressure_pa) if supply_pa is None else supply_pa
    batch = stack([replace(own, supply_pressure_pa=float(each)) for each in supplied])
    seen = open_loop(batch, command_v, true.at_rest(batch, start_m, start_pa), substeps)
    random = np.random.default_rng([seed, n])

    def read(name: str, noise: float, step: float) -> np.ndarray:
        return quantised(seen[name] + noise * random.standard_normal(seen[name].shape), step)

    return Runs(
        rig=rig,
        command_v=command_v,
        position_m=read("position_m", POSITION_NOISE_M, true.STROKE_M / 4096),
        velocity_m_s=seen["velocity_m_s"],
        cap_pa=read("cap_pressure_pa", PRESSURE_NOISE_PA, PRESSURE_STEP_PA),
        rod_side_pa=read("rod_pressure_pa", PRESSURE_NOISE_PA, PRESSURE_STEP_PA),
        supply_pa=seen["supply_pa"],
    )


def followed(
    rig: true.CrrRig, pids: Sequence[Pid], references_m: np.ndarray, substeps: int = 20
) -> tuple[np.ndarray, np.ndarray]:
    """True position and velocity, shape (n_samples, n_runs), under a position loop each.

    The loops see a noisy potentiometer and send through a converter of 12 bits; all start at rest
    where their references, of the same shape, begin.
    """
    n = len(pids)
    prepared = bench(stack([rig] * n), substeps)
    state = true.at_rest(prepared.rig, references_m[0])
    noise = POSITION_NOISE_M * np.random.default_rng(5).standard_normal(references_m.shape)
    commands = [pid.start() for pid in pids]
    rows = []
    for k, wanted in enumerate(references_m):
        seen = observed(state)
        rows.append((seen["true_position_m"], seen["velocity_m_s"]))
        read = quantised(seen["position_m"] + noise[k], true.STROKE_M / 4096)
        commands = [
            pid.step(last, np.array([[r]]), Estimate((pid.signal,), np.array([y]), np.eye(1)))
            for pid, last, r, y in zip(pids, commands, wanted, read, strict=True)
        ]
        sent = np.array([each.value[0] for each in commands])
        state = advance(prepared, state, quantised(sent, COMMAND_STEP_V))
    position, velocity = np.array(rows).transpose(1, 0, 2)
    return position, velocity
