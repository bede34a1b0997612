"""Commissioning of a gearbox actuator: one recording of it, and what `fit` learns from that.

A technician plays 2.5 s of shifts, straight ones from end to end too, and pulses that end before
the piston has arrived.  The recording has the noise of the sensors at 1 kHz; the fit is that of
``workbench fit`` with the priors of the default rig.  Both are the same for every actuator.

The recorded actuator is one of the same equations with other parameters: what its model lacks is
asked elsewhere, by study ``hidden-effects``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from studies.gearbox_driving import manoeuvre
from studies.shift_check import NOISE, SHIFTS, Shift
from studies.study import Claim
from studies.text import columns
from studies.truth.gearbox_manoeuvre import validation_command
from workbench.fitting.fit import FitReport, fit
from workbench.plant import Plant
from workbench.plants.gearbox import gearbox
from workbench.recording import Recording
from workbench.rig import Rig, default_rig
from workbench.simulation import simulate

LASTS_S = 2.5
DRAWN_BY = 1  # seed of the technician's dwell times
NOISE_STREAM = 1  # beside the number of the actuator: no noise that a closed loop has


def played() -> Recording:
    """The commands that a technician plays, the same on every actuator."""
    whole = manoeuvre(validation_command, DRAWN_BY)
    return whole.part(0, round(LASTS_S / whole.sample_time_s))


def recorded(truth: Plant, number: int) -> Recording:
    """What the sensors of an actuator show of the commands, from Neutral, vented.

    ``number`` gives the noise.
    """
    commands = played()
    outputs = simulate(truth.lean(), commands)
    normal = np.random.default_rng((NOISE_STREAM, number))
    seen = {
        name: outputs[name] + NOISE[name] * normal.standard_normal(len(commands))
        for name in truth.measured
    }
    name = f"commissioning {number + 1}"
    return replace(commands, name=name, channels={**commands.channels, **seen})


def commissioned(truth: Plant, number: int) -> FitReport:
    """What the default rig becomes by a fit to one recording of an actuator."""
    return fit(_as_delivered(), [recorded(truth, number)])


@cache
def _as_delivered() -> Rig:
    """One for all actuators: its model is compiled once."""
    return default_rig(gearbox())


def reached_table(rows: dict[str, Iterable[Shift]]) -> str:
    """How many of the shifts each knowledge of the plant makes fast and soft, by shift."""
    head = ("fast and soft", *SHIFTS, "all")
    lines = []
    for name, found in rows.items():
        made = [(row.scenario, row.reached) for row in found]
        each = [[ok for scenario, ok in made if scenario == shift] for shift in SHIFTS]
        shares = [f"{sum(own)} of {len(own)}" for own in (*each, [ok for _, ok in made])]
        lines.append((name, *shares))
    return columns(head, lines)


def made_on_every_plant(who: str, rows: Iterable[Shift]) -> Iterator[Claim]:
    """That each of the four shifts is fast and soft in all of the rows."""
    rows = list(rows)
    for name in SHIFTS:
        made = [row.reached for row in rows if row.scenario == name]
        claim = f"{who}: {name} is fast and soft on every drawn plant"
        yield Claim(claim, f"{100.0 * float(np.mean(made)):.0f} % of them", all(made))


def claims(rows: Iterable[Shift], rivals: Iterable[Shift]) -> Iterator[Claim]:
    """What is claimed of shifts after commissioning, beside those as delivered."""
    rows, rivals = list(rows), list(rivals)
    yield from made_on_every_plant("after commissioning", rows)
    missed, before = (sum(not row.reached for row in found) for found in (rows, rivals))
    claim = "after commissioning fewer shifts are missed, or none"
    yield Claim(claim, f"{missed} instead of {before}", missed < before or missed == 0)
