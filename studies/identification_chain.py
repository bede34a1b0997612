"""One identified result after the other, taken over by the drive, and what its free run gains.

The valve is measured on a tank and goes onto the drive (``--into`` on the command line): one whose
area is that of the true drive, unlike that of the flow study's own tank.  The judge is a sine of
the command that no procedure saw: paper 002, Fig. 20 and Table 7 (S002-11).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from studies.identification import DRIVE, WRONG_DRIVE, Answer, recording, recordings_of_flow
from studies.text import columns, shown
from studies.truth import dedicated as truth
from workbench.comparison.compare import FREE_RUN, compare
from workbench.identification import PROCEDURES
from workbench.identification.tank_curves import tank_curves
from workbench.recording import Recording
from workbench.rig import Rig, load_rig

TABLE_7 = {
    "slide.position_m": 0.46e-3,
    "chamber_a.pressure_pa": 0.148e5,
    "chamber_b.pressure_pa": 0.209e5,
}
"""RMSE of paper 002, Table 7."""
VALVE = truth.TankValve(
    supply_exponent=DRIVE.area_exponent, exhaust_exponent=DRIVE.area_exponent, ripple=0.0
)
CURVES_EVERY_V = 1.0
AMPLITUDE_V, FREQUENCY_HZ, LENGTH_S, START_M = 0.8, 0.5, 4.0, 0.04


@dataclass(frozen=True)
class Step:
    """The drive behind one procedure, and the RMSE of its free run by signal."""

    name: str
    rig: Rig
    errors: Mapping[str, float]


def sine() -> Recording:
    """The drive under a sine of the command, open loop."""
    time_s = 1e-3 * np.arange(round(1e3 * LENGTH_S))
    command_v = 4.95 + AMPLITUDE_V * np.sin(2 * np.pi * FREQUENCY_HZ * time_s)
    (seen,) = truth.commanded(DRIVE, command_v[:, None], np.array([START_M]), 9, substeps=25)
    return recording(seen, "sine")


def chain(found: Mapping[str, Answer], held_out: Recording) -> list[Step]:
    """The drive as it was bought, then with one result more at each step."""
    rig, results = load_rig(WRONG_DRIVE), {name: each.found for name, each in found.items()}
    curves = recordings_of_flow(CURVES_EVERY_V, truth.Tank(VALVE))
    results["flow"] = tank_curves(results["dead-zone"].improved(), curves)
    steps = [Step("as it was bought", rig, _errors(rig, held_out))]
    for name in PROCEDURES:
        rig = results[name].improved(rig)
        steps.append(Step(f"+ {name}", rig, _errors(rig, held_out)))
    return steps


def _errors(rig: Rig, held_out: Recording) -> dict[str, float]:
    told = compare(rig, [held_out]).recordings[0].errors[FREE_RUN]
    return {name: told[name].rmse for name in TABLE_7}


def chain_text(steps: list[Step]) -> str:
    """RMSE of the free run on the held-out sine, step by step."""
    rows = [(step.name, *(shown(step.errors[name], name, 3) for name in TABLE_7)) for step in steps]
    rows.append(("paper 002, Table 7", *(shown(x, name, 3) for name, x in TABLE_7.items())))
    return columns(("free run, RMSE", "position", "pressure a", "pressure b"), rows)
