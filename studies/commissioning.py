"""Commissioning of a gearbox actuator: one recording of it, and what `fit` learns from that.

A technician plays 2.5 s of shifts, straight ones from end to end too, and between them pulses as
short as those with which a design brakes.  Without these a fit finds valves that do the same as the
true ones while they are held for tens of milliseconds, and not after six.  The recording has the
noise of the sensors at 1 kHz; the fit is that of ``workbench fit`` with the priors of the default
rig.  Both are the same for every actuator.

The recorded actuator is one of the same equations with other parameters: what its model lacks is
asked elsewhere, by study ``hidden-effects``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from studies.gearbox_driving import SAMPLE_TIME_S, manoeuvre
from studies.shift_check import NOISE, SHIFTS, Shift
from studies.study import Claim
from studies.text import columns
from studies.truth.gearbox_manoeuvre import HIGH, LOW, NEUTRAL, RELEASED
from workbench.fitting.fit import FitReport, fit
from workbench.plant import Plant
from workbench.plants.gearbox import gearbox
from workbench.recording import Recording
from workbench.rig import Rig, default_rig
from workbench.simulation import simulate

LASTS_S = 2.5
DRAWN_BY = 1  # seed of the technician's dwell times
NOISE_STREAM = 1  # beside the number of the actuator: no noise that a closed loop has


def commissioning_command(rng: np.random.Generator) -> np.ndarray:
    """Shifts by way of Neutral, and pulses of 5 to 16 ms of either valve or both, shape (n, 2)."""
    pieces = [(RELEASED, 0.08)]
    while sum(lasts_s for _, lasts_s in pieces) < LASTS_S:
        pieces += [((HIGH, LOW)[rng.integers(2)], rng.uniform(0.05, 0.08))]
        pieces += [(RELEASED, rng.uniform(0.05, 0.1))]
        for _ in range(rng.integers(3, 6)):
            pieces += [((HIGH, LOW, NEUTRAL)[rng.integers(3)], rng.uniform(0.005, 0.016))]
            pieces += [(RELEASED, rng.uniform(0.008, 0.05))]
        pieces += [(NEUTRAL, rng.uniform(0.05, 0.08)), (RELEASED, rng.uniform(0.05, 0.1))]
        for _ in range(rng.integers(2, 4)):
            pieces += [((HIGH, LOW)[rng.integers(2)], rng.uniform(0.006, 0.012))]
            pieces += [(RELEASED, rng.uniform(0.01, 0.04))]
    rows = [np.repeat([each], round(s / SAMPLE_TIME_S), axis=0) for each, s in pieces]
    return np.concatenate(rows)[: round(LASTS_S / SAMPLE_TIME_S)].astype(float)


def played() -> Recording:
    """The commands that a technician plays, the same on every actuator."""
    return manoeuvre(commissioning_command, DRAWN_BY)


def recorded(truth: Plant, number: int, commands: Recording | None = None) -> Recording:
    """What the sensors of an actuator show of the commands, from Neutral, vented.

    ``number`` gives the noise; the commands are those of a commissioning by default.
    """
    commands = commands or played()
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
